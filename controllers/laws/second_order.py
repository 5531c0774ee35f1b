"""A second-order low-pass, exact for an input that is held over each sampling period.

    x.. = w^2 (u - x) - 2 zeta w x.

A critically damped one (zeta = 1) never overshoots: its output is a weighted mean of past inputs, so that it stays in
any convex set in which they lie.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

from controllers.laws.errors import GainError
from controllers.laws.tracking import Array, check_positive_number, is_finite


class FilterState(NamedTuple):
    """Output x and its rate x., each (...)."""

    value: Array
    rate: Array


def second_order(state: FilterState, u: Array, natural: float, damping: float, period: float) -> FilterState:
    """Output and rate one `period` (s) later, under the input `u` (...).

    Args:
        state: output and rate now.
        u: input.
        natural: w (rad/s), above zero.
        damping: zeta, above 0 up to 1.
        period: s.
    """
    (stay, carry), (pull, slow) = _transition(natural, damping, period)
    gap = state.value - u
    return FilterState(u + (stay * gap + carry * state.rate), pull * gap + slow * state.rate)


def check_filter(natural: float, damping: float) -> None:
    """Raise GainError for a filter that is none."""
    check_positive_number("filter_rate", natural)
    if not (is_finite(damping) and 0 < damping <= 1):
        raise GainError("filter_damping", damping, "a number above 0 up to 1")


@functools.lru_cache(maxsize=64)
def _transition(natural: float, damping: float, period: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """exp([[0, 1], [-w^2, -2 zeta w]] L), which moves (x - u, x.) by one period."""
    pole = damping * natural
    ringing = natural * math.sqrt(1 - damping * damping)
    decay = math.exp(-pole * period)
    # cos and sin(rt)/r of the ringing; its limit is t
    cos, sin = (math.cos(ringing * period), math.sin(ringing * period) / ringing) if ringing else (1.0, period)
    return (
        (decay * (cos + pole * sin), decay * sin),
        (-decay * natural * natural * sin, decay * (cos - pole * sin)),
    )
