"""A results folder, finished or not, as a report reads it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from artde_gym.arguments import wrap_read_errors
from artde_gym.arrays import Array
from artde_gym.errors import StoreError
from artde_gym.evaluation.environments import metrics_spec_of
from artde_gym.evaluation.metrics import Span, events_of
from artde_gym.evaluation.result import Result, read_result
from artde_gym.evaluation.rollout import nested
from artde_gym.evaluation.store import parse_table, read_record, read_traces
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.palette import Style
from artde_gym.studies.reproduce.claims import CLAIM_COLUMNS

ABLATIONS = "ablation"  # folder of `reproduce`'s ablations
TIME = "time"
INSIDE = "policy."


@dataclasses.dataclass(frozen=True)
class Run:
    """An evaluation on disk.

    Attributes:
        result: its finished episodes, including those of an ablation.
        record: content of `summary.json`: configuration and provenance.
        claims: the thesis' claims with their verdicts, if they were judged.
        ablation: scenario -> the run of `reproduce`'s ablation in it, from a folder of its own.
    """

    folder: Path
    result: Result
    record: Mapping[str, Any]
    claims: pd.DataFrame | None = None
    ablation: Mapping[str, Run] = dataclasses.field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> Run:
        """Read an evaluation's folder; a row that is being written is left out.

        Raises:
            StoreError: if it is not one.
        """
        record, result = read_record(folder), read_result(folder)
        wanted, episodes, complete = record["configuration"], result.episodes, result.complete
        judged, claims = None, folder / "claims.csv"
        if claims.exists():
            with wrap_read_errors("claims.csv", claims, "a table that `reproduce` wrote", StoreError):
                judged = parse_table(claims.read_text(encoding="utf-8"), CLAIM_COLUMNS)
        found = {file.parent.name: cls.read(file.parent) for file in folder.glob(f"{ABLATIONS}/*/summary.json")}
        ablation = {cell["name"]: found[cell["name"]] for cell in wanted["cells"] if cell["name"] in found}
        if ablation:
            episodes = pd.concat([episodes, *(part.result.episodes for part in ablation.values())], ignore_index=True)
            complete = complete and all(part.result.complete for part in ablation.values())
        return cls(folder, Result(episodes, folder, complete), record, judged, ablation)

    def gains(self, scenario: str) -> dict[str, Mapping[str, Any]]:
        """Return controller -> gains that override its preset's."""
        own = dict(self.record["configuration"].get("gains", {}))
        return own | (self.ablation[scenario].gains(scenario) if scenario in self.ablation else {})

    def cell(self, scenario: str) -> Mapping[str, Any]:
        """Return environment and arguments of a scenario."""
        return next(cell for cell in self.record["configuration"]["cells"] if cell["name"] == scenario)

    @property
    def registered(self) -> list[str]:
        """Names of registered metrics that its episodes have."""
        return [name for name in self.record["configuration"].get("metrics", ()) if name in self.result.metrics]

    def tracking(self, scenario: str) -> MetricsSpec:
        cell = self.cell(scenario)
        return metrics_spec_of(cell["env_id"], cell["kwargs"])

    def episode(self, scenario: str) -> Episode | None:
        """Return the first episode with stored signals, of all controllers that have it."""
        numbers = sorted({int(i) for name in self.result.controllers for i in self.result.rows(scenario, name).index})
        for number in numbers:
            found = {
                name: signals
                for name in self.result.controllers
                if (signals := self._signals(scenario, name, number)) is not None
            }
            if found:
                return Episode(number, found)
        return None

    def _signals(self, scenario: str, controller: str, number: int) -> Signals | None:
        rows = self.result.rows(scenario, controller)
        if number not in rows.index:
            return None
        traces = read_traces(self.place(scenario, controller), scenario, controller, number)
        return None if traces is None else Signals(traces, rows.loc[number].to_dict())

    def place(self, scenario: str, controller: str) -> Path:
        """Return the folder that holds the signals of a controller in a scenario."""
        part = self.ablation.get(scenario)
        return self.folder if part is None or controller not in part.result.controllers else part.folder


@dataclasses.dataclass(frozen=True)
class Signals:
    """Signals of one controller in one episode.

    Attributes:
        fields: observations by name (samples, size), the policy's diagnostics under "policy.<name>", "time" (samples,).
        row: its row in the table of episodes.
    """

    fields: Mapping[str, Array]
    row: Mapping[Any, Any]

    @property
    def time(self) -> Array:
        return self.fields[TIME]

    @property
    def fell(self) -> bool:
        return bool(self.row["fell"])

    def inside(self, name: str) -> Array | None:
        """Return a diagnostic of the policy (samples, ...), if it exists."""
        return self.fields.get(INSIDE + name)


class Band(NamedTuple):
    """Parts of the time (s) in which something holds, and their style."""

    text: str
    style: Style
    spans: Sequence[Span]


class Strip(NamedTuple):
    """Bands that a robot shows below the time of every chart, and a sentence on them for captions."""

    caption: str
    bands: Sequence[Band]


NO_STRIP = Strip("", ())


@dataclasses.dataclass(frozen=True)
class Episode:
    """Episodes of several controllers with the same seed.

    Attributes:
        strip: shown below the time of its charts.
    """

    number: int
    signals: Mapping[str, Signals]
    strip: Strip = NO_STRIP

    @property
    def seed(self) -> int:
        return int(next(iter(self.signals.values())).row["seed"])

    @property
    def end(self) -> float:
        """End of the longest run (s)."""
        return max(float(signals.time[-1]) for signals in self.signals.values())

    @property
    def disturbances(self) -> dict[str, Any]:
        """Sampled disturbances, in the notation of the grammar."""
        row = next(iter(self.signals.values())).row
        return nested({str(key): value for key, value in row.items() if str(key).startswith("disturbance.")})

    @property
    def events(self) -> dict[str, Span]:
        return {name: span for name, span in events_of(self.disturbances).items() if span[0] <= self.end}
