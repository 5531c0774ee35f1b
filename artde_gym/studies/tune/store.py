"""Crash-safe folder of one tuning: its record, and its finished trials."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.arguments import wrap_read_errors
from artde_gym.errors import StoreError
from artde_gym.evaluation.lock import is_empty
from artde_gym.evaluation.provenance import MIXED, continued, provenance
from artde_gym.evaluation.store import claim, plain_configuration, write_atomically
from artde_gym.studies.tune.proposer import Gains

RECORD = "tuning.json"
TRIAL_COLUMNS = ["controller", "trial", "cost", "error", "falls", "gains"]


def frame_of(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """Return trials as a table."""
    return pd.DataFrame(rows, columns=TRIAL_COLUMNS)


def _parsed(row: Mapping[str, str]) -> dict[str, Any]:
    """Parse a row of trials.csv, to the last bit."""
    numbers = {"trial": int(row["trial"]), "cost": float(row["cost"]), "falls": int(row["falls"])}
    return {**row, **numbers, "error": float(row["error"] or "nan")}


class TuningStore:
    """The folder of one tuning, created with the first finished trial: an invalid argument leaves none behind."""

    def __init__(
        self,
        path: Path,
        configuration: Mapping[str, Any],
        behind_them: Mapping[str, str],
        engines: Mapping[str, str],
        allow_mixed: bool,
    ) -> None:
        self.path = path
        self._configuration = plain_configuration(configuration)
        self._provenance = provenance(behind_them, engines=engines)
        self.rows: list[dict[str, Any]] = []
        if path.exists() and not is_empty(path):
            before = claim(path, RECORD, self._configuration)
            trials = path / "trials.csv"
            if trials.exists():
                with wrap_read_errors("trials.csv", trials, "a table that `tune` wrote", StoreError):
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
        """Store the finished trials."""
        if claim(self.path, RECORD, self._configuration) is None:
            self._write_record({}, complete=False)
        text = frame_of(rows).to_csv(index=False, lineterminator="\n")
        write_atomically(self.path / "trials.csv", lambda file: file.write(text.encode()))

    def finish(self, best: Mapping[str, Gains], complete: bool) -> None:
        """Store the best gains."""
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
