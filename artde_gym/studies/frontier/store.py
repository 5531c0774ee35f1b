"""The folder of one frontier: its record, its tables, and the folders of its levels."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from artde_gym.evaluation.provenance import MIXED, continued, provenance
from artde_gym.evaluation.store import claim, plain_configuration, write_atomically
from artde_gym.studies.frontier.result import RECORD, Frontier

GRID = "grid"


class FrontierStore:
    """The folder of one frontier, claimed by its record."""

    def __init__(
        self, path: Path, configuration: Mapping[str, Any], engines: Mapping[str, str], allow_mixed: bool
    ) -> None:
        self.path = path
        self._configuration = plain_configuration(configuration)
        before = claim(path, RECORD, self._configuration)
        begun = before if self._begun else None
        self._provenance = continued(path, begun, provenance(engines=engines), allow_mixed=allow_mixed)
        if before is None or MIXED in self._provenance:
            self._write_record(None)

    def level(self, value: float) -> Path:
        return self.path / "levels" / f"{value:.10g}"

    def write(self, found: Frontier) -> None:
        half = () if found.half is None else (("half.csv", found.half),)
        for name, frame in (("frontier.csv", found.table), ("levels.csv", found.levels), *half):
            text = frame.to_csv(index=False, lineterminator="\n")
            write_atomically(self.path / name, lambda file, text=text: file.write(text.encode()))
        self._write_record(found)

    def abandon(self) -> None:
        """Give a folder back in which nothing was run, after an argument that `evaluate` refused."""
        if not self._begun:
            (self.path / RECORD).unlink(missing_ok=True)

    @property
    def _begun(self) -> bool:
        return any((self.path / name).exists() for name in ("levels", GRID))

    def _write_record(self, found: Frontier | None) -> None:
        record = {
            "configuration": self._configuration,
            "provenance": self._provenance,
            "complete": found is not None and found.complete,
            "frontier": [] if found is None else json.loads(str(found.table.to_json(orient="records"))),
        }
        text = json.dumps(record, indent=2) + "\n"
        write_atomically(self.path / RECORD, lambda file: file.write(text.encode()))
