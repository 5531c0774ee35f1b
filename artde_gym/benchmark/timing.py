"""Timing of variants in turns, each by its own computing time."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Hashable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from artde_gym.errors import OptionError
from artde_gym.registration import make_controller

TURN = 50
"""Steps of a variant before the next one's turn."""

Job = Callable[[], None]
Key = TypeVar("Key", bound=Hashable)


def in_turns(
    variants: Mapping[Key, Callable[[], Job]], rounds: int, clock: Callable[[], float] = time.process_time
) -> dict[Key, float]:
    """Measure the seconds that each variant takes for its job of a round, which it prepares untimed.

    All of them advance in turns, so that drift of the machine's speed affects all equally; a variant's time is the
    median of its turns, which is insensitive to bursts of other work.

    Args:
        variants: key -> function that prepares a job.
        rounds: number of rounds of all variants.
        clock: by default this process's computing time; `time.perf_counter` for threads and workers.
    """
    turns: dict[Key, list[float]] = {key: [] for key in variants}
    for _ in range(rounds):
        for key, prepare in variants.items():
            job = prepare()
            start = clock()
            job()
            turns[key].append(clock() - start)
    return {key: statistics.median(durations) for key, durations in turns.items()}


class ClosedLoop:
    """A controller that drives an environment, or a vector of them; `actions` records its actions."""

    def __init__(self, name: str, env: Any, turn: int = TURN) -> None:
        self.env, self._turn = env, turn
        self.policy = make_controller(name, env)
        self.observation, _ = env.reset(seed=0)
        self.state = None
        self.actions: list[np.ndarray] = []

    def turn(self) -> Job:
        return self._advance

    def _advance(self) -> None:
        for _ in range(self._turn):
            action, self.state = self.policy.predict(self.observation, self.state)
            self.observation, *_ = self.env.step(action)
            self.actions.append(action)


class Replay:
    """Repetition of a closed loop's last actions, in an environment alone."""

    def __init__(self, loop: ClosedLoop, env: Any, turn: int = TURN) -> None:
        self.loop, self.env, self._turn = loop, env, turn
        env.reset(seed=0)

    def turn(self) -> Job:
        actions = [self.convert(action) for action in self.loop.actions[-self._turn :]]

        def job() -> None:
            for action in actions:
                self.step(action)

        return job

    def convert(self, action: np.ndarray) -> Any:
        """Convert an action to the form that `step` takes; not timed."""
        return action

    def step(self, action: Any) -> None:
        """Run one control period."""
        self.env.step(action)


MEMORY = Path("/proc/self/statm")
"""Memory of this process on Linux; other systems do not have the file."""


def resident() -> int:
    """Return the resident memory of this process (bytes).

    Raises:
        OptionError: on systems other than Linux.
    """
    if not MEMORY.exists():
        raise OptionError("operating system", platform.system(), "Linux, where /proc has a process's memory")
    pages = int(MEMORY.read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
