"""Tasks: portions of a plan's episodes for workers to run, and their overall progress."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, NamedTuple

from artde_gym.evaluation.cells import Cell, shared_kwargs, single_of, vector_of
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.registered import METRICS, require_metrics
from artde_gym.evaluation.rollout import Episode, Policy, run_episode
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.vector_rollout import run_vector
from artde_gym.registration import ControllerSpec

CHUNK = 2500
"""Most episodes that run at once in a vector environment: no result depends on it, and more is hardly faster."""


SIDE_BY_SIDE = 128
"""As `CHUNK`, of cells that run side by side: more would be little faster, and an interruption loses what runs."""


class Case(NamedTuple):
    """One controller in one cell; `seed` is the base seed of all its episodes."""

    cell: Cell
    controller: str
    policy: Policy | ControllerSpec
    gains: dict[str, Any]
    seed: int


class Task(NamedTuple):
    """Episodes of one controller that run at once: one, or a chunk. The first `record_episodes` leave traces.

    `cells` are those of the episodes, which differ from `cell` by name and disturbances alone. `metrics` are the
    registered ones that the process must know.
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
    cells: tuple[Cell, ...]
    metrics: tuple[str, ...] = ()


class Update(NamedTuple):
    """Progress of an evaluation: one task's simulated time (s) and end, and the number of finished episodes."""

    task: Task
    time_s: float
    ended: bool
    finished: int
    total: int


class Progress:
    """Counter of finished episodes, reported to `on_progress` whenever a task advances or ends.

    Args:
        finished: number of episodes finished before.
        total: number of all episodes.
        on_progress: called with each update; None for no reports.
    """

    def __init__(self, finished: int, total: int, on_progress: Callable[[Update], None] | None) -> None:
        self._finished, self._total = finished, total
        self._on_progress = on_progress

    def running(self, task: Task, time_s: float) -> None:
        """Report a task's simulated time."""
        self._tell(task, time_s, False)

    def ended(self, task: Task, results: list[Episode]) -> None:
        """Count a task's episodes and report its end."""
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
    together: bool = False,
) -> Iterator[Task]:
    """Yield tasks for the episodes of all cases, chunk by chunk, so that an interruption leaves whole comparisons.

    Args:
        cases: the cases to run; no two share both the cell's name and the controller.
        episodes: number per case.
        vectorized: whether chunks run in vector environments.
        done: cell's name, controller and number of the episodes to leave out.
        record_episodes: the first so many episodes of each case leave traces.
        record_hz: rate of the traces.
        together: whether cases of one controller, whose cells differ by disturbances alone, run at once in a vector.
    """
    groups = _groups(cases) if together and vectorized else [[case] for case in cases]
    largest = max(map(len, groups), default=1)
    size = 1 if not vectorized else max(1, SIDE_BY_SIDE // largest) if largest > 1 else CHUNK
    for chunk in chunks_of(episodes, size):
        for group in groups:
            left = [
                (case, episode)
                for case, episode in itertools.product(group, chunk)
                if (case.cell.name, case.controller, episode) not in done
            ]
            if left:
                left.sort(key=lambda run: run[1] >= record_episodes)  # a vector leaves traces of its first ones
                yield _task(left, vectorized, record_episodes, record_hz)


def _groups(cases: Collection[Case]) -> list[list[Case]]:
    """Put cases together that one vector and one policy can run."""
    groups: dict[str, list[Case]] = {}
    for case in cases:
        cell = case.cell
        key = (case.controller, case.seed, cell.env_id, shared_kwargs(cell), cell.phases, case.gains)
        groups.setdefault(repr(key), []).append(case)
    return list(groups.values())


def task_of(
    case: Case, episodes: Iterable[int], vectorized: bool, *, record_episodes: int = 0, record_hz: float = 100.0
) -> Task:
    """Put some episodes of a case into one task."""
    return _task([(case, episode) for episode in episodes], vectorized, record_episodes, record_hz)


def _task(runs: list[tuple[Case, int]], vectorized: bool, record_episodes: int, record_hz: float) -> Task:
    case, numbers = runs[0][0], [episode for _, episode in runs]
    seeds = [episode_seed(one.seed, episode) for one, episode in runs]
    shown, cells = sum(episode < record_episodes for episode in numbers), tuple(one.cell for one, _ in runs)
    who = (case.cell, case.controller, case.policy, case.gains)
    return Task(vectorized, *who, numbers, seeds, record_hz, shown, cells, tuple(METRICS))


def chunks_of(episodes: int, size: int) -> list[range]:
    """Divide episodes into nearly equal ranges of at most `size`."""
    count = -(-episodes // size)
    edges = [episodes * i // count for i in range(count + 1)]
    return [range(first, stop) for first, stop in itertools.pairwise(edges)]


def run_task(task: Task, on_progress: Callable[[float], None]) -> list[Episode]:
    """Run the episodes of a task; `on_progress` is called with the simulated time (s)."""
    require_metrics(task.metrics)
    options: dict[str, Any] = {"record_hz": task.record_hz, "phases": task.cell.phases, "on_progress": on_progress}
    if task.vectorized:
        env, reset_options = vector_of(task.cells)
        policy = policy_for(task.policy, env, task.gains)
        return run_vector(
            env, policy, task.seeds, options=reset_options, record_episodes=task.record_episodes, **options
        )
    env, reset_options = single_of(task.cell)
    policy = policy_for(task.policy, env, task.gains)
    results = [run_episode(env, policy, seed, options=reset_options, **options) for seed in task.seeds]
    return [result if i < task.record_episodes else Episode(result.row, {}) for i, result in enumerate(results)]


def labels_of(task: Task, number: int) -> dict[str, Any]:
    """Return the columns that identify a row's episode: the task's episode at index `number`."""
    return {
        "controller": task.controller,
        "env": task.cell.env_id,
        "scenario": task.cells[number].name,
        "seed": task.seeds[number],
        "episode": task.episodes[number],
    }
