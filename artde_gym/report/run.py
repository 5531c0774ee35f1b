"""A results folder as a report reads it, finished or not."""

from __future__ import annotations

import dataclasses
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from artde_gym.arguments import wrap_read_errors
from artde_gym.arrays import Array
from artde_gym.deprecation import current_configuration
from artde_gym.errors import StoreError
from artde_gym.evaluation.environments import metrics_spec_of
from artde_gym.evaluation.metrics import Span, events_of
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.store import parse_table, read_episodes
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.studies.reproduce.claims import CLAIM_COLUMNS

ABLATIONS = "ablation"  # folder of `reproduce`'s ablations
TIME = "time"
INSIDE = "policy."


@dataclasses.dataclass(frozen=True)
class Run:
    """An evaluation on disk.

    Attributes:
        result: its finished episodes, those of an ablation among them.
        record: what `summary.json` holds: configuration and provenance.
        claims: the thesis' claims with their verdicts, if they were judged.
        ablation: scenario -> the run of `reproduce`'s ablation in it, in a folder of its own.
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
            StoreError: if it is none.
        """
        with wrap_read_errors("results folder", folder, "one that `evaluate` or `frontier` wrote", StoreError):
            record = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
            wanted = record["configuration"] = current_configuration(record["configuration"])
            count = len(wanted["cells"]) * len(wanted["controllers"]) * wanted["episodes"]
        _, episodes = read_episodes(folder)
        complete = len(episodes) >= count
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
        """Controller -> gains in place of its preset's."""
        own = dict(self.record["configuration"].get("gains", {}))
        return own | (self.ablation[scenario].gains(scenario) if scenario in self.ablation else {})

    def cell(self, scenario: str) -> Mapping[str, Any]:
        """Environment and arguments of a scenario."""
        return next(cell for cell in self.record["configuration"]["cells"] if cell["name"] == scenario)

    @property
    def registered(self) -> list[str]:
        """Names of registered metrics that its episodes have."""
        return [name for name in self.record["configuration"].get("metrics", ()) if name in self.result.metrics]

    def tracking(self, scenario: str) -> MetricsSpec:
        return metrics_spec_of(self.cell(scenario)["env_id"])

    def episode(self, scenario: str) -> Episode | None:
        """The first episode whose signals are stored, of all controllers that have it."""
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
        part = self.ablation.get(scenario)
        if part is not None and controller in part.result.controllers:
            return part._signals(scenario, controller, number)
        path = self.folder / "traces" / scenario / f"{controller}-{number}.npz"
        rows = self.result.rows(scenario, controller)
        if not path.exists() or number not in rows.index:
            return None
        with wrap_read_errors("signals", path, "a file that `evaluate` wrote", StoreError):
            stored = np.load(io.BytesIO(path.read_bytes()), allow_pickle=False)  # a damaged file it would leave open
            return Signals({name: stored[name] for name in stored.files}, rows.loc[number].to_dict())


@dataclasses.dataclass(frozen=True)
class Signals:
    """What one controller did in one episode.

    Attributes:
        fields: observations by name (samples, size), the policy's inside under "policy.<name>", "time" (samples,).
        row: of the table of episodes.
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
        """A diagnostic of the policy (samples, ...), if it has it."""
        return self.fields.get(INSIDE + name)


@dataclasses.dataclass(frozen=True)
class Episode:
    """The same seed under several controllers."""

    number: int
    signals: Mapping[str, Signals]

    @property
    def seed(self) -> int:
        return int(next(iter(self.signals.values())).row["seed"])

    @property
    def end(self) -> float:
        """The longest of the runs (s)."""
        return max(float(signals.time[-1]) for signals in self.signals.values())

    @property
    def disturbances(self) -> dict[str, Any]:
        """What was drawn, as the grammar writes it."""
        row = next(iter(self.signals.values())).row
        return nested({str(key): value for key, value in row.items() if str(key).startswith("disturbance.")})

    @property
    def events(self) -> dict[str, Span]:
        return {name: span for name, span in events_of(self.disturbances).items() if span[0] <= self.end}


def nested(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Columns such as "disturbance.push.0.start" as the nested mappings and lists that they came from."""
    root: dict[str, Any] = {}
    for column, value in columns.items():
        if isinstance(value, float) and np.isnan(value):
            continue  # of another scenario
        *path, last = column.split(".")[1:]
        place = root
        for part in path:
            place = place.setdefault(part, {})
        place[last] = value
    return _lists(root)


def _lists(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    inner = {key: _lists(item) for key, item in value.items()}
    return list(inner.values()) if inner and all(key.isdigit() for key in inner) else inner
