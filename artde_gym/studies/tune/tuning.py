"""Tuning: the same budget of trials for every controller, on training seeds; judged on seeds that nobody has seen.

A trial is one set of gains, flown or walked in the same seeded episodes by all controllers. Its cost is the mean over
the episodes of the tracking error that the environment reports first (`rmse_m`, `rmse_deg`), where a fall after t
seconds counts `FALL` (1 + 1 / (1 + t)), more than any error. Trial 0 is the controller's own preset; the others are
proposed by Optuna's tree-structured Parzen estimator (Bergstra et al. 2011) within the ranges that the controller was
registered with. The gains of the smallest cost are then compared with the preset on held-out seeds: what was gained on
the training seeds alone is gone there.

A proposal depends on the seed, the controller and its finished trials, and on nothing else: results are the same on any
number of processes, and for a run that was interrupted and continued.

    tuning.json      configuration, provenance and the best gains
    trials.csv       one row a controller and trial
    held-out/        the results folder of the comparison; "<name>-tuned" are the tuned ones
"""

from __future__ import annotations

import csv
import dataclasses
import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from artde_gym.arguments import reading, whole
from artde_gym.errors import OptionError, StoreError
from artde_gym.evaluation.environments import Backend, single, tracking_of, with_engine
from artde_gym.evaluation.evaluate import DEFAULT_ENVIRONMENT, MOST_EPISODES, Update, evaluate, policy_for
from artde_gym.evaluation.identity import behind
from artde_gym.evaluation.lock import is_empty, writes_folder
from artde_gym.evaluation.provenance import MIXED, continued, provenance
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.store import claim, plain_configuration, write_atomically
from artde_gym.evaluation.workers import check_workers
from artde_gym.registration import GainRange, registered_controllers, search_space
from artde_gym.scenarios import scenario as find_scenario

RECORD = "tuning.json"
TUNED = "-tuned"
"""What is added to a controller's name where its tuned gains are meant."""
MOST_TRIALS = 10_000
FALL = 1000.0
"""Cost of a fall, in the unit of the error."""
TRIAL_COLUMNS = ["controller", "trial", "cost", "error", "falls", "gains"]

Gains = dict[str, float]


@dataclasses.dataclass(frozen=True)
class Tuning:
    """What tuning found.

    Attributes:
        trials: one row a controller and trial: `cost`, mean `error` of the episodes without a fall (NaN without one),
            number of `falls`, and `gains` as JSON.
        metric: column of the error.
        best: controller -> gains of its cheapest trial (the earliest of equal ones).
        held_out: the comparison; None if the trials were interrupted.
        folder: where everything is stored, if it is.
        complete: False after an interruption.
    """

    trials: pd.DataFrame
    metric: str
    best: dict[str, Gains]
    held_out: Result | None
    folder: Path | None = None
    complete: bool = True


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
    workers: int = 1,
    out: str | Path | None = None,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    backend: Backend = "single",
    allow_mixed: bool = False,
    on_progress: Callable[[str, Update], None] | None = None,
) -> Tuning:
    """Tune every controller with the same budget, and compare each with its own preset on held-out seeds.

    Args:
        controllers: registered names.
        env_id: as for `evaluate`, also for `disturbances`, `env_kwargs`, `backend`, `workers` and `allow_mixed`.
        scenario: one of `artde_gym.scenarios`; None for the environment as it is.
        trials: of each controller, the preset included.
        episodes: of each trial.
        held_out: episodes of the comparison.
        seed: of the proposals and of the training episodes; the comparison's episodes are those of seed + 1.
        out: folder to store everything in; the same call continues an interrupted one.
        on_progress: called with what runs ("trial 3 of 50", "held-out") and the progress of its episodes.

    Raises:
        UnknownNameError, OptionError, DisturbanceError: for a bad argument, before the first trial.
        StoreError: if `out` holds other results, or results of other software, or is written by another process.
    """
    check_workers(workers)
    for name, count in (("trials", trials), ("episodes", episodes), ("held_out", held_out)):
        whole(name, count, 1, MOST_TRIALS if name == "trials" else MOST_EPISODES)
    whole("seed", seed, 0)
    if isinstance(controllers, str) or not controllers:
        raise OptionError("controllers", controllers, "a list of names")
    if len(set(controllers)) < len(controllers):
        raise OptionError("controllers", controllers, "each name once")
    compared = {label: name for name in controllers for label in (name, name + TUNED)}
    if len(compared) < 2 * len(controllers):
        raise OptionError("controllers", controllers, f"names that differ by more than {TUNED!r}")
    proposer = _Proposer(seed)
    env_id = env_id or (DEFAULT_ENVIRONMENT if scenario is None else find_scenario(scenario).env_id)
    error = tracking_of(env_id).errors[0]
    metric = f"rmse_{error.unit}"
    spaces = {name: search_space(name, single(env_id, json.dumps({}))) for name in controllers}
    common: dict[str, Any] = {
        "scenario": scenario,
        "disturbances": disturbances,
        "env_kwargs": with_engine(env_id, env_kwargs or {}, backend),
        "backend": backend,
    }
    configuration = {
        "env": env_id,
        **common,
        "controllers": {name: {gain: list(where) for gain, where in space.items()} for name, space in spaces.items()},
        "trials": trials,
        "episodes": episodes,
        "held_out": held_out,
        "seed": seed,
    }
    folder = None if out is None else _Folder(Path(out), configuration, _behind(controllers, env_id), allow_mixed)
    rows = [] if folder is None else folder.rows

    def run(what: str, labels: Mapping[str, str], gains: Mapping[str, Gains], **options: Any) -> Result:
        def report(update: Update) -> None:
            if on_progress is not None:
                on_progress(what, update)

        return evaluate(labels, env_id, gains=gains, workers=workers, on_progress=report, **common, **options)

    for number in range(trials):
        done = {row["controller"] for row in rows if row["trial"] == number}
        left = [name for name in controllers if name not in done]
        gains = {name: proposer.propose(name, spaces[name], _history(rows, name), number) for name in left}
        if not left:
            continue
        result = run(
            f"trial {number + 1} of {trials}", {name: name for name in left}, gains, episodes=episodes, seed=seed
        )
        if not result.complete:
            return Tuning(_frame(rows), metric, _best(rows), None, None if folder is None else folder.path, False)
        rows += [_row(result, name, number, metric, gains[name]) for name in left]
        if folder is not None:
            folder.write(rows)
    best = _best(rows)
    tuned = {name + TUNED: best[name] for name in controllers}
    place = {} if folder is None else {"out": folder.path / "held-out", "allow_mixed": allow_mixed}
    result = run("held-out", compared, tuned, episodes=held_out, seed=seed + 1, **place)
    if folder is not None:
        folder.finish(best, result.complete)
    return Tuning(_frame(rows), metric, best, result, None if folder is None else folder.path, result.complete)


def _behind(controllers: Sequence[str], env_id: str) -> dict[str, str]:
    """Weights and code behind the controllers, at their own gains."""
    known, env = registered_controllers(), single(env_id, json.dumps({}))
    found: dict[str, str] = {}
    for name in controllers:
        found |= behind(name, env_id, known[name], policy_for(known[name], env, {}))
    return found


class _Proposer:
    """Optuna as a function from finished trials to the next gains.

    Raises:
        OptionError: if it is not installed.
    """

    def __init__(self, seed: int) -> None:
        try:
            import optuna
        except ImportError as error:
            raise OptionError("optuna", "not installed", "pip install 'artde-gym[tune]'") from error
        self._optuna = optuna
        self._seed = seed
        optuna.logging.set_verbosity(optuna.logging.WARNING)  # not one line a trial

    def propose(
        self, name: str, space: Mapping[str, GainRange], history: list[tuple[Gains, float]], number: int
    ) -> Gains:
        """Gains of trial `number`, to four digits."""
        if number == 0:
            return {gain: where.start for gain, where in space.items()}
        optuna = self._optuna
        ranges: dict[str, Any] = {
            gain: optuna.distributions.FloatDistribution(where.low, where.high, log=True)
            for gain, where in space.items()
        }
        own = np.random.SeedSequence([self._seed, zlib.crc32(name.encode()), number])
        study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=int(own.generate_state(1)[0])))
        study.add_trials(
            [optuna.trial.create_trial(params=params, distributions=ranges, value=cost) for params, cost in history]
        )
        found = study.ask(ranges).params
        return {gain: min(max(float(f"{found[gain]:.4g}"), where.low), where.high) for gain, where in space.items()}


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


def _frame(rows: list[dict[str, Any]]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=TRIAL_COLUMNS)


def _parsed(row: Mapping[str, str]) -> dict[str, Any]:
    """A row of trials.csv, to the last bit."""
    numbers = {"trial": int(row["trial"]), "cost": float(row["cost"]), "falls": int(row["falls"])}
    return {**row, **numbers, "error": float(row["error"] or "nan")}


class _Folder:
    """The folder of one tuning; it is made with the first finished trial, so that a bad argument leaves none behind."""

    def __init__(
        self, path: Path, configuration: Mapping[str, Any], behind_them: Mapping[str, str], allow_mixed: bool
    ) -> None:
        self.path = path
        self._configuration = plain_configuration(configuration)
        self._provenance = provenance(behind_them)
        self.rows: list[dict[str, Any]] = []
        if path.exists() and not is_empty(path):
            before = claim(path, RECORD, self._configuration)
            trials = path / "trials.csv"
            if trials.exists():
                with reading("trials.csv", trials, "a table that `tune` wrote", StoreError):
                    with trials.open(encoding="utf-8", newline="") as file:
                        self.rows = [_parsed(row) for row in csv.DictReader(file, strict=True)]
                    for row in self.rows:
                        if (
                            json.loads(row["gains"]).keys()
                            != self._configuration["controllers"][row["controller"]].keys()
                        ):
                            raise ValueError(f"gains of another law in a row of {row['controller']}")
            begun = before if self.rows else None
            self._provenance = continued(path, begun, self._provenance, allow_mixed=allow_mixed)
            if MIXED in self._provenance:
                self._write_record({}, complete=False)

    def write(self, rows: list[dict[str, Any]]) -> None:
        """Keep the finished trials."""
        if claim(self.path, RECORD, self._configuration) is None:
            self._write_record({}, complete=False)
        text = _frame(rows).to_csv(index=False, lineterminator="\n")
        write_atomically(self.path / "trials.csv", lambda file: file.write(text.encode()))

    def finish(self, best: Mapping[str, Gains], complete: bool) -> None:
        """Keep the best gains."""
        self._write_record(best, complete)

    def _write_record(self, best: Mapping[str, Gains], complete: bool) -> None:
        record = {
            "configuration": self._configuration,
            "provenance": self._provenance,
            "complete": complete,
            "best": best,
        }
        text = json.dumps(record, indent=2) + "\n"
        write_atomically(self.path / RECORD, lambda file: file.write(text.encode()))
