"""Named fields of a flat observation or action vector: what policies, documentation and plots go by."""

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
    """A run of numbers with one meaning.

    Attributes:
        unit: in SI, "1" for a pure number.
        low, high: the same bound for each component, finite and physical.
        text: what it is, frame included.
    """

    name: str
    size: int
    unit: str
    low: float
    high: float
    text: str


@dataclasses.dataclass(frozen=True)
class Layout:
    """Fields in the order in which they lie in the vector."""

    fields: tuple[Field, ...]

    @functools.cached_property
    def slices(self) -> dict[str, slice]:
        """Where each field lies in the last axis."""
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
        """Views of all fields of `vector` (..., size) by name."""
        return {name: vector[..., part] for name, part in self.slices.items()}

    def box(self) -> Box:
        """The space with the fields' bounds."""
        low = np.concatenate([np.full(field.size, field.low) for field in self.fields])
        high = np.concatenate([np.full(field.size, field.high) for field in self.fields])
        return Box(low, high, dtype=np.float64)

    def table(self) -> str:
        """The fields as a Markdown table."""
        rows = ["| index | field | unit | from | to | meaning |", "|---|---|---|---|---|---|"]
        for field in self.fields:
            part = self.slices[field.name]
            index = f"{part.start}" if field.size == 1 else f"{part.start}..{part.stop - 1}"
            rows.append(f"| {index} | `{field.name}` | {field.unit} | {field.low:g} | {field.high:g} | {field.text} |")
        return "\n".join(rows)
