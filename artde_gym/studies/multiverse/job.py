"""Jobs of a multiverse: worlds that share an environment run side by side, others one by one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from artde_gym.errors import ActionError, ArtdeGymError, OptionError
from artde_gym.evaluation.cells import shared_kwargs, validate_cell, vector_of
from artde_gym.evaluation.environments import metrics_spec_of
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.registered import METRICS
from artde_gym.evaluation.rollout import Episode, Policy
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.tasks import Case, Task, run_task
from artde_gym.studies.multiverse.design import MATCHED
from artde_gym.studies.sweep.design import SweepCell

MOST = 200
"""Episodes at most that run side by side: more would be hardly faster, and a job is what a kill may cost."""

Numbered = tuple[int, SweepCell]
"""A world's number, and what runs in it."""


class Job(NamedTuple):
    """Episodes that run at once."""

    task: Task
    points: tuple[SweepCell, ...]


def jobs_of(points: Iterable[Numbered], vectorized: bool) -> Iterator[Job]:
    """Put what is left to run into jobs: in batches all controllers and worlds that share an environment."""
    groups: dict[str, list[Numbered]] = {}
    for number, point in points:
        alone = [number, point.controller]
        place = [point.cell.env_id, shared_kwargs(point.cell)] if vectorized else alone
        groups.setdefault(json.dumps(place), []).append((number, point))
    for group in groups.values():
        for first in range(0, len(group), MOST):
            yield _job(group[first : first + MOST], vectorized)


def check_points(points: Sequence[Numbered], vectorized: bool, on_checked: Callable[[Job, int], None]) -> None:
    """Build everything once, so that a bad world shows before the first episode.

    Raises:
        OptionError, DisturbanceError, GainError: for what an environment or a controller refuses, with the world.
    """
    env: Any = None
    last, count = "", 0
    for job in jobs_of(points, vectorized):
        place = json.dumps([cell.kwargs for cell in job.task.cells])
        try:
            if place != last:
                last = place
                if vectorized:
                    env, options = vector_of(job.task.cells)
                    env.reset(seed=0, options=options)
                else:
                    env = validate_cell(vectorized, job.task.cell)
            for point in job.points:
                policy_for(point.spec, env, point.gains)
        except ArtdeGymError:
            for number, point in zip(job.task.episodes, job.points, strict=True):
                check_world(f"world {number}", [point], vectorized)
            raise
        count += len(job.points)
        on_checked(job, count)


def check_world(place: str, points: Sequence[SweepCell], vectorized: bool) -> tuple[Any, list[Policy]]:
    """Build one world's environment and its controllers; raises the errors of `check_points`, with the place."""
    try:
        env = validate_cell(vectorized, points[0].cell)
        return env, [policy_for(point.spec, env, point.gains) for point in points]
    except ArtdeGymError as error:
        raise error.within(place) from error


def check_adaptive(point: SweepCell, vectorized: bool) -> None:
    """Check that a controller has an adaptive gain, whose mean a second pass may take.

    Raises:
        OptionError: if it has none.
    """
    env, (policy,) = check_world(MATCHED, [point], vectorized)
    observation, _ = env.reset(seed=0)
    _, state = policy.predict(observation)
    diagnose = getattr(policy, "diagnostics", None)
    known = {} if diagnose is None else diagnose(state)
    if not any(name in known for name in metrics_spec_of(point.cell.env_id).diagnostic_means.values()):
        raise OptionError("matched", point.controller, "choose an adaptive law", "has no adaptive gain")


def run(job: Job, on_time: Callable[[float], None]) -> list[Episode]:
    """Run a job; what goes wrong is told with the worlds."""
    try:
        return run_task(job.task, on_time)
    except ActionError:  # it names controller and world
        raise
    except ArtdeGymError as error:
        worlds = f"{job.task.controller} in world {', '.join(map(str, dict.fromkeys(job.task.episodes)))}"
        raise error.within(worlds) from error


def _job(group: Sequence[Numbered], vectorized: bool) -> Job:
    numbers, points = zip(*group, strict=True)
    cases = tuple(Case(point.cell, point.controller, point.spec, point.gains, point.seed) for point in points)
    seeds = [episode_seed(point.seed, 0) for point in points]
    return Job(Task(vectorized, cases, list(numbers), seeds, 100.0, 0, tuple(METRICS), "world"), tuple(points))
