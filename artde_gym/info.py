"""The `info` of environments: only numbers and arrays, with the same keys after `reset` and `step`.

| key | value |
|---|---|
| `time_s` | time since the start of the episode (s) |
| `reward_*` | each term of the reward; zeros after `reset` |
| `disturbance.*` | sampled values of the episode, by kind and parameter; see `artde_gym.disturbances.numeric` |
| `push_begins`, `push_ends`, `payload_attached`, `payload_dropped` | number of events in the last control period |
| `fell_*` | true for the one reason why the episode was terminated |

In a vector environment each entry `x` has a mask `_x` (n,), as usual in Gymnasium.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.disturbances.schedule import EVENTS

Mask = NDArray[np.bool_]
Columns = dict[str, NDArray[Any]]
"""Entries of `info`, one value per environment."""

REWARD, FELL = "reward_", "fell_"  # prefixes of names


class EpisodeInfo:
    """The `info` of one environment, with everything constant within an episode prepared once.

    Each `info` is a new dictionary of new arrays, so that callers cannot change each other's.
    """

    def __init__(self, numbers: Mapping[str, Any], reasons: Sequence[str], terms: Iterable[str]) -> None:
        self._rewards = [REWARD + name for name in terms]
        self._names = [FELL + name for name in reasons]
        self._arrays = [(name, value) for name, value in numbers.items() if type(value) is np.ndarray]
        self._still = {"time_s": 0.0, **numbers, **dict.fromkeys(EVENTS, 0), **dict.fromkeys(self._names, False)}

    def told(
        self, time: float, terms: Mapping[str, float], events: Sequence[str] = (), falls: Sequence[bool] = ()
    ) -> dict[str, Any]:
        """Return the `info` of a step from the terms of the reward, the events and which reasons for a fall hold."""
        info = self._still.copy()
        info["time_s"] = time
        for name, term in zip(self._rewards, terms.values(), strict=True):
            info[name] = term
        for name, array in self._arrays:
            info[name] = array.copy()
        for name in events:
            info[name] += 1
        if True in falls:
            info[self._names[falls.index(True)]] = True  # the first one
        return info


def fall_reason(info: Mapping[str, Any], robot: int | None = None) -> str:
    """Return the reason why an episode was terminated, "" if it was not.

    Args:
        info: `info` of a step.
        robot: index of the environment if `info` is from a vector environment.
    """
    for name, held in info.items():
        if name.startswith(FELL) and (held if robot is None else held[robot]):
            return name.removeprefix(FELL)
    return ""


def prefixed(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Prefix each name."""
    return {prefix + name: value for name, value in values.items()}


def masked(values: Mapping[str, Any], mask: Mask) -> dict[str, Any]:
    """Add a mask to each entry; existing masks are combined with it."""
    told: dict[str, Any] = {}
    for name, value in values.items():
        if name[:1] != "_":
            known = "_" + name
            told[name] = value
            told[known] = values[known] & mask if known in values else mask
    return told


def cleared(values: Mapping[str, NDArray[Any]], where: Mask) -> Columns:
    """Zero arrays (n,) in some environments; the arrays are new if there are any such environments."""
    if not where.any():
        return dict(values)
    return {name: np.where(where, np.zeros((), value.dtype), value) for name, value in values.items()}


class SampledTable:
    """The values sampled for each of `n` environments, as arrays with masks.

    Lists of different lengths are padded with zeros.
    """

    def __init__(self, n: int) -> None:
        self._n = n
        self._columns: Columns = {}
        self._known: dict[str, Mask] = {}
        self._told: list[tuple[str, NDArray[Any], Mask | None]] = []  # mask None: all environments have the entry

    def enter(self, rows: NDArray[np.intp], values: Mapping[str, NDArray[Any]]) -> None:
        """Replace the values of some environments; each array has one item for each of them."""
        for name, known in self._known.items():
            known[rows] = name in values
        for name, cells in values.items():
            self._known.setdefault(name, np.zeros(self._n, np.bool_))[rows] = True
            column = self._columns[name] = self._fitted(self._columns.get(name), cells[0])
            column[rows] = 0
            column[(rows, *map(slice, cells.shape[1:]))] = cells
        self._told = [
            (name, self._columns[name], None if known.all() else known)
            for name, known in self._known.items()
            if known.any()
        ]

    def told(self) -> dict[str, Any]:
        """Return all values as new arrays for `masked`, which makes new masks."""
        told: dict[str, Any] = {}
        for name, column, known in self._told:
            told[name] = column.copy()
            if known is not None:
                told[f"_{name}"] = known
        return told

    def _fitted(self, column: NDArray[Any] | None, cell: NDArray[Any]) -> NDArray[Any]:
        """Return the column, enlarged to fit a cell."""
        if column is None:
            return np.zeros((self._n, *cell.shape), cell.dtype)
        wider = [(0, 0), *((0, max(0, new - old)) for old, new in zip(column.shape[1:], cell.shape, strict=True))]
        return np.pad(column, wider) if any(after for _, after in wider) else column
