"""Crash-safe results folder: finished episodes one by one, then the summary.

    episodes.csv     one row per episode and controller, appended as each one finishes
    summary.csv      mean and 95 % interval of every metric
    summary.json     configuration and provenance, written before the first episode
    traces/          <scenario>/<controller>-<episode>.npz, signals at the traces' rate

A folder belongs to one configuration and one software: only the same ones can resume it.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from artde_gym.arguments import check_file_name, wrap_read_errors
from artde_gym.deprecation import current_column, current_configuration
from artde_gym.errors import OptionError, StoreError
from artde_gym.evaluation.lock import NEW_OR_EMPTY, is_empty
from artde_gym.evaluation.provenance import MIXED, continued
from artde_gym.evaluation.seeds import episode_seed, with_exact_seeds
from artde_gym.files import write_atomically

RECORD, TABLE = "summary.json", "episodes.csv"
KEY = ("scenario", "controller", "episode")
_WORDS = ("scenario", "controller", "env", "fall_reason")
_REPAIR = "delete the damaged rows to run these episodes again"
_UNDAMAGED = f"a table of episodes as `evaluate` wrote it; {_REPAIR}"


class Store:
    """The folder of one evaluation, locked (`artde_gym.evaluation.lock`) while it is written.

    Args:
        folder: the results folder.
        configuration: configuration of the evaluation.
        made_by: provenance of this process.
        allow_mixed: whether to resume results of other software.

    Raises:
        OptionError: if JSON cannot store the configuration, or a name is not a valid file name.
        StoreError: if the folder contains anything but results of the same configuration and software.
    """

    def __init__(
        self, folder: Path, configuration: Mapping[str, Any], made_by: dict[str, Any], *, allow_mixed: bool = False
    ) -> None:
        self.folder = folder
        self._configuration = plain_configuration(configuration)
        for name in configuration["controllers"]:
            check_file_name("name of a controller", name)  # of its traces
        before = claim(self.folder, RECORD, self._configuration)
        self.rows = [] if before is None else self._read_rows()
        self._columns = list(self.rows[0]) if self.rows else []
        self._provenance = continued(folder, before if self.rows else None, made_by, allow_mixed=allow_mixed)
        if not self.rows or MIXED in self._provenance:  # records that results are mixed before they are
            self._write_record(None)

    def add(self, episodes: Sequence[tuple[Mapping[str, Any], Mapping[str, NDArray[Any]]]]) -> None:
        """Store finished episodes, each a row and traces; rows are written last, so that each row has its traces."""
        for row, traces in episodes:
            if traces:
                self.save_traces(row, traces)
        self.rows += [dict(row) for row, _ in episodes]
        if all(set(row) == set(self._columns) for row, _ in episodes):
            with (self.folder / TABLE).open("a", encoding="utf-8", newline="") as file:
                file.write("".join(_line([row[column] for column in self._columns]) for row, _ in episodes))
                file.flush()
                os.fsync(file.fileno())
        else:
            self._rewrite()

    def save_traces(self, row: Mapping[str, Any], traces: Mapping[str, NDArray[Any]]) -> None:
        path = _traces_path(self.folder, row["scenario"], row["controller"], row["episode"])
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, lambda file: np.savez_compressed(file, **traces))  # pyright: ignore[reportArgumentType]

    def finish(self, rows: list[dict[str, Any]], summary: pd.DataFrame) -> None:
        """Write the rows in their final order, and the summary."""
        self.rows = rows
        self._rewrite()
        write_atomically(self.folder / "summary.csv", lambda file: summary.to_csv(file))
        self._write_record(summary)

    def _write_record(self, summary: pd.DataFrame | None) -> None:
        record = {
            "configuration": self._configuration,
            "provenance": self._provenance,
            "episodes": len(self.rows),
            "summary": [] if summary is None else json.loads(str(summary.reset_index().to_json(orient="records"))),
        }
        text = json.dumps(record, indent=2) + "\n"
        write_atomically(self.folder / RECORD, lambda file: file.write(text.encode()))

    def _read_rows(self) -> list[dict[str, Any]]:
        path = self.folder / TABLE
        whole, frame = read_episodes(self.folder, self._configuration)
        if not frame.empty and path.stat().st_size != len(whole.encode()):
            write_atomically(path, lambda file: file.write(whole.encode()))
        return [{str(key): value for key, value in row.items()} for row in frame.to_dict(orient="records")]

    def _rewrite(self) -> None:
        """Write the whole table, for rows with additional columns."""
        self._columns = list(dict.fromkeys(column for row in self.rows for column in row))
        lines = [_line(self._columns)]
        lines += [_line([row.get(column, "") for column in self._columns]) for row in self.rows]
        write_atomically(self.folder / TABLE, lambda file: file.write("".join(lines).encode()))


def read_record(folder: Path) -> dict[str, Any]:
    """Return the content of a results folder's `summary.json`, its configuration under current names.

    Raises:
        StoreError: if there is none, or it is damaged.
    """
    with wrap_read_errors(
        "results folder", folder, "one that `evaluate`, `frontier`, `multiverse` or `train` wrote", StoreError
    ):
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        record["configuration"] = current_configuration(record["configuration"])
        wanted_episodes(record["configuration"])
        return record


def wanted_episodes(configuration: Mapping[str, Any]) -> int:
    """Return the number of episodes of a configuration."""
    names = [cell["name"] for cell in configuration["cells"]]
    return len(names) * len(configuration["controllers"]) * configuration["episodes"]


def read_episodes(folder: Path, configuration: Mapping[str, Any]) -> tuple[str, pd.DataFrame]:
    """Read the finished episodes, as text and parsed; a row cut off by a crash or an ongoing write is left out.

    Raises:
        StoreError: if the table is damaged, or has episodes that are not of the configuration.
    """
    whole, frame = _read_table(folder)
    with wrap_read_errors(TABLE, folder / TABLE, _UNDAMAGED, StoreError):
        _check_rows(folder / TABLE, frame, configuration)
    return whole, frame


def _check_rows(path: Path, frame: pd.DataFrame, wanted: Mapping[str, Any]) -> None:
    """Raise StoreError for an episode that is not of the configuration."""
    known = ([cell["name"] for cell in wanted["cells"]], wanted["controllers"], range(wanted["episodes"]))
    for column, values in zip(KEY, known, strict=True):
        strange = [value for value in frame[column] if value not in values]
        if strange:
            raise StoreError(TABLE, str(path), _REPAIR, f"has a {column} {strange[0]!r} of another run")
    pairs = set() if frame.empty else set(zip(frame["episode"].tolist(), frame["seed"].tolist(), strict=True))
    for episode, seed in pairs:
        if seed != episode_seed(wanted["seed"], episode):
            raise StoreError(TABLE, str(path), _REPAIR, f"has another seed for episode {episode}")


def _read_table(folder: Path) -> tuple[str, pd.DataFrame]:
    path = folder / TABLE
    with wrap_read_errors(TABLE, path, _UNDAMAGED, StoreError):
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        whole = text[: text.rfind("\n") + 1]
        if whole.count("\n") < 2:  # no row was finished, or not even the names of the columns
            return "", pd.DataFrame({name: [] for name in KEY})
        frame = parse_table(whole, _WORDS).rename(columns=current_column)
        for name in KEY[:2]:
            for value in frame[name].unique():
                check_file_name(name, value)
        for name, kind in {"episode": "iu", "seed": "iu", "fell": "b", "duration_s": "fiu"}.items():
            if frame[name].dtype.kind not in kind:
                raise ValueError(f"column {name} has values of another kind")
        words = [str(name) for name in frame.select_dtypes(exclude=["number", "bool"]) if name not in _WORDS]
        if any(not name.startswith("disturbance.") and frame[name].notna().any() for name in words):
            raise ValueError(f"text in the numeric columns {', '.join(words)}")
        if frame.duplicated(list(KEY)).any():
            raise ValueError("a duplicate episode")
        if (frame["seed"].to_numpy() < 0).any():
            raise ValueError("a negative seed")
    return whole, with_exact_seeds(frame)


def read_traces(folder: Path, scenario: str, controller: str, episode: int) -> dict[str, NDArray[Any]] | None:
    """Return the signals of an episode by name; None if none were stored.

    Raises:
        StoreError: if they cannot be read.
    """
    path = _traces_path(folder, scenario, controller, episode)
    if not path.exists():
        return None
    with wrap_read_errors("signals", path, "a file that `evaluate` wrote", StoreError):
        stored = np.load(io.BytesIO(path.read_bytes()), allow_pickle=False)  # a damaged file it would leave open
        return {name: stored[name] for name in stored.files}


def stored_names(folder: Path, scenario: str, controller: str, episode: int) -> list[str]:
    """Return the names of an episode's stored signals, without reading them.

    Raises:
        StoreError: if the file is damaged.
    """
    path = _traces_path(folder, scenario, controller, episode)
    if not path.exists():
        return []
    with wrap_read_errors("signals", path, "a file that `evaluate` wrote", StoreError), path.open("rb") as file:
        return list(np.load(file, allow_pickle=False).files)


def _traces_path(folder: Path, scenario: Any, controller: Any, episode: Any) -> Path:
    return folder / "traces" / str(scenario) / f"{controller}-{episode}.npz"


def parse_table(text: str, words: Collection[str]) -> pd.DataFrame:
    """Parse a CSV table; the columns in `words` are kept as text, all others are numbers to the last bit.

    pandas by itself would interpret "1", "true" and "nan" in text, and some of its releases round numbers.

    Raises:
        ValueError: if it is not a table, or has a duplicate column.
    """
    try:
        columns, *rows = csv.reader(io.StringIO(text), strict=True)
    except csv.Error as error:
        raise ValueError(str(error)) from error
    if len(set(columns)) != len(columns) or any(len(row) != len(columns) for row in rows):
        raise ValueError("rows of different lengths, or a duplicate column")
    parsed = {
        name: [row[i] for row in rows] if name in words else _parsed([row[i] for row in rows])
        for i, name in enumerate(columns)
    }
    return pd.DataFrame(parsed)


def _parsed(column: list[str]) -> list[Any]:
    """Parse a column as booleans, integers or floats (empty is NaN); as text if it is none of these."""
    if not {*column} - {"True", "False"}:
        return [value == "True" for value in column]
    for kind in (int, float):
        with contextlib.suppress(ValueError):
            return [kind(value if kind is int else value or "nan") for value in column]
    return [{"True": True, "False": False, "": np.nan}.get(value, value) for value in column]


def plain_configuration(configuration: Mapping[str, Any]) -> dict[str, Any]:
    """Return a configuration as JSON reads it back, NumPy's values as numbers and lists.

    Raises:
        OptionError: if it contains a value that JSON cannot store.
    """
    plain: dict[str, Any] = {}
    for field, value in configuration.items():
        try:
            plain[field] = json.loads(json.dumps(value, default=_from_numpy))
        except (TypeError, ValueError) as error:
            allowed = f"values that JSON can store ({error})"
            raise OptionError(field, value, allowed) from error
    return plain


def _from_numpy(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is not a JSON type")


def claim(folder: Path, record: str, configuration: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Create `folder` and return None, or return the provenance in its `record` (a file) of the same configuration.

    Raises:
        StoreError: if the folder contains anything but results of the same configuration.
    """
    path = folder / record
    if path.exists():
        with wrap_read_errors("output folder", folder, f"a folder with a readable {record}", StoreError):
            content = json.loads(path.read_text(encoding="utf-8"))
            found = current_configuration(content["configuration"])
            before = dict(content.get("provenance", {}))
        if found != configuration:
            differs = [key for key in {*found, *configuration} if found.get(key) != configuration.get(key)]
            problem = f"contains other results (different: {', '.join(sorted(differs))})"
            raise StoreError("output folder", str(folder), "choose a new folder", problem)
        return before
    if folder.exists() and not (folder.is_dir() and is_empty(folder)):
        raise StoreError("output folder", str(folder), NEW_OR_EMPTY, "contains other files")
    folder.mkdir(parents=True, exist_ok=True)
    return None


def _line(values: list[Any]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerow(
        "" if value != value else value for value in values
    )  # NaN is empty
    return buffer.getvalue()
