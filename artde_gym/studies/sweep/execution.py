"""Sweeps: any number of cells in seeded episodes, on any number of processes or machines, into one Parquet dataset.

An episode equals that of `evaluate` with the same arguments, seed and number, to the last bit, wherever it runs, in any
order, and after any number of interruptions.
"""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, get_args

import pandas as pd

from artde_gym.errors import ArtdeGymError, OptionError, StoreError, suggest_names
from artde_gym.evaluation.cells import engines_of, validate_cell
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.identity import behind
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.rollout import Episode
from artde_gym.evaluation.tasks import Case, Progress, Task, Update, labels_of, run_task, task_of, tasks_of
from artde_gym.evaluation.workers import Runs, check_picklable, check_workers, run_jobs
from artde_gym.extras import require
from artde_gym.studies.sweep import parquet
from artde_gym.studies.sweep.design import Design, SweepCell, design, read
from artde_gym.studies.sweep.ray_workers import check_address, run_on_ray
from artde_gym.studies.sweep.store import Key, SweepStore, read_sweep

Executor = Literal["local", "ray"]
"""Processes of this machine, or a Ray cluster."""

OnProgress = Callable[[str, Update], None]


@dataclasses.dataclass(frozen=True)
class Sweep:
    """The results of a sweep so far.

    Attributes:
        episodes: one row each, as from `read_sweep`.
        folder: the results folder.
        complete: False after an interruption.
        set_aside: corrupt files that this run moved to the folder's `corrupt`.
    """

    episodes: pd.DataFrame
    folder: Path
    complete: bool
    set_aside: tuple[str, ...] = ()


@writes_folder
def sweep(
    given: str | Path | Mapping[str, Any],
    out: str | Path,
    *,
    workers: int = 1,
    executor: Executor = "local",
    address: str | None = None,
    allow_mixed: bool = False,
    on_progress: OnProgress | None = None,
) -> Sweep:
    """Run all episodes of a sweep that are not in its folder yet.

    Args:
        given: a YAML file, or its content as plain values; see `artde_gym.studies.sweep.design`.
        out: results folder, see `artde_gym.studies.sweep.store`. Repeat the call to resume; a sweep with more episodes
            than the folder adds the others.
        workers: number of processes; the results do not depend on it.
        executor: "local", or "ray" for a Ray cluster, whose cores the workers share.
        address: of a running Ray cluster, "auto" for this machine's; None starts one here with `workers` cores.
        allow_mixed: as for `evaluate`.
        on_progress: called with the current phase ("cells checked", "episodes") and its progress.

    Returns:
        The results so far; after an interruption (Ctrl-C), `complete` is False and all finished episodes are in it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for an invalid cell, before the first episode.
        StoreError: if `out` holds anything else, is in use by another process, or is not writable (a full disk).
        WorkerError: if workers keep ending before their episodes are done.
    """
    check_workers(workers)
    _check_executor(executor, address)
    plan = design(read(given) if isinstance(given, (str, Path)) else given)
    if workers > 1 or executor == "ray":
        check_picklable({point.controller: point.spec for point in plan.points}, {})
    types = parquet.types_of(point.columns for point in plan.points)
    points = {f"{point.cell.name} [{i}]": point for i, point in enumerate(plan.points)}
    complete = True
    with SweepStore(Path(out)) as store:
        refuse_others(plan, store)
        _check(plan, points, store.done, on_progress)
        store.begin(plan.text, types, evidence_of(plan), engines_in(plan), allow_mixed=allow_mixed)
        total = len(points) * plan.episodes
        progress = Progress(len(store.done), total, on_progress and functools.partial(on_progress, "episodes"))

        def on_time(task: Task, time: float) -> None:
            store.due()
            progress.running(task, time)

        if len(store.done) < total:
            runs = _runs(_tasks(plan, points, store.done), workers, executor, address, on_time, store.due)
            complete = _keep(runs, store, points, progress)
        if complete:
            store.finish()
    return Sweep(read_sweep(out), Path(out), complete, tuple(path.name for path in store.set_aside))


def _check_executor(executor: Any, address: Any) -> None:
    if executor not in get_args(Executor):
        known = suggest_names(executor, get_args(Executor))
        allowed = f"{known}; a physics engine is an argument of environments (env_kwargs)"
        raise OptionError("executor", executor, allowed)
    if address is not None and executor != "ray":
        raise OptionError("address", address, "pass executor='ray'", "is of no use without Ray")
    if executor == "ray":
        require("scale", "pyarrow", "ray", "yaml")
    else:
        require("sweep", "pyarrow", "yaml")
    if address is not None:
        check_address(address)


def _runs(
    tasks: Iterator[Task],
    workers: int,
    executor: Executor,
    address: str | None,
    on_time: Callable[[Task, float], None],
    on_wait: Callable[[], None],
) -> Runs:
    if executor == "ray":
        return run_on_ray(_run, tasks, workers, address, on_wait)
    return run_jobs(_run, tasks, workers, on_time)


def _keep(runs: Runs, store: SweepStore, points: Mapping[str, SweepCell], progress: Progress) -> bool:
    """Store episodes as they finish; return False if interrupted."""
    try:
        for task, results in runs:
            store.add(_rows(points[task.cell.name], task, results))
            progress.ended(task, results)
    except KeyboardInterrupt:
        return False
    finally:
        runs.close()
    return True


def _run(task: Task, on_time: Callable[[float], None]) -> list[Episode]:
    """Run a task; an error names the cell."""
    try:
        return run_task(task, on_time)
    except ArtdeGymError as error:
        gains, env_id, kwargs = task.cases[0].gains, task.cell.env_id, task.cell.kwargs
        cell = f"{task.controller} with {gains}, {env_id} with {kwargs}, seeds {task.seeds}"
        raise error.within(cell) from error


def refuse_others(plan: Design, store: SweepStore) -> None:
    """Reject a folder with episodes that are not of this sweep, so that its readers need not separate them."""
    cells = {point.id for point in plan.points}
    others = sum(cell not in cells or episode >= plan.episodes for cell, episode in store.done)
    if others:
        problem = f"has {len(store.done)} episodes, and {others} of {len(store.done)} belong to another sweep"
        todo = "choose a new folder, or a sweep with all of them"
        raise StoreError("sweep folder", str(store.folder), todo, problem)


def _check(plan: Design, points: Mapping[str, SweepCell], done: set[Key], on_progress: OnProgress | None) -> None:
    """Build everything once, so that an invalid cell is reported before the first episode; skip cells with episodes."""
    begun = {cell for cell, _ in done}
    fresh = [(name, point) for name, point in points.items() if point.id not in begun]
    fresh.sort(key=lambda item: _place(item[1]))  # neighbors share an environment
    last, env = None, None
    for i, (name, point) in enumerate(fresh, start=1):
        if _place(point) != last:
            last, env = _place(point), validate_cell(plan.vectorized, point.cell)
        policy_for(point.spec, env, point.gains)
        if on_progress is not None:
            task = task_of(_case(name, point), [0], plan.vectorized)
            on_progress("cells checked", Update(task, 0.0, True, i, len(fresh)))


def evidence_of(plan: Design) -> dict[str, str]:
    """Return hashes of the controllers' weights and code, each built once per environment."""
    found: dict[str, str] = {}
    for point in {(point.controller, point.cell.env_id): point for point in reversed(plan.points)}.values():
        policy = policy_for(point.spec, validate_cell(plan.vectorized, point.cell), point.gains)
        found |= behind(point.controller, point.cell.env_id, point.spec, policy)
    return found


def engines_in(plan: Design) -> dict[str, str]:
    """Return the engines of a sweep, and whether each one was asked for."""
    return engines_of(point.cell for point in plan.points)


def _place(point: SweepCell) -> tuple[str, str, str]:
    """Return environment, arguments and disturbances as sort keys."""
    kwargs = dict(point.cell.kwargs)
    disturbances = kwargs.pop("disturbances", None)
    return point.cell.env_id, json.dumps(kwargs), json.dumps(disturbances)


def _tasks(plan: Design, points: Mapping[str, SweepCell], done: set[Key]) -> Iterator[Task]:
    """Return the remaining tasks."""
    names = {point.id: (name, point.controller) for name, point in points.items()}
    finished = {(*names[cell], episode) for cell, episode in done}
    return tasks_of([_case(name, point) for name, point in points.items()], plan.episodes, plan.vectorized, finished)


def _case(name: str, point: SweepCell) -> Case:
    return Case(point.cell._replace(name=name), point.controller, point.spec, point.gains, point.seed)


def _rows(point: SweepCell, task: Task, results: list[Episode]) -> Iterator[dict[str, Any]]:
    for i, result in enumerate(results):
        labels = {**labels_of(task, i), "cell": point.id, "scenario": point.cell.name}
        yield {**labels, **point.columns, **result.row}
