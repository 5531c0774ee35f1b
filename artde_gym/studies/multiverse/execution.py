"""A multiverse: all controllers in the same plausible worlds, and claims judged over them.

An episode is that of `evaluate` with the world's arguments, disturbances and seed, to the last bit; which worlds run
beside it, on how many processes and after how many interruptions makes no difference. The folder is a sweep's
(`artde_gym.studies.sweep.store`), with the columns `world` and `factor.<name>` beside its own.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.evaluation.columns import check_metric
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.rollout import Episode
from artde_gym.evaluation.tasks import Progress, Update, labels_of
from artde_gym.evaluation.workers import check_picklable, check_workers, run_jobs
from artde_gym.extras import require
from artde_gym.studies.multiverse.design import MATCHED, Design, load
from artde_gym.studies.multiverse.job import Job, Numbered, check_adaptive, check_points, check_world, jobs_of, run
from artde_gym.studies.multiverse.result import Multiverse, read_multiverse
from artde_gym.studies.reproduce.reproduction import mean_gains
from artde_gym.studies.sweep import parquet
from artde_gym.studies.sweep.design import Design as SweepDesign
from artde_gym.studies.sweep.design import SweepCell
from artde_gym.studies.sweep.execution import engines_in, evidence_of, refuse_others
from artde_gym.studies.sweep.store import SweepStore, read_sweep

OnProgress = Callable[[str, Update], None]
_FIRST, _SECOND = "episodes", "episodes at matched stiffness"


@writes_folder
def multiverse(
    design: str | Path | Mapping[str, Any],
    out: str | Path,
    *,
    worlds: int | None = None,
    seed: int | None = None,
    vectorized: bool | None = None,
    engine: str | None = None,
    workers: int = 1,
    allow_mixed: bool = False,
    on_progress: OnProgress | None = None,
) -> Multiverse:
    """Run controllers in plausible worlds and judge claims over them.

    Args:
        design: a robot with a standard design, a YAML file, or its content; see `artde_gym.studies.multiverse.design`.
        out: folder of the results. The same call continues after whatever happened; more worlds are added.
        worlds, seed, vectorized: in place of the design's. Fewer worlds of the same seed are the first of them.
        engine: physics engine of the environments, in place of the design's.
        workers: processes; the results do not depend on it.
        allow_mixed: as for `evaluate`.
        on_progress: called with what goes on ("worlds checked", "episodes", ...) and how far it is.

    Returns:
        The multiverse; `complete` is False after an interruption (Ctrl-C), with all finished episodes in it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for a bad design, before the first episode.
        StoreError: if `out` holds anything else, is used by another process, or cannot be written.
        WorkerError: if workers keep ending before their episodes do.
    """
    check_workers(workers)
    require("multiverse", "pyarrow", "yaml")
    plan = load(design, engine=engine, worlds=worlds, seed=seed, vectorized=vectorized)
    first = plan.points()
    if workers > 1:
        check_picklable({point.controller: point.spec for point in first.values()}, {})
    for metric in {claim.metric for claim in plan.claims if claim.metric is not None}:
        one = next(iter(first.values()))
        check_metric(metric, one.cell, one.spec, one.seed)
    complete = True
    with SweepStore(Path(out)) as store:
        known = {**first, **_second_pass(plan, _stored(store))}
        as_sweep = SweepDesign(tuple(known.values()), 1, plan.vectorized, plan.text)
        refuse_others(as_sweep, store)
        _check(plan, first, store, on_progress)
        types = parquet.types_of(_columns(plan, number, point) for (number, _), point in known.items())
        store.begin(plan.text, types, evidence_of(as_sweep), engines_in(as_sweep), allow_mixed=allow_mixed)
        for what, points in ((_FIRST, lambda: first), (_SECOND, lambda: _second_pass(plan, _stored(store)))):
            complete = complete and _run(plan, points(), store, workers, on_progress and _named(on_progress, what))
            store.flush()
        if complete:
            store.finish()
    return read_multiverse(out)


def _named(on_progress: OnProgress, what: str) -> Callable[[Update], None]:
    return functools.partial(on_progress, what)


def _stored(store: SweepStore) -> pd.DataFrame:
    return read_sweep(store.folder) if store.done else pd.DataFrame({"controller": []})


def _second_pass(plan: Design, episodes: pd.DataFrame) -> dict[tuple[int, str], SweepCell]:
    """Return what the second pass runs, as far as the first one has come."""
    rows: pd.DataFrame = episodes.loc[episodes["controller"] == plan.matched]
    found = {}
    for i in range(len(rows)):
        row = rows.iloc[i : i + 1]
        number = int(row["world"].to_numpy()[0])
        if number < len(plan.worlds) and (gains := mean_gains(row)):
            found[number, MATCHED] = plan.matched_point(number, gains)
    return found


def _check(
    plan: Design, points: Mapping[tuple[int, str], SweepCell], store: SweepStore, on_progress: OnProgress | None
) -> None:
    if not store.done:  # a folder goes on whatever was allowed when it was begun
        if plan.matched is not None:
            check_adaptive(points[0, plan.matched], plan.vectorized)
        for place, ends in plan.end_points():
            check_world(place, ends, plan.vectorized)
    fresh = [(number, point) for (number, _), point in points.items() if (point.id, 0) not in store.done]

    def checked(job: Job, count: int) -> None:
        if on_progress is not None:
            on_progress("worlds checked", Update(job.task, 0.0, True, count, len(fresh)))

    check_points(fresh, plan.vectorized, checked)


def _run(
    plan: Design,
    points: Mapping[tuple[int, str], SweepCell],
    store: SweepStore,
    workers: int,
    on_progress: Callable[[Update], None] | None,
) -> bool:
    """Run what is left of a pass; return False if interrupted."""
    left: list[Numbered] = [(n, point) for (n, _), point in points.items() if (point.id, 0) not in store.done]
    progress = Progress(len(points) - len(left), len(points), on_progress)

    def on_time(job: Job, time: float) -> None:
        store.due()
        progress.running(job.task, time)

    runs = run_jobs(run, jobs_of(left, plan.vectorized), min(workers, max(len(left), 1)), on_time)
    try:
        for job, results in runs:
            store.add(_rows(plan, job, results))
            progress.ended(job.task, results)
    except KeyboardInterrupt:
        return False
    finally:
        runs.close()
    return True


def _rows(plan: Design, job: Job, results: list[Episode]) -> Iterator[dict[str, Any]]:
    for i, (point, result) in enumerate(zip(job.points, results, strict=True)):
        labels = {**labels_of(job.task, i), "cell": point.id, "episode": 0}
        yield {**labels, **_columns(plan, job.task.episodes[i], point), **result.row}


def _columns(plan: Design, number: int, point: SweepCell) -> dict[str, Any]:
    """Return the columns that say which world it is."""
    own = plan.worlds[number].factors
    factors = {f"factor.{factor.name}": factor.stored(own[factor.name]) for factor in plan.factors}
    return {**point.columns, "world": number, **factors}
