"""A multiverse's results: its episodes, the verdict on each claim, and the commands that reproduce a world."""

from __future__ import annotations

import dataclasses
import functools
import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from artde_gym.arrays import Array
from artde_gym.errors import OptionError, StoreError
from artde_gym.evaluation import statistics
from artde_gym.extras import require
from artde_gym.studies.multiverse.claims import OUTCOMES, WorldTable
from artde_gym.studies.multiverse.deciding import Deciding, what_decides
from artde_gym.studies.multiverse.design import MATCHED, Design, design
from artde_gym.studies.multiverse.verdict import Verdict, verdict_of
from artde_gym.studies.reproduce.reproduction import ABLATION
from artde_gym.studies.sweep.store import RECORD, read_sweep

FATES = {False: "survives", True: "falls"}
_GAINS, _KWARGS = "gains.", "env_kwargs."


@dataclasses.dataclass(frozen=True)
class Multiverse:
    """Results of a multiverse so far.

    Attributes:
        episodes: one row a world and controller, as `read_sweep` gives them, with columns `world` and `factor.<name>`.
        design: of the worlds.
        folder: where they are stored.
        complete: False while episodes are missing.
        provenance: of the last run.
    """

    episodes: pd.DataFrame
    design: Design
    folder: Path
    complete: bool
    provenance: Mapping[str, Any]

    @property
    def controllers(self) -> list[str]:
        """Labels of the controllers that have run in some world."""
        ran = set(self.episodes["controller"])
        return [name for name in self.design.labels if name in ran]

    @functools.cached_property
    def verdicts(self) -> list[Verdict]:
        """The claims with what the worlds say of them."""
        return [verdict_of(claim, self.table(claim.controllers)) for claim in self.design.claims]

    @property
    def claims(self) -> pd.DataFrame:
        """The verdicts as a table, one row a claim; see `artde_gym.studies.multiverse.verdict.Verdict`."""
        return pd.DataFrame([verdict.row() for verdict in self.verdicts])

    def table(self, controllers: tuple[str, ...]) -> WorldTable:
        """Return the worlds that all of these controllers have met."""
        return WorldTable(self.episodes, self.design.main, controllers)

    def factors(self, worlds: list[int]) -> Array:
        """Return the factors of some worlds as numbers (worlds, factors)."""
        known = self.design.worlds
        columns = [
            factor.numbers([known[number].factors[factor.name] for number in worlds]) for factor in self.design.factors
        ]
        return np.stack(columns, axis=1)

    def deciding(self, verdict: Verdict) -> Deciding | None:
        """Return which factors decide about a claim; None without two outcomes of `FOLDS` worlds each.

        Raises:
            MissingDependencyError: without scikit-learn.
        """
        said = {value: name for name, value in OUTCOMES.items()}
        outcomes = zip(verdict.worlds, verdict.outcome.tolist(), strict=True)
        return self._deciding(verdict.claim.text, {world: said[value] for world, value in outcomes if value in said})

    def deciding_survival(self, controller: str) -> Deciding | None:
        """Return which factors decide about the survival of a controller; errors as `deciding`."""
        rows: pd.DataFrame = self.episodes.loc[self.episodes["controller"] == controller]
        ended = zip(rows["world"].tolist(), rows["fell"].tolist(), strict=True)
        return self._deciding(f"survival of {controller}", {world: FATES[bool(fell)] for world, fell in ended})

    def _deciding(self, what: str, classes: Mapping[int, str]) -> Deciding | None:
        if what not in self._decidings:
            worlds = list(classes)
            self._decidings[what] = what_decides(self.factors(worlds), list(classes.values())) if worlds else None
        return self._decidings[what]

    @functools.cached_property
    def _decidings(self) -> dict[str, Deciding | None]:
        return {}

    def survival(self, controller: str) -> statistics.Estimate:
        """Return the share of worlds in which a controller does not fall, with Wilson's interval."""
        fell = self.episodes.loc[self.episodes["controller"] == controller, "fell"]
        return statistics.rate(int((~fell.astype(bool)).sum()), len(fell))

    def command(self, world: int, controllers: tuple[str, ...] | None = None) -> list[str]:
        """Return copyable commands that run a world again, as few as possible: the second pass has one of its own.

        Raises:
            OptionError: for a world or controller without an episode.
        """
        rows = [self._row(world, name) for name in controllers or tuple(self.controllers)]
        apart = [row for row in rows if row["controller"] == MATCHED]
        return [
            self._command(world, some)
            for some in ([row for row in rows if row["controller"] != MATCHED], apart)
            if some
        ]

    def _row(self, world: int, controller: str) -> dict[str, Any]:
        """Return an episode without what it has no value for."""
        rows = self.episodes[(self.episodes["world"] == world) & (self.episodes["controller"] == controller)]
        if rows.empty:
            raise OptionError("world", world, "choose one that has been run", f"has no episode of {controller}")
        return {str(key): value for key, value in rows.iloc[0].items() if value is not None and value == value}

    def _command(self, world: int, rows: list[dict[str, Any]]) -> str:
        names = [ABLATION if row["controller"] == MATCHED else row["controller"] for row in rows]
        kwargs, gains = _inside(rows[0], _KWARGS), {}
        for name, row in zip(names, rows, strict=True):
            if own := _inside(row, _GAINS):
                gains[name] = own
        words = ["artde-gym", "evaluate", "--controllers", ",".join(names), "--env", rows[0]["env"]]
        words += ["--scenario", rows[0]["scenario"], "--episodes", "1", "--seed", str(self.design.worlds[world].seed)]
        words += ["--vectorized"] if self.design.vectorized else []
        words += ["--env-kwargs", json.dumps(kwargs)] if kwargs else []
        words += ["--disturbances", rows[0]["disturbances"]] if "disturbances" in rows[0] else []
        words += ["--gains", json.dumps(gains)] if gains else []
        return shlex.join(words)


def read_multiverse(folder: str | Path) -> Multiverse:
    """Read a multiverse's folder, finished or not.

    Raises:
        StoreError: if the folder holds no multiverse, or a file in it is corrupt.
        MissingDependencyError: without pyarrow.
    """
    require("multiverse", "pyarrow")
    folder = Path(folder)
    run = last_run(folder)
    if run is None:
        raise StoreError("folder", str(folder), "choose one that `artde-gym multiverse` wrote", "holds no multiverse")
    episodes = read_sweep(folder)
    if "world" in episodes:
        episodes = episodes.astype({"world": np.int64})
    return Multiverse(episodes, design(run["sweep"]), folder, bool(run["complete"]), run["provenance"])


def last_run(folder: Path) -> dict[str, Any] | None:
    """Return what the record says of the last run in a multiverse's folder; None for any other folder."""
    try:
        run = json.loads((folder / RECORD).read_text(encoding="utf-8"))["runs"][-1]
        return run if "factors" in run["sweep"] else None
    except (OSError, ValueError, KeyError, IndexError, TypeError, RecursionError):
        return None


def _inside(row: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    """Return the values of columns with a prefix as JSON has them; text of lists and mappings is read."""
    return {name.removeprefix(prefix): _plain(value) for name, value in row.items() if name.startswith(prefix)}


def _plain(value: Any) -> Any:
    if isinstance(value, str):
        return json.loads(value) if value[:1] in "[{" else value
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    number = float(value)
    return int(number) if number.is_integer() else number
