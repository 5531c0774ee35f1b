"""Tuning: the same number of trials for every controller on training seeds, judged on held-out seeds.

A trial is one set of gains, run in the same seeded episodes for all controllers. Its cost is the episodes' mean of the
environment's main tracking error (`rmse_m`, `rmse_deg`), or of another column of the table of episodes, where a fall
after t seconds counts `FALL` (1 + 1 / (1 + t)), more than any error. Trial 0 is the controller's own preset; the others
are proposed by Optuna's tree-structured Parzen estimator (Bergstra et al. 2011) within the controller's registered
ranges. The gains with the smallest cost are then compared with the preset on held-out seeds, which removes any gain
from overfitting the training seeds.

A proposal depends only on the seed, the controller and its finished trials: results are the same for any number of
processes, and for a resumed run.

    tuning.json      configuration, provenance and the best gains
    trials.csv       one row per controller and trial
    held-out/        the results folder of the comparison; "<name>-tuned" are the tuned controllers
"""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from artde_gym.arguments import check_integer
from artde_gym.deprecation import takes_old_names
from artde_gym.errors import OptionError
from artde_gym.evaluation import canonical
from artde_gym.evaluation.cells import Cell, engines_of, shared_kwargs
from artde_gym.evaluation.columns import check_metric
from artde_gym.evaluation.environments import metrics_spec_of, single, single_arguments, with_engine
from artde_gym.evaluation.evaluate import run_plan
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.identity import behind
from artde_gym.evaluation.labels import labeled
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.plan import MOST_EPISODES, Plan
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.tasks import Update
from artde_gym.registration import registered_controllers, tuning_space
from artde_gym.studies.tune.proposer import Gains, Proposer
from artde_gym.studies.tune.store import TRIAL_COLUMNS, TuningStore, frame_of

TUNED = "-tuned"
"""Suffix of a controller's name for its tuned gains."""
MOST_TRIALS = 10_000
FALL = 1000.0
"""Cost of a fall, in the unit of the error."""


@dataclasses.dataclass(frozen=True)
class Tuning:
    """The result of tuning.

    Attributes:
        trials: one row per controller and trial: `cost`, mean `error` of the episodes without a fall (NaN without one),
            number of `falls`, and `gains` as JSON.
        metric: column of the error.
        best: controller -> gains of its cheapest trial (the earliest of equal ones).
        held_out: the comparison; None if the trials were interrupted.
        folder: the results folder, if they are stored.
        complete: False after an interruption.
    """

    trials: pd.DataFrame
    metric: str
    best: dict[str, Gains]
    held_out: Result | None
    folder: Path | None = None
    complete: bool = True


@takes_old_names
@writes_folder
def tune(
    controllers: Sequence[str],
    env_id: str | None = None,
    *,
    scenario: str | None = None,
    trials: int = 50,
    episodes: int = 4,
    held_out: int = 20,
    seed: int = 0,
    metric: str | None = None,
    workers: int = 1,
    out: str | Path | None = None,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    vectorized: bool = False,
    allow_mixed: bool = False,
    on_progress: Callable[[str, Update], None] | None = None,
) -> Tuning:
    """Tune every controller with the same number of trials, and compare each with its preset on held-out seeds.

    Args:
        controllers: registered names.
        env_id: as for `evaluate`, also for `disturbances`, `env_kwargs`, `vectorized`, `workers` and `allow_mixed`.
        scenario: one of `artde_gym.scenarios`; None for the environment itself.
        trials: number per controller, the preset included.
        episodes: number per trial.
        held_out: number of episodes of the comparison.
        metric: numeric column of `episodes.csv` to minimize; None for the environment's first error.
        seed: base seed of the proposals and training episodes; the comparison's episodes have those of seed + 1.
        out: results folder; repeat the call to resume.
        on_progress: called with the running part ("trial 3 of 50", "held-out") and the progress of its episodes.

    Raises:
        UnknownNameError, OptionError, DisturbanceError: for an invalid argument, before the first trial.
        StoreError: if `out` holds other results or results of other software, or another process is writing to it.
    """
    check_integer("trials", trials, 1, MOST_TRIALS)
    check_integer("held_out", held_out, 1, MOST_EPISODES)
    names = _names(controllers)
    plan = Plan.of(
        names,
        env_id,
        scenario=_one_scenario(scenario),
        episodes=episodes,
        seed=seed,
        workers=workers,
        disturbances=disturbances,
        env_kwargs=env_kwargs,
        vectorized=vectorized,
        allow_mixed=allow_mixed,
    )
    env_id = plan.cells[0].env_id
    if metric is not None:
        check_metric(metric, plan.cells[0], next(iter(plan.controllers.values())), plan.seed)
    search = _Search(plan, metric, on_progress)
    configuration = {
        "env": env_id,
        "scenario": scenario,
        "disturbances": disturbances,
        "env_kwargs": with_engine(env_id, env_kwargs or {}, vectorized),
        "vectorized": vectorized,
        "controllers": {name: {gain: list(at) for gain, at in space.items()} for name, space in search.spaces.items()},
        "trials": trials,
        "episodes": episodes,
        "held_out": held_out,
        "seed": seed,
        **({} if metric is None else {"metric": metric}),
    }
    store = None
    if out is not None:
        behind_them = _behind(names, plan.cells[0])
        store = TuningStore(Path(out), configuration, behind_them, engines_of(plan.cells), allow_mixed)
    return search.run(trials, held_out, store)


def _tuned_env(cell: Cell) -> Any:
    """Return an environment with a cell's arguments, on which presets depend where gains are designed."""
    return single(cell.env_id, json.dumps(single_arguments(cell.env_id, shared_kwargs(cell))))


def _names(controllers: Any) -> list[str]:
    """Return the controllers' names after checking that none looks like another's tuned name."""
    names = labeled(controllers)
    for name, item in names.items():
        if name != item:
            raise OptionError("controllers", item, "registered names")
    if canonical.twice([*names, *(name + TUNED for name in names)]):
        raise OptionError("controllers", list(names), f"names that differ by more than {TUNED!r}")
    return list(names)


def _one_scenario(scenario: Any) -> str | None:
    if not (scenario is None or isinstance(scenario, str)):
        raise OptionError("scenario", scenario, "one name, or None")
    return scenario


class _Search:
    """The trials of all controllers, and the final comparison."""

    def __init__(self, plan: Plan, metric: str | None, on_progress: Callable[[str, Update], None] | None) -> None:
        env_id = plan.cells[0].env_id
        self._plan, self._on_progress = plan, on_progress
        self._proposer = Proposer(plan.seed)
        self.metric = f"rmse_{metrics_spec_of(env_id).errors[0].unit}" if metric is None else metric
        env = _tuned_env(plan.cells[0])
        self.spaces = {name: tuning_space(name, env) for name in plan.controllers}

    def run(self, trials: int, held_out: int, store: TuningStore | None) -> Tuning:
        """Run what a store does not contain yet; None to store nothing."""
        rows, folder = ([], None) if store is None else (store.rows, store.path)
        for number in range(trials):
            if not self._try(number, trials, rows, store):
                return Tuning(frame_of(rows), self.metric, _best(rows), None, folder, complete=False)
        best = _best(rows)
        result = self._compare(best, held_out, folder)
        if store is not None:
            store.finish(best, result.complete)
        return Tuning(frame_of(rows), self.metric, best, result, folder, result.complete)

    def _try(self, number: int, trials: int, rows: list[dict[str, Any]], store: TuningStore | None) -> bool:
        """Run one trial of each controller without it; return False if interrupted."""
        done = {row["controller"] for row in rows if row["trial"] == number}
        left = {name: item for name, item in self._plan.controllers.items() if name not in done}
        gains = {name: self._proposer.propose(name, self.spaces[name], _history(rows, name), number) for name in left}
        if not left:
            return True
        plan = dataclasses.replace(self._plan, controllers=left, gains=gains)
        result = run_plan(plan, on_progress=self._news(f"trial {number + 1} of {trials}"))
        if result.complete:
            rows += [_row(result, name, number, self.metric, gains[name]) for name in left]
            if store is not None:
                store.write(rows)
        return result.complete

    def _compare(self, best: Mapping[str, Gains], episodes: int, folder: Path | None) -> Result:
        """Compare tuned gains with presets on held-out seeds."""
        known = self._plan.controllers
        plan = dataclasses.replace(
            self._plan,
            controllers={label: known[name] for name in known for label in (name, name + TUNED)},
            gains={name + TUNED: best[name] for name in known},
            episodes=episodes,
            seed=self._plan.seed + 1,
        )
        return run_plan(plan, None if folder is None else folder / "held-out", self._news("held-out"))

    def _news(self, what: str) -> Callable[[Update], None] | None:
        return self._on_progress and functools.partial(self._on_progress, what)


def _behind(controllers: Sequence[str], cell: Cell) -> dict[str, str]:
    """Return hashes of the controllers' weights and code, at their own gains."""
    known, env = registered_controllers(), _tuned_env(cell)
    found: dict[str, str] = {}
    for name in controllers:
        found |= behind(name, cell.env_id, known[name], policy_for(known[name], env, {}))
    return found


def _history(rows: list[dict[str, Any]], name: str) -> list[tuple[Gains, float]]:
    return [(json.loads(row["gains"]), row["cost"]) for row in rows if row["controller"] == name]


def _best(rows: list[dict[str, Any]]) -> dict[str, Gains]:
    cheapest: dict[str, dict[str, Any]] = {}
    for row in rows:
        name = row["controller"]
        if name not in cheapest or row["cost"] < cheapest[name]["cost"]:
            cheapest[name] = row
    return {name: json.loads(row["gains"]) for name, row in cheapest.items()}


def _row(result: Result, name: str, number: int, metric: str, gains: Gains) -> dict[str, Any]:
    (scenario,) = result.scenarios
    fell = result.values(scenario, name, "fell") > 0
    error = result.values(scenario, name, metric)
    cost = np.where(fell, FALL * (1 + 1 / (1 + result.values(scenario, name, "duration_s"))), error)
    mean = float(error[~fell].mean()) if not fell.all() else float("nan")
    values = (name, number, float(cost.mean()), mean, int(fell.sum()), json.dumps(gains))
    return dict(zip(TRIAL_COLUMNS, values, strict=True))
