"""Sampled disturbances as numbers and arrays alone, as `info` has them.

`disturbance.payload.mass` is a number, `disturbance.payload.position` an array (3,). A kind that takes several entries
has one array a parameter, an item an entry: `disturbance.push.magnitude` (entries,), `disturbance.push.direction`
(entries, 3). A word is its position in `env.unwrapped.words`, by "site" or "joint", or among the words that the grammar
allows; `env.unwrapped.sampled_disturbances` has the words themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from artde_gym.disturbances.kinds import DISTURBANCES, Parameter

Words = Mapping[str, Sequence[str]]
"""Names of a robot's sites and joints, by "site" and "joint"."""


def numeric(sampled: Mapping[str, Any], words: Words) -> dict[str, Any]:
    """Name each number, words being replaced by numbers and lists of entries by arrays."""
    told: dict[str, Any] = {}
    for kind, value in sampled.items():
        entries = value if DISTURBANCES[kind].multiple else (value,)
        for parameter in DISTURBANCES[kind].parameters:
            if not all(parameter.name in entry for entry in entries):
                continue  # one of several of which only one is given
            told[f"disturbance.{kind}.{parameter.name}"] = (
                np.array([number_of(parameter, entry[parameter.name], words) for entry in value])
                if DISTURBANCES[kind].multiple
                else number_of(parameter, value[parameter.name], words)
            )
    return told


def number_of(parameter: Parameter, value: Any, words: Words) -> Any:
    """Return a sampled value as a number or an array; a word is its place among those allowed."""
    if parameter.size == 0:
        known = words[parameter.choices] if isinstance(parameter.choices, str) else parameter.choices
        return list(known).index(value)
    return np.array(value) if parameter.size > 1 else value
