"""Sampled disturbances as numbers and arrays for `info`.

`disturbance.payload.mass` is a number, `disturbance.payload.position` an array (3,). A kind that takes several entries
has one array per parameter with one item per entry: `disturbance.push.magnitude` (entries,),
`disturbance.push.direction` (entries, 3). A word is its index in `env.unwrapped.words`, by "site" or "joint", or among
the words that the grammar allows; `env.unwrapped.sampled_disturbances` has the words themselves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.disturbances.kinds import DISTURBANCES, Parameter

Words = Mapping[str, Sequence[str]]
"""Names of a robot's sites and joints, by "site" and "joint"."""


def numeric(sampled: Mapping[str, Any], words: Words) -> dict[str, Any]:
    """Return named numbers, with indices for words and arrays for lists of entries."""
    rows = numeric_rows([sampled], words)
    return {name: value[0] if value.ndim > 1 else value.item() for name, value in rows.items()}


def numeric_rows(sampled: Sequence[Mapping[str, Any]], words: Words) -> dict[str, NDArray[Any]]:
    """Return the numbers of `numeric` of several samples of the same disturbances, as arrays (samples, ...)."""
    told: dict[str, NDArray[Any]] = {}
    for kind, value in sampled[0].items():
        multiple = DISTURBANCES[kind].multiple
        for parameter in DISTURBANCES[kind].parameters:
            name = parameter.name
            if not all(name in entry for entry in (value if multiple else (value,))):
                continue  # one of the parameters of which only one is given
            told[f"disturbance.{kind}.{name}"] = np.array(
                [[number_of(parameter, entry[name], words) for entry in own[kind]] for own in sampled]
                if multiple
                else [number_of(parameter, own[kind][name], words) for own in sampled]
            )
    return told


def number_of(parameter: Parameter, value: Any, words: Words) -> Any:
    """Return a sampled value as a number or an array; a word is its index among the allowed ones."""
    if parameter.size == 0:
        known = words[parameter.choices] if isinstance(parameter.choices, str) else parameter.choices
        return list(known).index(value)
    return np.array(value) if parameter.size > 1 else value
