"""Columns of numbers as few bytes, which a browser unpacks in a dozen lines.

Format "motion 1": each column is rounded to whole numbers of its unit. The first row is kept as it is; any other is its
difference from the row before, modulo 2^16 and zigzag (0, -1, 1, -2 become 0, 1, 2, 3), column by column, all low bytes
before all high bytes. As text: zlib, then base64.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artde_gym.arrays import Array

FARTHEST = 2**30  # units: what is farther away, or not finite, is held there


class Packed(NamedTuple):
    """Numbers (samples, columns) as packed.

    Attributes:
        planes: low and high bytes of the differences, (2, columns, samples).
        start: the first row in units (columns,).
        units: of the columns (columns,).
    """

    planes: NDArray[np.uint8]
    start: NDArray[np.int64]
    units: Array

    @classmethod
    def of(cls, columns: ArrayLike, units: ArrayLike) -> Packed:
        """Pack numbers (samples, columns) to half a unit; no column may change by more than 32767 units a sample."""
        columns, units = np.asarray(columns, np.float64), np.asarray(units, np.float64)
        held = np.nan_to_num(columns / units, posinf=FARTHEST, neginf=-FARTHEST)
        whole = np.rint(np.clip(held, -FARTHEST, FARTHEST)).astype(np.int64)
        steps = np.diff(whole, axis=0, prepend=whole[:1]).astype(np.int16).astype(np.int32).T
        zigzag = ((steps << 1) ^ (steps >> 15)).astype(np.uint16)
        return cls(np.stack([zigzag & 255, zigzag >> 8]).astype(np.uint8), whole[0], units)

    def columns(self) -> Array:
        """Unpack the numbers (samples, columns)."""
        low, high = self.planes.astype(np.int64)
        zigzag = low | high << 8
        steps = (zigzag >> 1) ^ -(zigzag & 1)
        return (self.start + np.cumsum(steps, axis=1).T) * self.units

    def text(self) -> dict[str, Any]:
        """Return what a page holds."""
        data = base64.b64encode(zlib.compress(self.planes.tobytes(), 9)).decode()
        return {
            "samples": self.planes.shape[2],
            "start": self.start.tolist(),
            "units": [float(f"{unit:.9g}") for unit in self.units],
            "data": data,
        }
