"""Tasks: portions of a plan's episodes for workers to run, and their overall progress."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from artde_gym.evaluation.cells import Cell, shared_kwargs, single_of, vector_of
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.registered import METRICS, require_metrics
from artde_gym.evaluation.rollout import Episode, Policy, run_episode
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.side_by_side import SideBySide
from artde_gym.evaluation.vector_rollout import run_vector
from artde_gym.registration import ControllerSpec

CHUNK = 2500
"""Most episodes of a controller that run at once in a vector environment, and about as many of several controllers: no
result depends on it, and more is hardly faster."""

SIDE_BY_SIDE = 128
"""As `CHUNK`, of a controller in cells that run side by side: more would be little faster, and an interruption loses
what runs."""


class Case(NamedTuple):
    """One controller in one cell; `seed` is the base seed of all its episodes."""

    cell: Cell
    controller: str
    policy: Policy | ControllerSpec
    gains: dict[str, Any]
    seed: int


Run = tuple[Case, int]
"""A case, and the number of one of its episodes."""


class Task(NamedTuple):
    """Episodes that run at once: one, or some of controllers that share a vector environment.

    `cases` are those of the episodes; their cells differ by name and disturbances alone. The first `record_episodes` of
    each case leave traces. `metrics` are the registered ones that the process must know. `numbered` says in errors what
    the numbers in `episodes` count.
    """

    vectorized: bool
    cases: tuple[Case, ...]
    episodes: list[int]
    seeds: list[int]
    record_hz: float
    record_episodes: int
    metrics: tuple[str, ...] = ()
    numbered: str = "episode"

    @property
    def cell(self) -> Cell:
        """The cell of the first episode."""
        return self.cases[0].cell

    @property
    def cells(self) -> list[Cell]:
        """The cell of each episode."""
        return [case.cell for case in self.cases]

    @property
    def controller(self) -> str:
        """The controllers, separated by commas."""
        return ", ".join(dict.fromkeys(case.controller for case in self.cases))

    def label(self, number: int) -> str:
        """Name the task's episode at index `number` in errors."""
        case = self.cases[number]
        return f"{case.controller} in {case.cell.name}, {self.numbered} {self.episodes[number]}"


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
    workers: int = 1,
) -> Iterator[Task]:
    """Yield tasks for the episodes of all cases, chunk by chunk, so that an interruption leaves whole comparisons.

    In vector environments, controllers in one cell run at once, fewer of them in the last tasks, of which each worker
    gets some. The number of workers never divides a controller's own episodes: a network's last bits may depend on how
    many observations it gets.

    Args:
        cases: the cases to run; no two share both the cell's name and the controller.
        episodes: number per case.
        vectorized: whether chunks run in vector environments.
        done: cell's name, controller and number of the episodes to leave out.
        record_episodes: the first so many episodes of each case leave traces.
        record_hz: rate of the traces.
        together: whether cells that differ by disturbances alone run at once, too.
        workers: number of processes that share the tasks.
    """
    groups = _groups(cases, together) if vectorized else [[[case]] for case in cases]
    largest = max((len(own) for group in groups for own in group), default=1)
    size = 1 if not vectorized else max(1, SIDE_BY_SIDE // largest) if largest > 1 else CHUNK
    chunks = chunks_of(episodes, size)
    count = len(chunks) * len(groups)
    rest = count % workers  # those left once each worker has had as many as the others
    for place, (chunk, group) in enumerate(itertools.product(chunks, groups)):
        left = [[run for run in itertools.product(own, chunk) if _key(*run) not in done] for own in group]
        least = workers // math.gcd(workers, rest) if place >= count - rest else 1
        for some in _portions([runs for runs in left if runs], least):
            yield _task(some, vectorized, record_episodes, record_hz)


def _key(case: Case, episode: int) -> tuple[str, str, int]:
    return case.cell.name, case.controller, episode


def _groups(cases: Collection[Case], together: bool) -> list[list[list[Case]]]:
    """Put cases together that one vector can run, those of each controller in a list.

    A policy object under several names drives one of them at a time: it may have a memory of its own.
    """
    groups: dict[str, dict[str, list[Case]]] = {}
    turns: dict[int, dict[str, int]] = {}
    for case in cases:
        cell, turn = case.cell, 0
        if not isinstance(case.policy, ControllerSpec):
            names = turns.setdefault(id(case.policy), {})
            turn = names.setdefault(case.controller, len(names))
        key = (case.seed, cell.env_id, shared_kwargs(cell), cell.phases, None if together else cell.name, turn)
        groups.setdefault(repr(key), {}).setdefault(repr((case.controller, case.gains)), []).append(case)
    return [list(group.values()) for group in groups.values()]


def _portions(controllers: Sequence[Sequence[Run]], least: int) -> Iterator[list[Run]]:
    """Divide the runs of some controllers between these into portions, at least so many if there are as many."""
    count = max(least, -(-sum(map(len, controllers)) // CHUNK))
    for some in chunks_of(len(controllers), -(-len(controllers) // count)) if controllers else ():
        yield [run for i in some for run in controllers[i]]


def task_of(
    case: Case, episodes: Iterable[int], vectorized: bool, *, record_episodes: int = 0, record_hz: float = 100.0
) -> Task:
    """Put some episodes of a case into one task."""
    return _task([(case, episode) for episode in episodes], vectorized, record_episodes, record_hz)


def _task(runs: Sequence[Run], vectorized: bool, record_episodes: int, record_hz: float) -> Task:
    cases, numbers = zip(*runs, strict=True)
    seeds = [episode_seed(case.seed, episode) for case, episode in runs]
    return Task(vectorized, cases, list(numbers), seeds, record_hz, record_episodes, tuple(METRICS))


def chunks_of(episodes: int, size: int) -> list[range]:
    """Divide episodes into nearly equal ranges of at most `size`."""
    count = -(-episodes // size)
    edges = [episodes * i // count for i in range(count + 1)]
    return [range(first, stop) for first, stop in itertools.pairwise(edges)]


def run_task(task: Task, on_progress: Callable[[float], None]) -> list[Episode]:
    """Run the episodes of a task; `on_progress` is called with the simulated time (s).

    Raises:
        ActionError: for an action that an environment refuses, with the controller and the episode.
    """
    require_metrics(task.metrics)
    recorded = {i for i, episode in enumerate(task.episodes) if episode < task.record_episodes}
    options: dict[str, Any] = {"record_hz": task.record_hz, "phases": task.cell.phases, "on_progress": on_progress}
    if task.vectorized:
        env, reset_options = vector_of(task.cells)
        policies = _policies(task, env)
        return run_vector(env, policies, task.seeds, options=reset_options, recorded=recorded, **options)
    env, reset_options = single_of(task.cell)
    policy = policy_for(task.cases[0].policy, env, task.cases[0].gains)
    results = [
        run_episode(env, policy, seed, options=reset_options, label=task.label(i), **options)
        for i, seed in enumerate(task.seeds)
    ]
    return [result if i in recorded else Episode(result.row, {}) for i, result in enumerate(results)]


def _policies(task: Task, env: Any) -> SideBySide:
    """Build each controller's policy once; those of one registered name that differ in gains may be computed at once.

    Controllers that differ by name alone have a policy each: a network's last bits may depend on how many observations
    it gets.
    """
    made: dict[str, Policy] = {}
    policies, kinds = list[Policy](), list[str]()
    for case in task.cases:
        kind = case.policy.name if isinstance(case.policy, ControllerSpec) else str(id(case.policy))
        key = repr((case.controller, case.gains))
        if key not in made:
            made[key] = policy_for(case.policy, env, case.gains)
        policies.append(made[key])
        kinds.append(kind)
    labels = [task.label(i) for i in range(len(policies))]
    return SideBySide(policies, kinds, env.action_layout.size, labels)


def labels_of(task: Task, number: int) -> dict[str, Any]:
    """Return the columns that identify a row's episode: the task's episode at index `number`."""
    case = task.cases[number]
    return {
        "controller": case.controller,
        "env": case.cell.env_id,
        "scenario": case.cell.name,
        "seed": task.seeds[number],
        "episode": task.episodes[number],
    }
