"""Named fields of a flat observation or action vector, shared by policies, documentation and plots."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from artde_gym.errors import UnknownNameError


@dataclasses.dataclass(frozen=True)
class Field:
    """Consecutive components with one meaning.

    Attributes:
        unit: SI unit, "1" if dimensionless.
        low, high: finite physical bounds: one per component, or one for all.
        text: description, including the frame.
    """

    name: str
    size: int
    unit: str
    low: float | tuple[float, ...]
    high: float | tuple[float, ...]
    text: str


@dataclasses.dataclass(frozen=True)
class Layout:
    """Fields in their order in the vector."""

    fields: tuple[Field, ...]

    @functools.cached_property
    def slices(self) -> dict[str, slice]:
        """Slice of each field along the last axis."""
        stops = np.cumsum([field.size for field in self.fields]).tolist()
        return {field.name: slice(stop - field.size, stop) for field, stop in zip(self.fields, stops, strict=True)}

    @property
    def size(self) -> int:
        return sum(field.size for field in self.fields)

    def __getitem__(self, name: str) -> slice:
        if name not in self.slices:
            raise UnknownNameError("field", name, ", ".join(self.slices))
        return self.slices[name]

    def split(self, vector: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """Return views of all fields of `vector` (..., size) by name."""
        return {name: vector[..., part] for name, part in self.slices.items()}

    def box(self, dtype: type[np.floating[Any]] | np.dtype[Any] = np.float64) -> Box:
        """Return the space with the fields' bounds."""
        low, high = (
            np.concatenate([np.full(field.size, getattr(field, bound), dtype) for field in self.fields])
            for bound in ("low", "high")
        )
        return Box(low, high, dtype=dtype)

    def table(self) -> str:
        """Return the fields as a Markdown table."""
        rows = ["| index | field | unit | from | to | meaning |", "|---|---|---|---|---|---|"]
        for field in self.fields:
            part = self.slices[field.name]
            index = f"{part.start}" if field.size == 1 else f"{part.start}..{part.stop - 1}"
            low, high = _bound(field.low), _bound(field.high)
            rows.append(f"| {index} | `{field.name}` | {field.unit} | {low} | {high} | {field.text} |")
        return "\n".join(rows)


def _bound(values: float | tuple[float, ...]) -> str:
    return ", ".join(f"{value:g}" for value in (values if isinstance(values, tuple) else (values,)))
