"""Ground effect: a rotor close to the ground has more thrust for the same power.

T / T_free = 1 / (1 - (R / 4 h)^2) = 1 + R^2 / (16 h^2 - R^2)

with the rotor's radius R and its height h above the ground. Source: I. C. Cheeseman and W. E. Bennett, "The effect of
the ground on a helicopter rotor in forward flight", ARC R&M 3021, 1955, in hover and for each rotor separately. It
holds for h >= R / 2; below, the gain is that at R / 2.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from artde_gym.arrays import Array

Number = TypeVar("Number", float, Array)

MIN_HEIGHT_RADII = 0.5  # radii, smallest height


def thrust_gain(height: Number, radius: float, strength: Number, larger: Callable[..., Number]) -> Number:
    """Return 1 + `strength` (T / T_free - 1) of a rotor of `radius` (m) at `height` (m), elementwise.

    `larger` is the maximum function for this type of number.
    """
    height = larger(height, MIN_HEIGHT_RADII * radius)
    return 1.0 + strength * radius * radius / (16.0 * height * height - radius * radius)
