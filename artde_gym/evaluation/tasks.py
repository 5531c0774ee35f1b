"""Tasks: the episodes of a plan in portions that workers run, and the progress of them all."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, NamedTuple

from artde_gym.evaluation.cells import Cell, single_of, vector_of
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.registered import METRICS, require_metrics
from artde_gym.evaluation.rollout import Episode, Policy, run_episode
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.vector_rollout import run_vector
from artde_gym.registration import ControllerSpec

CHUNK = 2500
"""Most episodes that run at once in a vector environment: no result depends on it, and more would be little faster."""


class Case(NamedTuple):
    """One controller in one cell; `seed` is that of all its episodes."""

    cell: Cell
    controller: str
    policy: Policy | ControllerSpec
    gains: dict[str, Any]
    seed: int


class Task(NamedTuple):
    """Episodes of one controller that run at once: a single one, or a chunk. The first `record_episodes` leave traces.

    `metrics` are the registered ones that the process must know.
    """

    vectorized: bool
    cell: Cell
    controller: str
    policy: Policy | ControllerSpec
    gains: dict[str, Any]
    episodes: list[int]
    seeds: list[int]
    record_hz: float
    record_episodes: int
    metrics: tuple[str, ...] = ()


class Update(NamedTuple):
    """Progress of an evaluation: one task's simulated time (s), whether it has ended, and how many episodes have."""

    task: Task
    time_s: float
    ended: bool
    finished: int
    total: int


class Progress:
    """Count of finished episodes, told to `on_progress` whenever a task goes on or ends.

    Args:
        finished: how many there are already.
        total: how many there will be.
        on_progress: called with the news; None for nobody.
    """

    def __init__(self, finished: int, total: int, on_progress: Callable[[Update], None] | None) -> None:
        self._finished, self._total = finished, total
        self._on_progress = on_progress

    def running(self, task: Task, time_s: float) -> None:
        """Tell how far a task is."""
        self._tell(task, time_s, False)

    def ended(self, task: Task, results: list[Episode]) -> None:
        """Count a task's episodes."""
        self._finished += len(results)
        self._tell(task, max(result.row["duration_s"] for result in results), True)

    def _tell(self, task: Task, time_s: float, ended: bool) -> None:
        if self._on_progress is not None:
            self._on_progress(Update(task, time_s, ended, self._finished, self._total))


def tasks_of(
    cases: Collection[Case],
    episodes: int,
    vectorized: bool,
    done: Collection[tuple[str, str, int]],
    *,
    record_episodes: int = 0,
    record_hz: float = 100.0,
) -> Iterator[Task]:
    """Portion out the episodes of all cases, chunk by chunk, so that an interruption leaves whole comparisons behind.

    Args:
        cases: what is run; no two have both the cell's name and the controller in common.
        episodes: of each case.
        vectorized: of all of them.
        done: cell's name, controller and number of the episodes that are left out.
        record_episodes: the first so many episodes of each case leave traces.
        record_hz: rate of the traces.
    """
    for chunk in chunks_of(episodes, 1 if not vectorized else CHUNK):
        for case in cases:
            left = [episode for episode in chunk if (case.cell.name, case.controller, episode) not in done]
            if left:
                yield task_of(case, left, vectorized, record_episodes=record_episodes, record_hz=record_hz)


def task_of(
    case: Case, episodes: Iterable[int], vectorized: bool, *, record_episodes: int = 0, record_hz: float = 100.0
) -> Task:
    """Put some episodes of a case into one task."""
    numbers = list(episodes)
    seeds = [episode_seed(case.seed, episode) for episode in numbers]
    shown = sum(episode < record_episodes for episode in numbers)
    return Task(
        vectorized,
        case.cell,
        case.controller,
        case.policy,
        case.gains,
        numbers,
        seeds,
        record_hz,
        shown,
        tuple(METRICS),
    )


def chunks_of(episodes: int, size: int) -> list[range]:
    """Divide episodes into equal runs of at most `size`."""
    count = -(-episodes // size)
    edges = [episodes * i // count for i in range(count + 1)]
    return [range(first, stop) for first, stop in itertools.pairwise(edges)]


def run_task(task: Task, on_progress: Callable[[float], None]) -> list[Episode]:
    """Run the episodes of a task; `on_progress` is called with the simulated time (s)."""
    require_metrics(task.metrics)
    options: dict[str, Any] = {"record_hz": task.record_hz, "phases": task.cell.phases, "on_progress": on_progress}
    if task.vectorized:
        env = vector_of(task.cell, len(task.seeds))
        policy = policy_for(task.policy, env, task.gains)
        return run_vector(env, policy, task.seeds, record_episodes=task.record_episodes, **options)
    env, reset_options = single_of(task.cell)
    policy = policy_for(task.policy, env, task.gains)
    results = [run_episode(env, policy, seed, options=reset_options, **options) for seed in task.seeds]
    return [result if i < task.record_episodes else Episode(result.row, {}) for i, result in enumerate(results)]


def labels_of(task: Task, number: int) -> dict[str, Any]:
    """Name the columns that say which episode a row is of: the task's episode at place `number`."""
    return {
        "controller": task.controller,
        "env": task.cell.env_id,
        "scenario": task.cell.name,
        "seed": task.seeds[number],
        "episode": task.episodes[number],
    }
