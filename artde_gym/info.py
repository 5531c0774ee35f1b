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


class EpisodeInfo:
    """The `info` of one environment: what does not change within an episode is prepared once.

    Each `info` is a new dictionary of new arrays, so that no caller can reach another one.
    """

    def __init__(self, numbers: Mapping[str, Any], reasons: Sequence[str]) -> None:
        self._names = [FELL + name for name in reasons]
        self._arrays = [(name, value) for name, value in numbers.items() if type(value) is np.ndarray]
        self._still = {"time_s": 0.0, **numbers, **dict.fromkeys(EVENTS, 0), **dict.fromkeys(self._names, False)}

    def told(
        self, time: float, terms: Mapping[str, float], events: Sequence[str] = (), falls: Sequence[bool] = ()
    ) -> dict[str, Any]:
        """Tell of a step: terms of the reward, what began or ended, and which reasons of a fall hold."""
        info = self._still.copy()
        info["time_s"] = time
        for name, term in terms.items():
            info[REWARD + name] = term
        for name, array in self._arrays:
            info[name] = array.copy()
        for name in events:
            info[name] += 1
        if True in falls:
            info[self._names[falls.index(True)]] = True  # the first one
        return info


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


def masked(values: Mapping[str, Any], mask: Mask) -> dict[str, Any]:
    """Put a mask beside each entry; masks that are there become narrower."""
    told: dict[str, Any] = {}
    for name, value in values.items():
        if name[:1] != "_":
            known = "_" + name
            told[name] = value
            told[known] = values[known] & mask if known in values else mask
    return told


def cleared(values: Mapping[str, NDArray[Any]], where: Mask) -> Columns:
    """Put zeros into arrays (n,) in some environments; new arrays, if there are any."""
    if not where.any():
        return dict(values)
    return {name: np.where(where, np.zeros((), value.dtype), value) for name, value in values.items()}


class SampledTable:
    """What was sampled for each of `n` environments, as arrays with masks.

    Lists of different lengths, as different disturbances in one vector may have, are filled up with zeros.
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self._columns: Columns = {}
        self._known: dict[str, Mask] = {}
        self._told: list[tuple[str, NDArray[Any], Mask | None]] = []  # mask: None where all have the entry

    def enter(self, rows: Mapping[int, Mapping[str, Any]]) -> None:
        """Replace what some environments had."""
        for row, numbers in rows.items():
            self._enter(row, numbers)
        self._told = [
            (name, self._columns[name], None if known.all() else known)
            for name, known in self._known.items()
            if known.any()
        ]

    def told(self) -> dict[str, Any]:
        """All that is known, as new arrays, for `masked`, which makes new masks."""
        told: dict[str, Any] = {}
        for name, column, known in self._told:
            told[name] = column.copy()
            if known is not None:
                told[f"_{name}"] = known
        return told

    def _enter(self, row: int, numbers: Mapping[str, Any]) -> None:
        for name, known in self._known.items():
            known[row] = name in numbers
        for name, value in numbers.items():
            self._known.setdefault(name, np.zeros(self._n, np.bool_))[row] = True
            cell = np.asarray(value)
            column = self._columns[name] = self._fitted(self._columns.get(name), cell)
            column[row] = 0
            column[(row, *map(slice, cell.shape))] = cell

    def _fitted(self, column: NDArray[Any] | None, cell: NDArray[Any]) -> NDArray[Any]:
        """The column, with room for a cell."""
        if column is None:
            return np.zeros((self._n, *cell.shape), cell.dtype)
        wider = [(0, 0), *((0, max(0, new - old)) for old, new in zip(column.shape[1:], cell.shape, strict=True))]
        return np.pad(column, wider) if any(after for _, after in wider) else column
