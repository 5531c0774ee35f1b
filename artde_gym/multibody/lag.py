"""First-order lag, discretized exactly."""

from __future__ import annotations

import math
from typing import TypeVar

from artde_gym.arrays import Array

Number = TypeVar("Number", float, Array)


def lag_shares(time_constant: float, duration: float) -> tuple[float, float]:
    """Return the share of the gap to a constant target that is closed after `duration` (s), and its mean until then.

    x(t) = target - (target - x_0) exp(-t / T); both are 1 without a lag, T = 0.
    """
    if time_constant <= 0:
        return 1.0, 1.0
    end = -math.expm1(-duration / time_constant)
    return end, 1.0 - end * time_constant / duration


def follow(value: Number, target: Number, end: float | Number, mean: float | Number) -> tuple[Number, Number]:
    """Return the final and the mean value of an interval with the shares `end` and `mean`; elementwise."""
    gap = target - value
    return value + end * gap, value + mean * gap
