"""Jobs of a multiverse: worlds that share an environment run side by side, others one by one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from artde_gym.errors import ArtdeGymError
from artde_gym.evaluation.cells import Cell, validate_cell, vector_of
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.registered import METRICS, require_metrics
from artde_gym.evaluation.rollout import Episode, Policy
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.side_by_side import SideBySide
from artde_gym.evaluation.tasks import Task, run_task
from artde_gym.evaluation.vector_rollout import run_vector
from artde_gym.registration import ControllerSpec
from artde_gym.studies.sweep.design import SweepCell

MOST = 200
"""Episodes at most that run side by side: more would be hardly faster, and a job is what a kill may cost."""

Numbered = tuple[int, SweepCell]
"""A world's number, and what runs in it."""


class Job(NamedTuple):
    """Episodes that run at once; `task` is what they share, `options` those of the reset with what they do not."""

    task: Task
    points: tuple[SweepCell, ...]
    options: dict[str, Any] | None


def jobs_of(points: Iterable[Numbered], vectorized: bool) -> Iterator[Job]:
    """Put what is left to run into jobs: in batches all controllers and worlds that share an environment."""
    groups: dict[str, list[Numbered]] = {}
    for number, point in points:
        alone = [number, point.controller]
        place = [point.cell.env_id, _shared(point).kwargs] if vectorized else alone
        groups.setdefault(json.dumps(place), []).append((number, point))
    for group in groups.values():
        for first in range(0, len(group), MOST):
            yield _job(group[first : first + MOST], vectorized)


def check_points(points: Sequence[Numbered], vectorized: bool, on_checked: Callable[[Job, int], None]) -> None:
    """Build everything once, so that a bad world shows before the first episode.

    Raises:
        OptionError, DisturbanceError, GainError: for what an environment or a controller refuses.
    """
    env: Any = None
    last, count = "", 0
    for job in jobs_of(points, vectorized):
        place = json.dumps([job.task.cell.kwargs, job.options])
        if place != last:
            last = place
            env = _vector(job) if vectorized else validate_cell(vectorized, job.task.cell)
            if vectorized:
                env.reset(seed=0, options=job.options)
        for point in job.points:
            policy_for(point.spec, env, point.gains)
        count += len(job.points)
        on_checked(job, count)


def run(job: Job, on_time: Callable[[float], None]) -> list[Episode]:
    """Run a job; what goes wrong is told with the worlds."""
    try:
        return _run_batch(job, on_time) if job.task.vectorized else run_task(job.task, on_time)
    except ArtdeGymError as error:
        worlds = f"{job.task.controller} in world {', '.join(map(str, job.task.episodes))}"
        raise type(error)(f"{error.field} ({worlds})", error.value, error.allowed) from error


def _run_batch(job: Job, on_time: Callable[[float], None]) -> list[Episode]:
    task = job.task
    require_metrics(task.metrics)
    env = _vector(job)
    made: dict[str, Policy] = {}
    for point in job.points:  # equal policies are computed at once
        if (key := _key(point)) not in made:
            made[key] = policy_for(point.spec, env, point.gains)
    policy = SideBySide([made[_key(point)] for point in job.points], [point.spec.name for point in job.points])
    return run_vector(env, policy, task.seeds, options=job.options, phases=task.cell.phases, on_progress=on_time)


def _key(point: SweepCell) -> str:
    return json.dumps([point.spec.name, point.gains])


def _vector(job: Job) -> Any:
    return vector_of(job.task.cell, len(job.points))


def _job(group: Sequence[Numbered], vectorized: bool) -> Job:
    numbers, points = zip(*group, strict=True)
    first = points[0]
    spec: ControllerSpec = first.spec
    cell = _shared(first) if vectorized else first.cell
    seeds = [episode_seed(point.seed, 0) for point in points]
    names = ", ".join(dict.fromkeys(point.controller for point in points))
    task = Task(
        vectorized, cell, names, spec, first.gains, list(numbers), seeds, 100.0, 0, tuple(METRICS)
    )  # fmt: skip
    own = [point.cell.kwargs["disturbances"] for point in points if "disturbances" in point.cell.kwargs]
    return Job(task, tuple(points), {"disturbances": own} if own else None)


def _shared(point: SweepCell) -> Cell:
    """Return the cell without disturbances, in which worlds of a batch may differ; those of its own it keeps."""
    if "disturbances" not in point.cell.kwargs:
        return point.cell
    return point.cell._replace(kwargs={**point.cell.kwargs, "disturbances": {}})
