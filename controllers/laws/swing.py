"""A swing term, which a vehicle's position law adds to its desired acceleration to damp a load on a cable.

A vehicle that tracks its path perfectly leaves the load an undamped pendulum. With the cable r from hook to load,
rho = (r_x, r_y), w^2 = g / |r|, and the lean that the reference itself asks for taken off,

    e_rho = rho + a_ref / w^2,   ed_rho = rhod + j_ref / w^2
    du    = K1 e_rho + K2 ed_rho            horizontally, while the load hangs

gives a law with the error dynamics edd + Kd ed + Kp e = -du, above a load rhodd + w^2 rho = -a, the polynomial

    s^4 + (Kd + K2) s^3 + (Kp + w^2 + K1) s^2 + Kd w^2 s + Kp w^2

K1 and K2 make it the double pair (s^2 + 2 zeta W s + W^2)^2, whose two lower coefficients are what they are anyway:

    W = (Kp w^2)^(1/4),   zeta = Kd w^2 / (4 W^3),   K1 = 2 W^2 + 4 zeta^2 W^2 - Kp - w^2,   K2 = 4 zeta W - Kd

It needs neither the load's mass nor the cable's length: |r| is measured. In `controllers.laws.cascade` it is part of
the reference acceleration, so that any law of the position has it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.laws.namespaces import namespace, root
from controllers.laws.tracking import Array, Gain, components
from controllers.laws.vectors import dot, joined

GRAVITY = 9.81  # m/s^2
SHORTEST = 0.05  # m, of a cable that is believed


class Cable(NamedTuple):
    """A cable as it is measured.

    Attributes:
        vector: r, from the hook to the load (..., 3) (m), world axes.
        rate: its derivative (..., 3) (m/s).
        held: whether a load hangs on it (...).
    """

    vector: Array
    rate: Array
    held: NDArray[np.bool_]


def stiffness(cable: Cable, xp: Any = np) -> Array:
    """w^2 = g / |r| of a pendulum as long as the cable (...) (1/s^2)."""
    r = components(cable.vector)
    return GRAVITY / xp.maximum(root(dot(r, r), xp), SHORTEST)


def swing_gains(k_p: float | Array, k_d: float | Array, stiffness: Array, xp: Any = np) -> tuple[Array, Array]:
    """K1 (1/s^2) and K2 (1/s) at the top, for a w^2 (...)."""
    square = xp.sqrt(k_p * stiffness)  # W^2
    frequency = xp.sqrt(square)
    damping = (0.25 * k_d) * stiffness / (square * frequency)
    return (2.0 + 4.0 * damping * damping) * square - k_p - stiffness, 4.0 * damping * frequency - k_d


def swing_term(k_p: Gain, k_d: Gain, cable: Cable, acceleration_ref: Array, jerk_ref: Array) -> Array:
    """du at the top (..., 3) (m/s^2), for the gains of a position law and its reference (..., 3)."""
    xp = namespace(cable.vector)
    square = stiffness(cable, xp)
    acceleration, jerk = components(acceleration_ref), components(jerk_ref)
    r, rate = components(cable.vector), components(cable.rate)
    terms: list[Array] = []
    for axis in range(2):
        k_1, k_2 = swing_gains(_of(k_p, axis, square, xp), _of(k_d, axis, square, xp), square, xp)
        term = k_1 * (r[axis] + acceleration[axis] / square) + k_2 * (rate[axis] + jerk[axis] / square)
        terms.append(xp.where(cable.held, term, 0.0 * term))
    return joined((terms[0], terms[1], 0.0 * terms[0]), xp)


def _of(gain: Gain, axis: int, like: Array, xp: Any) -> Any:
    """Return the gain of an axis, in the precision of `like`."""
    if isinstance(gain, (int, float)):
        return gain
    if isinstance(gain, (tuple, list)):
        return gain[axis]
    values = xp.asarray(gain, dtype=like.dtype)  # (), (n,), or (..., 1) and (..., n) with a row for each of a batch
    return values if values.ndim == 0 else values[..., min(axis, values.shape[-1] - 1)]
