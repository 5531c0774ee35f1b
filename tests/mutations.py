"""Damage for files that we read: random, and such as knows the format and gets further in."""

from __future__ import annotations

import csv
import io
import json
import random
import shutil
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

WEIRD: list[Any] = [
    None, True, -1, 0, 3, 10**30, 1e308, float("nan"), float("inf"), "", "x", "../../outside", "/outside", "a\x00b",
    "<script>alert(1)</script>", [], [[]], [1, "a"], {}, {"": {}}, {"a": [None]}, "S2", "tde", "artde", "-" * 1000,
    "no", [54], 1e9, 0.5,
]  # fmt: skip


class Touch:
    """A pickle that leaves a file behind where it is loaded."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.marker,)


def mutate(folder: Path, rng: random.Random, marker: Path) -> str:
    """Damage one file of a folder; returns which and how."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    if not files:
        return "gone before"
    file = rng.choice(files)
    kinds: list[Callable[[Path, random.Random], Any]] = [_truncated, _flipped, _inserted, _gone, _a_folder, _deep]
    if file.suffix == ".json":
        kinds += [_json] * 12
    if file.suffix == ".yaml":
        kinds += [_yaml] * 12 + [lambda path, rng: _tagged(path, rng, marker)] * 4
    if file.suffix == ".csv":
        kinds += [_cell] * 8 + [_row, _column] * 2
    if file.suffix == ".npz":
        kinds += [lambda path, rng: _arrays(path, rng, marker)] * 6
    kind = rng.choice(kinds)
    try:
        return f"{file.relative_to(folder)}: {getattr(kind, '__name__', '')} {kind(file, rng)}"
    except (ValueError, IndexError, RecursionError, StopIteration, zipfile.BadZipFile, zlib.error, yaml.YAMLError):
        return "damaged before"


def _truncated(file: Path, rng: random.Random) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: rng.randrange(len(content) + 1)])


def _flipped(file: Path, rng: random.Random) -> None:
    content = bytearray(file.read_bytes())
    for _ in range(rng.choice([1, 1, 1, 10])):
        content[rng.randrange(len(content))] = rng.randrange(256)
    file.write_bytes(bytes(content))


def _inserted(file: Path, rng: random.Random) -> None:
    content = file.read_bytes()
    place = rng.randrange(len(content) + 1)
    file.write_bytes(content[:place] + rng.choice([b"\n", b"\x00", b",", b'"', b"{", b"\xff\xfe", b"9" * 5000])
                     + content[place:])  # fmt: skip


def _gone(file: Path, rng: random.Random) -> None:
    file.unlink()


def _a_folder(file: Path, rng: random.Random) -> None:
    file.unlink()
    file.mkdir()


def _deep(file: Path, rng: random.Random) -> None:
    file.write_text("[" * 200_000)


def _json(file: Path, rng: random.Random) -> str:
    content, told = _changed(json.loads(file.read_text()), rng)
    file.write_text(json.dumps(content))
    return told


def _yaml(file: Path, rng: random.Random) -> str:
    content, told = _changed(yaml.safe_load(file.read_text()), rng)
    file.write_text(yaml.safe_dump(content))
    return told


def _tagged(file: Path, rng: random.Random, marker: Path) -> str:
    """A value that leaves a file behind where a loader makes objects of tags, or stands for another place."""
    lines = file.read_text().splitlines()
    number = rng.choice([number for number, line in enumerate(lines) if ":" in line])
    before, colon, _ = lines[number].rpartition(": ")
    value = rng.choice([
        f"!!python/object/apply:pathlib.Path.touch [!!python/object/apply:pathlib.PosixPath [{marker}]]",
        f"!!python/object/apply:os.system ['touch {marker}']", "!!python/name:os.system", "&x [*x]", "{<<: {a: 1}}",
        "!!binary aGk=", "2020-01-01", "!!set {x}", "1:30", "0x10",
    ])  # fmt: skip
    lines[number] = f"{before}{colon}{value}" if colon else f"{lines[number]} {value}"
    file.write_text("\n".join(lines))
    return lines[number]


def _changed(content: Any, rng: random.Random) -> tuple[Any, str]:
    """Plain values with one of them replaced, removed or renamed; and which."""
    root = {"": content}
    places: list[tuple[Any, Any]] = []

    def collect(node: Any) -> None:
        for key, value in list(node.items() if isinstance(node, dict) else enumerate(node)):
            places.append((node, key))
            if isinstance(value, (dict, list)):
                collect(value)

    collect(root)
    node, key = rng.choice(places)
    change = rng.choice(["replace", "replace", "replace", "delete", "rename"])
    told = f"{change} {key!r}"
    if change == "replace":
        node[key] = rng.choice(WEIRD)
        told += f" by {node[key]!r:.40}"
    elif isinstance(node, dict) and node is not root:
        value = node.pop(key)
        if change == "rename":
            node[str(rng.choice(WEIRD))] = value
    return root[""], told


def _table(file: Path) -> list[list[str]]:
    limit = csv.field_size_limit(sys.maxsize)  # a change before this one may have made a cell that long
    try:
        return list(csv.reader(io.StringIO(file.read_text())))
    finally:
        csv.field_size_limit(limit)  # that of the readers under test


def _write(file: Path, rows: list[list[str]]) -> None:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(rows)
    file.write_text(buffer.getvalue())


def _cell(file: Path, rng: random.Random) -> str:
    rows = _table(file)
    row = rng.choice(rows)
    place = rng.randrange(len(row))
    before, row[place] = row[place], str(rng.choice(WEIRD))
    _write(file, rows)
    return f"{before!r} -> {row[place]!r:.40} in column {rows[0][place]!r}"


def _row(file: Path, rng: random.Random) -> None:
    rows = _table(file)
    place = rng.randrange(len(rows))
    rows[place : place + 1] = rng.choice([[], [rows[place]] * 2, [rows[place][:-1]], [[*rows[place], "1"]]])
    _write(file, rows)


def _column(file: Path, rng: random.Random) -> str:
    rows = _table(file)
    place = rng.randrange(len(rows[0]))
    name = rows[0][place]
    for row in rows:
        del row[place]
    _write(file, rows)
    return name


def _arrays(file: Path, rng: random.Random, marker: Path) -> str:
    with np.load(io.BytesIO(file.read_bytes())) as stored:
        arrays = {name: stored[name] for name in stored.files}
    name = rng.choice(sorted(arrays))
    old = arrays.pop(name)
    pickled = np.empty(1, dtype=object)
    pickled[0] = Touch(marker)
    with np.errstate(invalid="ignore"):  # of numbers that a change before this one has damaged
        new = rng.choice([
            None, pickled, old[..., :-1], old[:1] * np.nan, old.astype("U3"), old.astype(np.complex128),
            np.float64(3.0), np.zeros((0, 3)), np.sign(old).astype(np.int8), np.full_like(old, 3e38), old[None], old.T,
        ])  # fmt: skip
    if new is not None:
        arrays[name] = new
    np.savez(file, **arrays)
    return f"{name} {'removed' if new is None else (np.shape(new), getattr(new, 'dtype', None))}"


def copied(source: Path, target: Path) -> Path:
    """A fresh copy of a folder."""
    shutil.rmtree(target, ignore_errors=True)
    return Path(shutil.copytree(source, target))
