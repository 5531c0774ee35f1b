"""Crash-safe results folder of a sweep.

    sweep.json                      format, and the request and software of each run
    episodes/part-000001.parquet    finished episodes, see `artde_gym.studies.sweep.parquet`; all have the same columns
    corrupt/                        corrupt files; their episodes are run again
    .lock                           held by the writing process, see `artde_gym.evaluation.lock`

Every file is written under a temporary name, synchronized with the disk and renamed: it is complete or missing. An
episode is identified by its cell (a hash of everything that determines it) and its number, so that none is run twice;
only one process writes, so that none is stored twice. A part waits for more episodes for a second, later for a
hundredth of the run's time so far, but for half a minute at most: no more work is lost if the process is killed.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.deprecation import current_column
from artde_gym.errors import StoreError
from artde_gym.evaluation.provenance import continued, provenance
from artde_gym.evaluation.store import claim, write_atomically
from artde_gym.studies.sweep import parquet

RECORD = "sweep.json"
CONFIGURATION = {"format": "artde-gym sweep", "schema": parquet.SCHEMA}
SHORTEST, SHARE, LONGEST = 1.0, 0.01, 30.0  # s, of the run's time, s: how long a part waits for more episodes

ORDER = ("env", "scenario", "controller", "cell", "episode")
_NUMBERED = re.compile(r"part-(\d+)\.parquet")

Key = tuple[str, int]
"""Cell and number of an episode."""


class SweepStore:
    """A sweep's folder, opened for writing: an existing one is read at once; `begin` and later calls change it.

    The caller must hold its lock (`artde_gym.evaluation.lock`).

    Attributes:
        done: episodes in it.
        set_aside: corrupt files in it.

    Raises:
        StoreError: if it is not readable.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.done: set[Key] = set()
        self.set_aside: list[Path] = []
        self._parts: dict[Path, parquet.Types] = {}
        self._types: parquet.Types = {}
        self._runs: list[dict[str, Any]] = []
        self._waiting: list[dict[str, Any]] = []
        self._taken = False
        self._started = self._flushed = time.monotonic()
        if (folder / RECORD).exists() or _parts(folder):
            self._take()

    def __enter__(self) -> SweepStore:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None or not issubclass(kind, StoreError):  # a full disk is not tried once more
            self.flush()

    def begin(
        self,
        sweep: str,
        types: parquet.Types,
        behind: Mapping[str, str] | None = None,
        engines: Mapping[str, str] | None = None,
        *,
        allow_mixed: bool = False,
    ) -> None:
        """Prepare the folder for episodes: set corrupt files aside, and remove half-written ones.

        Args:
            sweep: content of the sweep file, as JSON.
            types: known columns of its episodes.
            behind: hashes of the controllers' weights and code.
            engines: physics engines, and whether each one was asked for.
            allow_mixed: whether to resume episodes of other software.

        Raises:
            StoreError: if the folder holds something else or episodes of other software, or is not writable.
        """
        before = self._runs[-1]["provenance"] if self.done and self._runs else None
        made_by = continued(self.folder, before, provenance(behind, engines=engines), allow_mixed=allow_mixed)
        run = {"sweep": json.loads(sweep), "provenance": made_by, "complete": False}
        with self._writing():
            if not self._taken:
                self._clear(f".{RECORD}.*")
                if claim(self.folder, RECORD, CONFIGURATION) is None:
                    self._write_record()
                self._take()
            self._clear(f".{RECORD}.*", ".part-*")
            (self.folder / "episodes").mkdir(exist_ok=True)
            for path in self.set_aside:
                (self.folder / "corrupt").mkdir(exist_ok=True)
                os.replace(path, self.folder / "corrupt" / path.name)
            self._widen(types)
            self._runs.append(run)
            self._write_record()

    def add(self, rows: Iterable[dict[str, Any]]) -> None:
        """Add finished episodes; `due` writes them in time.

        Raises:
            StoreError: if they cannot be written; stored episodes stay complete.
        """
        self._waiting += rows
        self.due()

    def due(self) -> None:
        """Write episodes that have waited long enough; raises the errors of `add`."""
        now = time.monotonic()
        if now - self._flushed >= min(max(SHORTEST, SHARE * (now - self._started)), LONGEST):
            self.flush()

    def flush(self) -> None:
        """Write all waiting episodes as one part; raises the errors of `add`."""
        if not self._waiting:
            return
        rows, self._waiting = self._waiting, []  # so that no interruption makes them two parts
        path = self.folder / "episodes" / f"part-{self._number() + 1:06d}.parquet"
        try:
            with self._writing():
                self._widen(parquet.types_of(rows))
                self._write(path, parquet.table(rows, self._types))
        except KeyboardInterrupt:
            if not path.exists():
                self._waiting = rows
            raise
        self.done.update((row["cell"], row["episode"]) for row in rows)
        self._flushed = time.monotonic()

    def finish(self) -> None:
        """Record that the sweep is complete; raises the errors of `add`."""
        self.flush()
        self._runs[-1]["complete"] = True
        with self._writing():
            self._write_record()

    def _take(self) -> None:
        """Read the folder's content."""
        if _runs(self.folder) is None and not _parts(self.folder):
            raise _unreadable(self.folder)
        self._taken = True
        runs = _runs(self.folder)
        if runs is None and (self.folder / RECORD).exists():
            self.set_aside.append(self.folder / RECORD)  # the parts contain all that is needed
        self._runs = runs or []
        for path in _parts(self.folder):
            try:
                part = _read(path)
            except StoreError:
                self.set_aside.append(path)
                continue
            keys = list(zip(part["cell"].to_pylist(), part["episode"].to_pylist(), strict=True))
            if len(set(keys)) < len(keys) or not self.done.isdisjoint(keys):
                self.set_aside.append(path)  # not a file of this command: each episode is in only one of them
                continue
            self.done.update(keys)
            self._parts[path] = parquet.types_in(part)
            self._types = parquet.joined(self._types, self._parts[path])

    def _clear(self, *patterns: str) -> None:
        """Remove what a killed process was writing."""
        for pattern in patterns:
            for path in self.folder.glob(pattern):
                path.unlink()

    def _widen(self, types: parquet.Types) -> None:
        """Give all parts the same columns."""
        self._types = parquet.joined(self._types, types)
        for path, known in self._parts.items():
            if known.keys() != self._types.keys():
                self._write(path, parquet.widened(_read(path), self._types))

    def _write(self, path: Path, episodes: Any) -> None:
        data = parquet.encode(episodes)
        write_atomically(path, lambda file: file.write(data), by_way_of=self.folder)  # readers only see complete parts
        self._parts[path] = dict(self._types)

    def _number(self) -> int:
        """Return the number of the last part; those set aside count, so that names stay unique."""
        names = [path.name for path in self._parts] + [path.name for path in (self.folder / "corrupt").glob("*")]
        return max((int(found[1]) for name in names if (found := _NUMBERED.fullmatch(name))), default=0)

    def _write_record(self) -> None:
        text = json.dumps({"configuration": CONFIGURATION, "runs": self._runs}, indent=2) + "\n"
        write_atomically(self.folder / RECORD, lambda file: file.write(text.encode()))

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            problem = f"is not writable ({error}), but its content is intact"
            raise StoreError("sweep folder", str(self.folder), "re-run the command to resume", problem) from error


def read_sweep(folder: str | Path) -> pd.DataFrame:
    """Read the finished episodes of a sweep, one row each; see `artde_gym.studies.sweep.parquet` for the columns.

    Rows are ordered by the columns in front, however many processes ran the sweep. It may still be running.

    Raises:
        StoreError: if the folder is not a sweep's, or a file in it is corrupt.
        MissingDependencyError: without pyarrow.
    """
    folder = Path(folder)
    if _runs(folder) is None:
        raise _unreadable(folder)
    pa = parquet.pyarrow()
    parts = [_read(path) for path in _parts(folder)]
    types = dict(parquet.LABELS)
    for part in parts:
        types = parquet.joined(types, parquet.types_in(part))
    whole = pa.concat_tables([parquet.table([], types), *(parquet.widened(part, types) for part in parts)])
    return whole.sort_by([(name, "ascending") for name in ORDER]).to_pandas()


def _parts(folder: Path) -> list[Path]:
    return sorted((folder / "episodes").glob("*.parquet"))


def _runs(folder: Path) -> list[dict[str, Any]] | None:
    """Return the runs in the record; None if it is not readable."""
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        configuration, runs = record["configuration"], list(record["runs"])
        good = all(isinstance(run["provenance"]["packages"], dict) for run in runs)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    if configuration != CONFIGURATION:
        raise StoreError(f"format of {folder / RECORD}", configuration, repr(CONFIGURATION))
    return runs if good else None


def _unreadable(folder: Path) -> StoreError:
    return StoreError("folder", str(folder), "choose a folder that `sweep` wrote", f"has no readable {RECORD}")


def _read(path: Path) -> Any:
    try:
        part = parquet.decode(path.read_bytes())
        return part.rename_columns([current_column(name) for name in part.column_names])
    except (OSError, ValueError) as error:
        todo = "re-run the sweep to set it aside and run its episodes again"
        raise StoreError("part of a sweep", str(path), todo, f"is corrupt ({error})") from error
