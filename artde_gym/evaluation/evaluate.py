"""Evaluation of controllers: the same seeded episodes for each, on several processes."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.deprecation import takes_old_names
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.seeds import with_exact_seeds
from artde_gym.evaluation.store import Store
from artde_gym.evaluation.tasks import Progress, Update, labels_of, run_task
from artde_gym.evaluation.workers import run_jobs


@takes_old_names
@writes_folder
def evaluate(
    controllers: Sequence[str | Policy] | Mapping[str, str | Policy],
    env_id: str | None = None,
    *,
    scenario: str | Sequence[str] | None = None,
    episodes: int = 20,
    seed: int = 0,
    workers: int = 1,
    out: str | Path | None = None,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    gains: Mapping[str, Mapping[str, Any]] | None = None,
    vectorized: bool = False,
    record_episodes: int | None = None,
    record_hz: float = 100.0,
    allow_mixed: bool = False,
    on_progress: Callable[[Update], None] | None = None,
) -> Result:
    """Run every controller through the same seeded episodes.

    Args:
        controllers: registered names, or policies with Stable-Baselines3's `predict` (labeled by their `name`, else
            their class); a mapping provides the labels as keys.
        env_id: any registered environment of this project; scenarios bring their own, which it must match.
        scenario: one or several names of `artde_gym.scenarios`; None for the environment itself.
        episodes: number per controller and scenario.
        seed: base seed; episode i has the same seed for every controller and scenario.
        workers: number of processes; the results do not depend on it.
        out: results folder; repeat the call to resume. Nothing is stored without it.
        disturbances: override those of the scenario or the environment.
        env_kwargs: environment arguments, added to the scenario's.
        gains: controller name -> gains that override its preset's.
        vectorized: whether to run many episodes at once in a vector environment, if the environment has one: those of
            all controllers in a scenario, up to about `CHUNK`, each as if it were alone. Both ways draw the same
            disturbances from a seed.
        record_episodes: number of episodes per controller and scenario whose signals are stored in the folder; None
            for all, or for none if `vectorized`.
        record_hz: rate of stored signals; infinite for every sample.
        allow_mixed: resume a folder whose episodes were run by other software (versions, source code, weights of
            controllers, user code); its provenance then records that.
        on_progress: called about once per simulated second of each running episode or chunk, and at its end.

    Returns:
        The result; after an interruption (Ctrl-C), `complete` is False and all finished episodes are in it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for an invalid argument, before the first episode.
        StoreError: if `out` holds other results or results of other software, or another process is writing to it.
    """
    plan = Plan.of(
        controllers,
        env_id,
        scenario=scenario,
        episodes=episodes,
        seed=seed,
        workers=workers,
        disturbances=disturbances,
        env_kwargs=env_kwargs,
        gains=gains,
        vectorized=vectorized,
        record_episodes=record_episodes,
        record_hz=record_hz,
        allow_mixed=allow_mixed,
    )
    return run_plan(plan, out, on_progress)


@writes_folder
def run_plan(plan: Plan, out: str | Path | None = None, on_progress: Callable[[Update], None] | None = None) -> Result:
    """Run the episodes of a plan that are not in the folder yet; see `evaluate` for arguments, result and errors."""
    evidence = plan.try_out()
    store = None
    if out is not None:
        store = Store(Path(out), plan.configuration(), plan.provenance(evidence), allow_mixed=plan.allow_mixed)
    rows = [] if store is None else store.rows
    done = {(row["scenario"], row["controller"], row["episode"]) for row in rows}
    progress = Progress(len(done), plan.total, on_progress)
    complete = True
    runs = run_jobs(run_task, plan.tasks(done), plan.workers, progress.running)
    try:
        for task, results in runs:
            progress.ended(task, results)
            labeled = [({**labels_of(task, i), **result.row}, result.traces) for i, result in enumerate(results)]
            if store is None:
                rows += [row for row, _ in labeled]
            else:
                store.add(labeled)
    except KeyboardInterrupt:
        complete = False
    finally:
        runs.close()
    rows = _in_order(rows, plan)
    result = Result(with_exact_seeds(pd.DataFrame(rows)), None if store is None else store.folder, complete)
    if store is not None and rows:
        store.finish(rows, result.summary())
    return result


def _in_order(rows: list[dict[str, Any]], plan: Plan) -> list[dict[str, Any]]:
    """Sort rows by episode, cell and controller, whatever order they were run in."""
    pairs = itertools.product([cell.name for cell in plan.cells], plan.controllers)
    places = {pair: i for i, pair in enumerate(pairs)}
    return sorted(rows, key=lambda row: (row["episode"], places[row["scenario"], row["controller"]]))
