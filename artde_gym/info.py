"""The `info` of environments: numbers and arrays alone, with the same keys after `reset` and after `step`.

| key | value |
|---|---|
| `time_s` | time since the start of the episode (s) |
| `reward_*` | each term of the reward; zeros after `reset` |
| `disturbance.*` | what was sampled for the episode, by kind and parameter; see `artde_gym.disturbances.numeric` |
| `push_begins`, `push_ends`, `payload_attached`, `payload_dropped` | how often it happened in the last control period |
| `fell_*` | true for the one reason for which the episode was terminated |

In a vector environment each entry `x` has a mask `_x` (n,) beside it, as Gymnasium has it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.disturbances.schedule import EVENTS

Mask = NDArray[np.bool_]
Columns = dict[str, NDArray[Any]]
"""Entries of `info`, one value an environment."""

REWARD, FELL = "reward_", "fell_"  # in front of names


def count_events(events: Sequence[str]) -> dict[str, int]:
    """Count each kind of event."""
    counts: dict[str, int] = dict.fromkeys(EVENTS, 0)
    for name in events:
        counts[name] += 1
    return counts


def flag_reason(names: Sequence[str], holds: Sequence[bool]) -> dict[str, bool]:
    """Mark the first reason that holds; none does at the start of an episode, where `holds` is empty."""
    flags = dict.fromkeys([FELL + name for name in names], False)
    if any(holds):
        flags[FELL + names[list(holds).index(True)]] = True
    return flags


def fall_reason(info: Mapping[str, Any], robot: int | None = None) -> str:
    """Name the reason for which an episode was terminated, "" if it was not.

    Args:
        info: of a step.
        robot: number of the environment, where `info` is a vector environment's.
    """
    for name, held in info.items():
        if name.startswith(FELL) and (held if robot is None else held[robot]):
            return name.removeprefix(FELL)
    return ""


def prefixed(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Put a prefix before each name."""
    return {prefix + name: value for name, value in values.items()}


def copied(values: Mapping[str, Any]) -> dict[str, Any]:
    """Copy a dictionary and the arrays in it."""
    return {name: value.copy() if type(value) is np.ndarray else value for name, value in values.items()}


def masked(values: Mapping[str, Any], mask: Mask) -> dict[str, Any]:
    """Put a mask beside each entry; masks that are there become narrower."""
    told: dict[str, Any] = {}
    for name, value in values.items():
        if not name.startswith("_"):
            told[name], told[f"_{name}"] = value, values[f"_{name}"] & mask if f"_{name}" in values else mask
    return told


def cleared(values: Mapping[str, NDArray[Any]], where: Mask) -> Columns:
    """Copy arrays (n,), with zeros in some environments."""
    return {name: np.where(where, np.zeros((), value.dtype), value) for name, value in values.items()}


class SampledTable:
    """What was sampled for each of `n` environments, as arrays with masks.

    Lists of different lengths, as different disturbances in one vector may have, are filled up with zeros.
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self._columns: Columns = {}
        self._known: dict[str, Mask] = {}

    def enter(self, row: int, numbers: Mapping[str, Any]) -> None:
        """Replace what one environment had."""
        for name, known in self._known.items():
            known[row] = name in numbers
        for name, value in numbers.items():
            self._known.setdefault(name, np.zeros(self._n, np.bool_))[row] = True
            cell = np.asarray(value)
            column = self._columns[name] = self._fitted(self._columns.get(name), cell)
            column[row] = 0
            column[(row, *map(slice, cell.shape))] = cell

    def told(self) -> dict[str, Any]:
        """All that is known, as new arrays, for `masked`, which makes new masks."""
        told: dict[str, Any] = {}
        for name, known in self._known.items():
            if known.any():
                told[name], told[f"_{name}"] = self._columns[name].copy(), known
        return told

    def _fitted(self, column: NDArray[Any] | None, cell: NDArray[Any]) -> NDArray[Any]:
        """The column, with room for a cell."""
        if column is None:
            return np.zeros((self._n, *cell.shape), cell.dtype)
        wider = [(0, 0), *((0, max(0, new - old)) for old, new in zip(column.shape[1:], cell.shape, strict=True))]
        return np.pad(column, wider) if any(after for _, after in wider) else column
