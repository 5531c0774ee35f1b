"""The robustness frontier: how much of one disturbance each controller survives.

The standard test, the same for all controllers and used where no disturbances are given, is a walk of Ojas of 12 s in
scenario S2, or a flight of the Q450 of 20 s in scenario Q1 (its payload is not dropped before the end), with what is
varied set to its value. Where a push is varied, there is one push for 0.2 s on the chest, or the vehicle, in place of
the scenario's own, from any side with equal probability, at a time drawn uniformly from one stride of steady walking (5
to 7 s) or half a loop at full speed (6 to 16 s): a robot is easier to topple in some phases than in others, and nobody
chooses when he is pushed. Where a rotor's loss is varied, it is the front left one's, from such a time on.

A level counts as survived if the *observed* share of episodes without a fall is at least `survival`. The bracket holds
the point where the observed share crosses it, for these seeds. What n episodes say about the true share is Wilson's
95 % interval at both ends of the bracket: with 18 of 20 survived it is 70 to 97 %. Seeds are the same at every level
and for every controller, so that two frontiers differ by the controllers and not by luck of the draw; they are one
sample of the variation nonetheless. Levels off a controller's path through the bisection are not run: survival that
falls and rises again between them stays unseen.

    frontier.csv     one row a controller
    levels.csv       one row a tested level and controller
    frontier.png     survival against the varied value
    frontier.json    configuration and provenance, written before the first episode
    levels/<value>/  the results folder of each level, see `artde_gym.evaluation.store`
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from artde_gym.errors import OptionError, among
from artde_gym.evaluation import statistics
from artde_gym.evaluation.environments import Backend, arguments_of, with_engine
from artde_gym.evaluation.evaluate import CUSTOM, Cell, Update, checked_gains, evaluate, labelled, tried
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.provenance import MIXED, continued, provenance
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.store import claim, plain_configuration, write_atomically
from artde_gym.evaluation.workers import check_workers
from artde_gym.kit import Harder
from artde_gym.studies.frontier.axis import Axis, axis
from artde_gym.studies.frontier.result import RECORD, Frontier
from artde_gym.studies.frontier.standard import standard_test

TRACE_HZ = 10.0  # a frontier has hundreds of episodes; their traces are for a look at a fall, not for metrics
LEVEL_COLUMNS = ["value", "controller", "episodes", "survived", "rate", "low", "high"]
TABLE_COLUMNS = ["controller", "relation", "frontier", "low", "high"]
TABLE_COLUMNS += [f"{end}_rate{part}" for end in ("low", "high") for part in ("", "_from", "_to")]

Outcomes = Mapping[int, bool]
"""Grid index -> whether the level was survived."""


@writes_folder
def frontier(
    controllers: Sequence[str | Policy] | Mapping[str, str | Policy],
    env_id: str = "BipedPush-v0",
    vary: str = "push.magnitude",
    *,
    low: float | None = None,
    high: float | None = None,
    tolerance: float | None = None,
    harder: Harder | None = None,
    survival: float = 0.9,
    episodes: int = 20,
    seed: int = 0,
    workers: int = 1,
    out: str | Path | None = None,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    gains: Mapping[str, Mapping[str, Any]] | None = None,
    backend: Backend = "single",
    allow_mixed: bool = False,
    on_progress: Callable[[float, Update], None] | None = None,
) -> Frontier:
    """Find by bisection the hardest value of one disturbance that each controller survives.

    Args:
        controllers: as for `evaluate`.
        env_id: any registered environment of this project.
        vary: "kind.parameter" of `artde_gym.disturbances.KINDS`, in all entries of a kind that takes several; or an
            argument of the environment that is a number.
        low: smallest value, in the parameter's unit (a control period in s); there are defaults for usual paths.
        high: largest value.
        tolerance: width of the bracket to be found.
        harder: whether "larger" or "smaller" values are harder; there are defaults for usual paths.
        survival: share of episodes without a fall that a level takes to count as survived, above 0 up to 1.
        episodes: of each controller at each level.
        seed: of everything; episode i has the same seed at every level and for every controller.
        workers: processes; the results do not depend on it.
        out: folder to store everything in; the same call continues an interrupted one.
        disturbances: in place of the standard test's; the environment's own duration is then kept, too.
        env_kwargs: arguments of the environment.
        gains: as for `evaluate`, also `backend` and `allow_mixed`.
        on_progress: called with the value of the running level and the progress of its episodes.

    Returns:
        The frontier; `complete` is False after an interruption (Ctrl-C), with all finished levels in it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for a bad argument, before the first episode.
        StoreError: if `out` holds other results, or results of other software, or is written by another process.
    """
    check_workers(workers)
    if not (isinstance(survival, (int, float)) and 0 < survival <= 1):
        raise OptionError("survival", survival, "above 0 up to 1")
    named = labelled(controllers)
    gains = checked_gains(gains, named)
    varied = axis(env_id, vary, low, high, tolerance, harder)
    arguments = _arguments(env_id, backend, varied, env_kwargs or {})
    if disturbances is None:
        disturbances, arguments = standard_test(env_id, varied.path, arguments)
    if not isinstance(disturbances, Mapping):
        raise OptionError("disturbances", disturbances, "a mapping of kinds to their parameters")
    grid = varied.levels
    placed = {value: varied.place(value, disturbances, arguments) for value in (grid[0], grid[-1])}
    if varied.kind is None:  # nothing here knows the argument's range: let the environment refuse it at once
        for _, end in placed.values():
            tried("single", Cell(CUSTOM, env_id, end))

    configuration = {
        "env": env_id,
        "axis": dataclasses.asdict(varied),
        "controllers": list(named),  # what they stand for is checked by the folders of the levels
        "survival": survival,
        "episodes": episodes,
        "seed": seed,
        "disturbances": disturbances,
        "env_kwargs": arguments,
        "gains": gains,
        "backend": backend,
    }
    folder = None if out is None else _Folder(Path(out), configuration, allow_mixed)
    rows: list[dict[str, Any]] = []

    def run(index: int, names: list[str]) -> dict[str, bool]:
        value = grid[index]

        def report(update: Update) -> None:
            if on_progress is not None:
                on_progress(value, update)

        here, kwargs = varied.place(value, disturbances, arguments)
        result = evaluate(
            {name: named[name] for name in names},
            env_id,
            episodes=episodes,
            seed=seed,
            workers=workers,
            out=None if folder is None else folder.level(value),
            disturbances=here,
            env_kwargs=kwargs,
            gains={name: gains[name] for name in names if name in gains},
            backend=backend,
            trace_hz=TRACE_HZ,
            allow_mixed=allow_mixed,
            on_progress=report,
        )
        if not result.complete:
            raise KeyboardInterrupt
        survived: dict[str, bool] = {}
        for name in names:
            falls, rate = result.falls(CUSTOM, name)
            share = statistics.rate(rate.n - falls, rate.n)
            survived[name] = share.value >= survival
            rows.append(dict(zip(LEVEL_COLUMNS, (value, name, rate.n, rate.n - falls, *share[:3]), strict=True)))
        if folder is not None:
            folder.write(_frontier(varied, list(named), rows, survival, folder.path, complete=False))
        return survived

    complete = True
    try:
        search(len(grid), list(named), run)
    except KeyboardInterrupt:
        complete = False
    except Exception:
        if folder is not None:
            folder.abandon()
        raise
    found = _frontier(varied, list(named), rows, survival, None if folder is None else folder.path, complete)
    if folder is not None:
        folder.write(found)
        if rows:
            from artde_gym.studies.frontier.figure import draw  # Matplotlib takes long: not at each start of a worker

            write_atomically(folder.path / "frontier.png", lambda file: draw(found, file))
    return found


def search(
    size: int, names: Sequence[str], run: Callable[[int, list[str]], Mapping[str, bool]]
) -> dict[str, dict[int, bool]]:
    """Bisect for each name on the levels 0 (easiest) to size - 1 (hardest), size >= 2.

    All searches go on in step. As a level can come up at one depth of a bisection only, all that need it ask for it at
    the same time: `run(level, names)`, which returns whether each of them survived, is called at most once a level.
    """
    outcomes: dict[str, dict[int, bool]] = {name: {} for name in names}
    while True:
        wanted: dict[int, list[str]] = {}
        for name in names:
            level = _next(outcomes[name], size)
            if level is not None:
                wanted.setdefault(level, []).append(name)
        if not wanted:
            return outcomes
        for level in sorted(wanted):
            for name, survived in run(level, wanted[level]).items():
                outcomes[name][level] = survived


def bracket(outcomes: Outcomes) -> tuple[int | None, int | None]:
    """Hardest level survived and easiest one failed, None where there is none: a bisection keeps the first below."""
    return (
        max((level for level, survived in outcomes.items() if survived), default=None),
        min((level for level, survived in outcomes.items() if not survived), default=None),
    )


def _next(outcomes: Outcomes, size: int) -> int | None:
    survived, failed = bracket(outcomes)
    if failed is None:
        return 0 if survived is None else size - 1 if survived < size - 1 else None
    if survived is None or failed - survived == 1:
        return None
    return (survived + failed) // 2


def _frontier(
    varied: Axis, names: list[str], rows: list[dict[str, Any]], survival: float, folder: Path | None, complete: bool
) -> Frontier:
    order = {name: i for i, name in enumerate(names)}
    ordered = sorted(rows, key=lambda row: (row["value"], order[row["controller"]]))
    table = [_summary(varied, name, [row for row in rows if row["controller"] == name], survival) for name in names]
    return Frontier(
        pd.DataFrame(table, columns=TABLE_COLUMNS),
        pd.DataFrame(ordered, columns=LEVEL_COLUMNS),
        varied,
        survival,
        folder,
        complete,
    )


def _summary(varied: Axis, name: str, rows: list[dict[str, Any]], survival: float) -> tuple[Any, ...]:
    """One row of the table, from the levels of one controller."""
    grid = varied.levels
    by_level = {grid.index(row["value"]): row for row in rows}
    survived, failed = bracket({level: row["rate"] >= survival for level, row in by_level.items()})
    larger = varied.harder == "larger"
    relation, value = "", np.nan
    if survived is not None and failed is not None and failed - survived == 1:
        relation, value = "=", grid[survived]
    elif survived == len(grid) - 1:
        relation, value = ">=" if larger else "<=", grid[-1]
    elif failed == 0:
        relation, value = "<" if larger else ">", grid[0]
    below, above = (survived, failed) if larger else (failed, survived)
    ends = [np.nan if level is None else grid[level] for level in (below, above)]
    rates = [
        [np.nan] * 3 if level is None else [by_level[level][part] for part in ("rate", "low", "high")]
        for level in (below, above)
    ]
    return (name, relation, value, *ends, *rates[0], *rates[1])


def _arguments(env_id: str, backend: Backend, varied: Axis, given: Mapping[str, Any]) -> dict[str, Any]:
    known = arguments_of(env_id, backend)
    for name in given:
        if name not in known:
            raise OptionError(f"argument of {env_id}", name, among(name, known))
        if name == "disturbances" or (varied.kind is None and name == varied.name):
            raise OptionError("env_kwargs", name, "arguments that are not varied; disturbances are given on their own")
    return with_engine(env_id, given, backend)


class _Folder:
    """The folder of one frontier, claimed by its record."""

    def __init__(self, path: Path, configuration: Mapping[str, Any], allow_mixed: bool) -> None:
        self.path = path
        self._configuration = plain_configuration(configuration)
        before = claim(path, RECORD, self._configuration)
        begun = before if (path / "levels").exists() else None
        self._provenance = continued(path, begun, provenance(), allow_mixed=allow_mixed)
        if before is None or MIXED in self._provenance:
            self._write_record(None)

    def level(self, value: float) -> Path:
        return self.path / "levels" / f"{value:.10g}"

    def write(self, found: Frontier) -> None:
        for name, frame in (("frontier.csv", found.table), ("levels.csv", found.levels)):
            text = frame.to_csv(index=False, lineterminator="\n")
            write_atomically(self.path / name, lambda file, text=text: file.write(text.encode()))
        self._write_record(found)

    def abandon(self) -> None:
        """Give a folder back in which nothing was run, after an argument that `evaluate` refused."""
        if not (self.path / "levels").exists():
            (self.path / RECORD).unlink(missing_ok=True)

    def _write_record(self, found: Frontier | None) -> None:
        record = {
            "configuration": self._configuration,
            "provenance": self._provenance,
            "complete": found is not None and found.complete,
            "frontier": [] if found is None else json.loads(str(found.table.to_json(orient="records"))),
        }
        text = json.dumps(record, indent=2) + "\n"
        write_atomically(self.path / RECORD, lambda file: file.write(text.encode()))
