"""Factors: the quantities in which plausible worlds differ, and a space-filling sample of them."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import scipy  # its `stats`, half a second, is imported when it is first used: not by workers

from artde_gym.arrays import Array
from artde_gym.errors import OptionError, suggest_names
from artde_gym.studies.sweep.design import check_distribution, check_path, is_number

DISTRIBUTIONS = ("uniform", "log_uniform", "quantiles", "choice")
KEYS = (*DISTRIBUTIONS, "path", "source", "unit")
BITS = 64  # of a sample
OWN = {
    "controller": "all controllers meet every world: list them under 'controllers'",
    "seed": "each world has its own, which the design's 'seed' determines",
}
"""Settings that no factor sets, and why."""


@dataclasses.dataclass(frozen=True)
class Factor:
    """One quantity that differs from world to world.

    Attributes:
        name: in tables and figures.
        paths: of the settings that it sets, as in a sweep; all of them get the same value.
        kind: one of `DISTRIBUTIONS`; "quantiles" are values between which lie equal shares of the worlds.
        arguments: of the distribution.
        source: where the range comes from.
        unit: of the values; empty for none.
    """

    name: str
    paths: tuple[str, ...]
    kind: str
    arguments: tuple[Any, ...]
    source: str
    unit: str = ""

    @classmethod
    def of(cls, name: str, given: Any) -> Factor:
        """Read a factor of a design.

        Raises:
            OptionError, UnknownNameError: for a key, a path or a distribution that is wrong, or without a source.
        """
        field = f"factor {name!r}"
        if not isinstance(given, Mapping):
            raise OptionError(field, given, f"a mapping with the keys {', '.join(KEYS)}")
        for key in given:
            if key not in KEYS:
                raise OptionError(f"key of {field}", key, suggest_names(key, KEYS))
        kinds = [kind for kind in DISTRIBUTIONS if kind in given]
        if len(kinds) != 1:
            raise OptionError(field, kinds, f"exactly one of {', '.join(DISTRIBUTIONS)}")
        source, unit = given.get("source"), given.get("unit", "")
        if not (isinstance(source, str) and source.strip()):
            raise OptionError(f"source of {field}", source, "a sentence that says where the range comes from")
        if not isinstance(unit, str):
            raise OptionError(f"unit of {field}", unit, "a word")
        (kind,) = kinds
        _check_values(field, kind, given[kind])
        return cls(name, _paths(field, given.get("path")), kind, tuple(given[kind]), source, unit)

    @property
    def label(self) -> str:
        """The name with its unit."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    @property
    def ends(self) -> tuple[Any, ...]:
        """The lowest and the highest value, or all choices."""
        return self.arguments if self.kind == "choice" else (self.arguments[0], self.arguments[-1])

    def value(self, share: float) -> Any:
        """Return the value below which lies this share of the worlds, from 0 to 1."""
        if self.kind == "choice":
            return self.arguments[min(int(share * len(self.arguments)), len(self.arguments) - 1)]
        if self.kind == "quantiles":
            return float(np.interp(share, np.linspace(0.0, 1.0, len(self.arguments)), self.arguments))
        low, high = self.arguments
        if self.kind == "uniform":
            return low + share * (high - low)
        return min(max(math.exp(math.log(low) + share * math.log(high / low)), low), high)

    @property
    def categories(self) -> tuple[str, ...]:
        """Choices that are no numbers, as text, in their order; empty for numbers."""
        if self.kind != "choice" or all(map(is_number, self.arguments)):
            return ()
        return tuple(dict.fromkeys(map(_text, self.arguments)))

    def numbers(self, values: Sequence[Any]) -> Array:
        """Return values as numbers: what is no number by its place among the categories."""
        known = self.categories
        return np.array([known.index(_text(value)) for value in values] if known else values, dtype=np.float64)

    def stored(self, value: Any) -> Any:
        """Return a value as a column of a table holds it: of choices of several types, or with parts, the text."""
        plain = all(isinstance(one, (str, type(None))) for one in self.arguments)
        plain = plain or all(isinstance(one, (bool, type(None))) for one in self.arguments)
        plain = plain or all(one is None or is_number(one) for one in self.arguments)
        return value if plain else _text(value)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, sort_keys=True)


def sample(factors: Sequence[Factor], count: int, seed: int) -> list[dict[str, Any]]:
    """Return the factors' values in so many worlds, spread evenly: a scrambled Sobol sequence of 64 bits.

    More worlds leave those before them as they were.
    """
    engine = scipy.stats.qmc.Sobol(len(factors), scramble=True, bits=BITS, rng=np.random.default_rng(seed))
    points = engine.random_base2((count - 1).bit_length())[:count]
    return [
        {factor.name: factor.value(share) for factor, share in zip(factors, point, strict=True)}
        for point in points.tolist()
    ]


def _paths(field: str, given: Any) -> tuple[str, ...]:
    paths = [given] if isinstance(given, str) else given
    if not (isinstance(paths, list) and paths and all(isinstance(path, str) for path in paths)):
        raise OptionError(f"path of {field}", given, "a path of a setting, or a list of some")
    for path in paths:
        check_world_path(f"path of {field}", path)
    return tuple(paths)


def check_world_path(field: str, path: str) -> None:
    """Refuse what is no path to a setting, or to one that a world does not have.

    Raises:
        OptionError, UnknownNameError: in these cases.
    """
    check_path(path)
    if path in OWN:
        raise OptionError(field, path, f"choose another path; {OWN[path]}", "is not a setting of a world")


def _check_values(field: str, kind: str, values: Any) -> None:
    if kind != "quantiles":
        check_distribution(field, {kind: values})
        return
    good = isinstance(values, list) and len(values) >= 2 and all(map(is_number, values))
    if not (good and values == sorted(values)):
        raise OptionError(f"{field}.{kind}", values, "two numbers or more, in ascending order")
