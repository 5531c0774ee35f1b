"""The folder of a sweep, which outlives everything that may happen to what writes it.

    sweep.json                      format, and for each run what it was asked for and with what software
    episodes/part-000001.parquet    finished episodes, see `artde_gym.studies.sweep.parquet`; all have the same columns
    corrupt/                        files that were not as they had been written; their episodes are run again
    .lock                           held by the process that writes, see `artde_gym.evaluation.lock`

Every file is written under another name, synchronised with the disk and renamed: it is there whole or not at all. An
episode is known by its cell (a hash of everything that decides about it) and its number, so that none is run twice;
one process alone writes, so that none is stored twice. A part waits for more episodes for a second, later for a
hundredth of the run's time so far, at most for half a minute: no more work is lost when the process is killed.
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
    """A sweep's folder, opened to be written: read at once if it is there, changed by `begin` and later.

    Who opens it holds its lock (`artde_gym.evaluation.lock`).

    Attributes:
        done: episodes that it holds.
        set_aside: files that are not as they had been written.

    Raises:
        StoreError: if it cannot be read.
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
        if kind is None or not issubclass(kind, StoreError):  # a disk that is full is not tried once more
            self.flush()

    def begin(
        self, sweep: str, types: parquet.Types, behind: Mapping[str, str] | None = None, *, allow_mixed: bool = False
    ) -> None:
        """Make the folder ready for episodes: what is corrupt goes aside, what an earlier process left half done goes.

        Args:
            sweep: what was asked for, as JSON.
            types: columns that episodes will have, as far as they are known.
            behind: hashes of weights and code behind controllers.
            allow_mixed: whether episodes that other software ran may be continued.

        Raises:
            StoreError: if the folder holds something else, episodes that other software ran, or cannot be written.
        """
        before = self._runs[-1]["provenance"] if self.done and self._runs else None
        made_by = continued(self.folder, before, provenance(behind), allow_mixed=allow_mixed)
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
        """Take in finished episodes; they are written when `due` finds it time.

        Raises:
            StoreError: if they cannot be written; what is stored already stays whole.
        """
        self._waiting += rows
        self.due()

    def due(self) -> None:
        """Write what has waited for long enough; errors as of `add`."""
        now = time.monotonic()
        if now - self._flushed >= min(max(SHORTEST, SHARE * (now - self._started)), LONGEST):
            self.flush()

    def flush(self) -> None:
        """Write all that waits as one part; errors as of `add`."""
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
        """Note that nothing is missing; errors as of `add`."""
        self.flush()
        self._runs[-1]["complete"] = True
        with self._writing():
            self._write_record()

    def _take(self) -> None:
        """Read what is there."""
        if _runs(self.folder) is None and not _parts(self.folder):
            raise _unreadable(self.folder)
        self._taken = True
        runs = _runs(self.folder)
        if runs is None and (self.folder / RECORD).exists():
            self.set_aside.append(self.folder / RECORD)  # the parts tell all that is needed
        self._runs = runs or []
        for path in _parts(self.folder):
            try:
                part = _read(path)
            except StoreError:
                self.set_aside.append(path)
                continue
            keys = list(zip(part["cell"].to_pylist(), part["episode"].to_pylist(), strict=True))
            if len(set(keys)) < len(keys) or not self.done.isdisjoint(keys):
                self.set_aside.append(path)  # no file of this command: an episode stands in one of them, once
                continue
            self.done.update(keys)
            self._parts[path] = parquet.types_in(part)
            self._types = parquet.joined(self._types, self._parts[path])

    def _clear(self, *patterns: str) -> None:
        """Remove what a process was writing when it was killed."""
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
        write_atomically(path, lambda file: file.write(data), by_way_of=self.folder)  # readers see whole parts alone
        self._parts[path] = dict(self._types)

    def _number(self) -> int:
        """Of the last part; those set aside count, so that no name comes twice."""
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
            allowed = f"one that can be written ({error}); what it holds is whole, and the same command continues"
            raise StoreError("sweep folder", str(self.folder), allowed) from error


def read_sweep(folder: str | Path) -> pd.DataFrame:
    """The finished episodes of a sweep, one row each; see `artde_gym.studies.sweep.parquet` for the columns.

    The order is that of the columns in front, however many processes ran the sweep. It may still be running.

    Raises:
        StoreError: if the folder is no sweep's, or a file in it is corrupt.
        OptionError: without pyarrow.
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
    """The runs in the record; None if it cannot be read."""
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
    return StoreError("sweep folder", str(folder), f"a folder with a {RECORD} that can be read")


def _read(path: Path) -> Any:
    try:
        part = parquet.decode(path.read_bytes())
        return part.rename_columns([current_column(name) for name in part.column_names])
    except (OSError, ValueError) as error:
        allowed = f"as it was written ({error}); the sweep's command sets it aside and runs its episodes again"
        raise StoreError("part of a sweep", str(path), allowed) from error
