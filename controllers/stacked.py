"""Gains of several policies in one: a row of observations each, computed at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from controllers.laws.array_gains import with_arrays
from controllers.laws.tde import TdeGains

RATES = ("gamma_0", "gamma_1")
"""Gains that laws multiply with one number a row."""
FEEDBACK = ("k_p", "k_d")
"""Gains that plain TDE multiplies with vectors, and does nothing else with."""


def stacked_gains(gains: Sequence[Any]) -> Any | None:
    """Return gains of one kind as one, in which those that differ are arrays with a row each.

    A law that takes them computes for every row what it would with the gains of that row alone, to the last bit.
    None where gains differ that a law may not take so.
    """
    first = gains[0]
    if any(type(one) is not type(first) for one in gains):
        return None
    changed: dict[str, Any] = {}
    for field in dataclasses.fields(first):
        values: list[Any] = [getattr(one, field.name) for one in gains]
        if all(value == values[0] for value in values):
            continue
        value = _stacked(first, field.name, values)
        if value is None:
            return None
        changed[field.name] = value
    return with_arrays(first, **changed)  # each of the gains has been checked


def _stacked(gains: Any, name: str, values: Sequence[Any]) -> Any | None:
    if dataclasses.is_dataclass(values[0]):
        return stacked_gains(values)
    if not all(isinstance(value, (int, float)) for value in values):
        return None
    if name in RATES:
        return np.array(values, dtype=np.float64)
    if name in FEEDBACK and type(gains) is TdeGains:
        return np.array(values, dtype=np.float64)[:, None]
    return None
