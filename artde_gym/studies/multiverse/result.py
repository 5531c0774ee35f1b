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
from artde_gym.studies.multiverse.claims import OUTCOMES, WorldTable
from artde_gym.studies.multiverse.deciding import Deciding, what_decides
from artde_gym.studies.multiverse.design import MATCHED, Design, design
from artde_gym.studies.multiverse.verdict import Verdict, verdict_of
from artde_gym.studies.reproduce.reproduction import ABLATION
from artde_gym.studies.sweep.store import RECORD, read_sweep

_GAINS, _KWARGS = "gains.", "env_kwargs."


@dataclasses.dataclass(frozen=True)
class Multiverse:
    """What a multiverse has found so far.

    Attributes:
        episodes: one row a world and controller, as of `read_sweep`, with columns `world` and `factor.<name>`.
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
        """Return which factors decide about a claim; None where almost all worlds agree.

        Raises:
            MissingDependencyError: without scikit-learn.
        """
        if verdict.claim.text not in self._decidings:
            said = {value: name for name, value in OUTCOMES.items()}
            known = np.isfinite(verdict.outcome)
            worlds = [number for number, decided in zip(verdict.worlds, known.tolist(), strict=True) if decided]
            classes = [said[value] for value in verdict.outcome[known].tolist()]
            found = what_decides(self.factors(worlds), classes) if worlds else None
            self._decidings[verdict.claim.text] = found
        return self._decidings[verdict.claim.text]

    @functools.cached_property
    def _decidings(self) -> dict[str, Deciding | None]:
        return {}

    def survival(self, controller: str) -> statistics.Estimate:
        """Return the share of worlds in which a controller does not fall, with Wilson's interval."""
        fell = self.episodes.loc[self.episodes["controller"] == controller, "fell"]
        return statistics.rate(int((~fell.astype(bool)).sum()), len(fell))

    def command(self, world: int, controllers: tuple[str, ...] | None = None) -> list[str]:
        """Return commands, one for each controller, that run a world again; each copyable.

        Raises:
            OptionError: for a world or controller without an episode.
        """
        return [self._command(world, name) for name in controllers or tuple(self.controllers)]

    def _command(self, world: int, controller: str) -> str:
        rows = self.episodes[(self.episodes["world"] == world) & (self.episodes["controller"] == controller)]
        if rows.empty:
            raise OptionError("world", f"{world} of {controller}", "one that has been run")
        row = {str(key): value for key, value in rows.iloc[0].items() if value is not None and value == value}
        name = ABLATION if controller == MATCHED else controller
        scenario = row["scenario"]
        words = ["artde-gym", "evaluate", "--controllers", name, "--env", row["env"], "--scenario", scenario]
        words += ["--episodes", "1", "--seed", str(self.design.worlds[world].seed), "--backend", self.design.backend]
        kwargs, gains = _inside(row, _KWARGS), _inside(row, _GAINS)
        words += ["--env-kwargs", json.dumps(kwargs)] if kwargs else []
        words += ["--disturbances", row["disturbances"]] if "disturbances" in row else []
        words += ["--gains", json.dumps({name: gains})] if gains else []
        return shlex.join(words)


def read_multiverse(folder: str | Path) -> Multiverse:
    """Read a multiverse's folder, finished or not.

    Raises:
        StoreError: if the folder holds no multiverse, or a file in it is corrupt.
        OptionError: without pyarrow.
    """
    folder = Path(folder)
    run = last_run(folder)
    if run is None:
        raise StoreError("multiverse", str(folder), "a folder that `artde-gym multiverse` wrote")
    return Multiverse(read_sweep(folder), design(run["sweep"]), folder, bool(run["complete"]), run["provenance"])


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
