"""How things are timed: all variants in turns, each by its own computing time."""

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
"""Steps that a variant does before it is the next one's turn."""

Job = Callable[[], None]
Key = TypeVar("Key", bound=Hashable)


def in_turns(
    variants: Mapping[Key, Callable[[], Job]], rounds: int, clock: Callable[[], float] = time.process_time
) -> dict[Key, float]:
    """Seconds that each variant takes for its job of a round, which it prepares untimed.

    All of them advance in turns, so that a machine whose speed drifts is as fast for each; a variant's time is the
    median of its turns, which a burst of other work on the machine does not move.

    Args:
        variants: key -> what prepares a job.
        rounds: of all variants.
        clock: computing time of this process, other processes' left out; `time.perf_counter` for threads and workers.
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
    """A controller drives an environment, or a vector of them; `actions` remembers how."""

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
    """The last actions of a closed loop once more, in an environment alone."""

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
        """An action as `step` takes it; not timed."""
        return action

    def step(self, action: Any) -> None:
        """One control period."""
        self.env.step(action)


MEMORY = Path("/proc/self/statm")
"""Where Linux tells the memory of a process; other systems do not have it."""


def resident() -> int:
    """Return the resident memory of this process (bytes).

    Raises:
        OptionError: on systems other than Linux.
    """
    if not MEMORY.exists():
        raise OptionError("operating system", platform.system(), "Linux, which tells a process its memory in /proc")
    pages = int(MEMORY.read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")
