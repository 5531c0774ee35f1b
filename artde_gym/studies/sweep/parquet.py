"""Episodes as the bytes of one Parquet file that carries the hash of itself.

The schema, version `SCHEMA`, is the same for all files of a sweep. Columns in front: `cell` (hash of all that makes a
cell), `controller`, `env`, `scenario`, `seed`, `episode`. Then, in alphabetical order, what else makes the cell
(`gains.<gain>`, `env_kwargs.<argument>`, `disturbances` as JSON), the columns of `artde_gym.evaluation.metrics` and the
sampled disturbances (`disturbance.payload.mass`, ...). Numbers are float64, but for `seed` (uint64) and `episode`
(int64); lists and mappings are JSON. What an episode has no value for is null, never NaN.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from artde_gym.errors import OptionError, StoreError

SCHEMA = 2
LABELS = {"cell": "text", "controller": "text", "env": "text", "scenario": "text", "seed": "seed", "episode": "whole"}
Types = dict[str, str]
"""Column -> "number", "text" or "switch", or "seed" and "whole" for one of `LABELS` each."""

_VERSION, _DIGEST = "artde_gym.schema", b"artde_gym.sha256"
_ZEROS = b"0" * 64
_STRING = b"\x18\x40"  # how Thrift's compact protocol announces 64 bytes


def pyarrow() -> Any:
    """The module.

    Raises:
        OptionError: if it is not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise OptionError("pyarrow", "not installed", "pip install 'artde-gym[sweep]'") from error
    return pyarrow


def types_of(rows: Iterable[Mapping[str, Any]]) -> Types:
    """What the columns of rows hold; None tells nothing.

    Raises:
        StoreError: for a column of several types.
    """
    types = dict(LABELS)
    for row in rows:
        types = joined(types, {name: _type(name, value) for name, value in row.items() if value is not None})
    return types


def joined(first: Types, second: Types) -> Types:
    """The columns of both.

    Raises:
        StoreError: for a column of two types.
    """
    for name in first.keys() & second.keys():
        if first[name] != second[name]:
            raise StoreError(f"column {name}", f"{first[name]} and {second[name]}", "one type in a whole sweep")
    return {**first, **second}


def table(rows: Sequence[Mapping[str, Any]], types: Types) -> Any:
    """Rows as an Arrow table."""
    pa = pyarrow()
    fields = {name: getattr(pa, _ARROW[types[name]])() for name in _ordered(types)}
    columns = {
        name: pa.array([_value(row.get(name), types[name]) for row in rows], kind) for name, kind in fields.items()
    }
    return pa.table(columns)


def widened(narrow: Any, types: Types) -> Any:
    """A table with the columns it lacks, without values."""
    pa = pyarrow()
    for name in types.keys() - set(narrow.column_names):
        narrow = narrow.append_column(name, pa.nulls(len(narrow), getattr(pa, _ARROW[types[name]])()))
    return narrow.select(_ordered(types))


def types_in(stored: Any) -> Types:
    """What the columns of a table hold; "?" for what no column of ours does."""
    return {field.name: _NAMES.get(str(field.type), "?") for field in stored.schema}


def encode(episodes: Any) -> bytes:
    """A file of a table."""
    pa = pyarrow()
    sink = pa.BufferOutputStream()
    with pa.parquet.ParquetWriter(sink, episodes.schema, compression="zstd", store_schema=False) as writer:
        writer.write_table(episodes)
        writer.add_key_value_metadata({_VERSION: str(SCHEMA), _DIGEST: _ZEROS})
    data = sink.getvalue().to_pybytes()
    return _with_digest(data, hashlib.sha256(data).hexdigest().encode())


def decode(data: bytes) -> Any:
    """The table of a file; nothing in it is interpreted before its hash has been found right.

    Raises:
        ValueError: if a byte is not as it was written.
    """
    at = _place_of_digest(data)
    if hashlib.sha256(_with_digest(data, _ZEROS)).hexdigest().encode() != data[at : at + len(_ZEROS)]:
        raise ValueError("its hash is another one")
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
