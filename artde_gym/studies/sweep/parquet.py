"""Episodes as the bytes of one Parquet file that contains its own hash.

The schema, version `SCHEMA`, is the same for all files of a sweep. Columns in front: `cell` (hash of a cell's
settings), `controller`, `env`, `scenario`, `seed`, `episode`. Then, in alphabetical order, the cell's other settings
(`gains.<gain>`, `env_kwargs.<argument>`, `disturbances` as JSON), the columns of `artde_gym.evaluation.metrics` and the
sampled disturbances (`disturbance.payload.mass`, ...). Numbers are float64, except for `seed` (uint64) and `episode`
(int64); lists and mappings are JSON. A missing value is null, never NaN.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from artde_gym.errors import StoreError
from artde_gym.extras import needs

SCHEMA = 2
LABELS = {"cell": "text", "controller": "text", "env": "text", "scenario": "text", "seed": "seed", "episode": "whole"}
Types = dict[str, str]
"""Column -> "number", "text" or "switch"; "seed" and "whole" for those of `LABELS`."""

_VERSION, _DIGEST = "artde_gym.schema", b"artde_gym.sha256"
_ZEROS = b"0" * 64
_STRING = b"\x18\x40"  # how Thrift's compact protocol announces 64 bytes


def pyarrow() -> Any:
    """Import pyarrow.

    Raises:
        MissingDependencyError: if it is not installed.
    """
    with needs("sweep"):
        import pyarrow
        import pyarrow.parquet
    return pyarrow


def types_of(rows: Iterable[Mapping[str, Any]]) -> Types:
    """Return the types of the rows' columns; None has no type.

    Raises:
        StoreError: for a column of several types.
    """
    types = dict(LABELS)
    for row in rows:
        types = joined(types, {name: _type(name, value) for name, value in row.items() if value is not None})
    return types


def joined(first: Types, second: Types) -> Types:
    """Return the columns of both, with their types.

    Raises:
        StoreError: for a column of two types.
    """
    for name in first.keys() & second.keys():
        if first[name] != second[name]:
            raise StoreError(
                f"column {name}",
                f"{first[name]} and {second[name]}",
                "use one type throughout a sweep",
                "do not go together",
            )
    return {**first, **second}


def table(rows: Sequence[Mapping[str, Any]], types: Types) -> Any:
    """Return rows as an Arrow table."""
    pa = pyarrow()
    fields = {name: getattr(pa, _ARROW[types[name]])() for name in _ordered(types)}
    columns = {
        name: pa.array([_value(row.get(name), types[name]) for row in rows], kind) for name, kind in fields.items()
    }
    return pa.table(columns)


def widened(narrow: Any, types: Types) -> Any:
    """Return a table with the missing columns added, without values."""
    pa = pyarrow()
    for name in types.keys() - set(narrow.column_names):
        narrow = narrow.append_column(name, pa.nulls(len(narrow), getattr(pa, _ARROW[types[name]])()))
    return narrow.select(_ordered(types))


def types_in(stored: Any) -> Types:
    """Return the types of a table's columns; "?" for an unknown type."""
    return {field.name: _NAMES.get(str(field.type), "?") for field in stored.schema}


def encode(episodes: Any) -> bytes:
    """Return a table as the bytes of a file."""
    pa = pyarrow()
    sink = pa.BufferOutputStream()
    with pa.parquet.ParquetWriter(sink, episodes.schema, compression="zstd", store_schema=False) as writer:
        writer.write_table(episodes)
        writer.add_key_value_metadata({_VERSION: str(SCHEMA), _DIGEST: _ZEROS})
    data = sink.getvalue().to_pybytes()
    return _with_digest(data, hashlib.sha256(data).hexdigest().encode())


def decode(data: bytes) -> Any:
    """Return the table of a file; nothing in it is interpreted before its hash has been verified.

    Raises:
        ValueError: if any byte has changed.
    """
    at = _place_of_digest(data)
    if hashlib.sha256(_with_digest(data, _ZEROS)).hexdigest().encode() != data[at : at + len(_ZEROS)]:
        raise ValueError("its hash does not match")
    pa = pyarrow()
    try:
        found = pa.parquet.read_table(pa.BufferReader(data))
    except pa.ArrowException as error:
        raise ValueError(str(error)) from error
    version = (found.schema.metadata or {}).get(_VERSION.encode())
    types = types_in(found)
    if version != str(SCHEMA).encode() or not types.items() >= LABELS.items() or "?" in types.values():
        raise ValueError(f"it does not follow version {SCHEMA} of the schema")
    return found


def _place_of_digest(data: bytes) -> int:
    at = data.rfind(_DIGEST + _STRING) + len(_DIGEST + _STRING)
    if at < len(_DIGEST + _STRING) or at + len(_ZEROS) > len(data):
        raise ValueError("it has no hash")
    return at


def _with_digest(data: bytes, digest: bytes) -> bytes:
    at = _place_of_digest(data)
    return data[:at] + digest + data[at + len(digest) :]


_ARROW = {"text": "string", "number": "float64", "switch": "bool_", "whole": "int64", "seed": "uint64"}
_NAMES = {"string": "text", "double": "number", "bool": "switch", "int64": "whole", "uint64": "seed"}


def _type(name: str, value: Any) -> str:
    if name in LABELS:
        return LABELS[name]
    return "switch" if isinstance(value, bool) else "text" if isinstance(value, str) else "number"


def _value(value: Any, kind: str) -> Any:
    if value is None or value != value:
        return None
    return float(value) if kind == "number" else value


def _ordered(types: Types) -> list[str]:
    return [*LABELS, *sorted(types.keys() - LABELS)]
