"""Geometric control of a load on a cable, on R^3 x S^2: the rival that knows the load's mass.

With the load at x, the cable's direction q from vehicle to load, its length l, the masses m (vehicle) and m_L, and
e = x_ref - x, the vehicle's force is

    A   = xdd_ref + k_v ed + k_x e + i + g e_3,   i += L Ki e     the load's desired acceleration, against gravity
    q_c = -A / |A|                                                where the cable ought to point
    F   = ((m + m_L) A . q + m l |qd|^2) q + m l (k_q q x (q x q_c) + k_w qd)

The first part pulls along the cable, the second one turns it. Derivatives of q_c, which hold the load's jerk, are
taken for zero: from a filter they crash. A position law takes over where no load hangs. The load's reference is the
vehicle's, one cable below.

For small swings the four gains place four poles. For each length they are put where `controllers.laws.swing` has them
at Kp, Kd with w^2 = g / l and its K1, K2:

    k_q = Kp + w^2 + K1,   k_w = Kd + K2,   k_x = Kp w^2 / k_q,   k_v = Kd w^2 / k_q

Source: K. Sreenath, T. Lee, V. Kumar, "Geometric control and differential flatness of a quadrotor UAV with a
cable-suspended load", CDC 2013; the integral and the choice of poles are ours.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

from controllers.laws.namespaces import namespace, root
from controllers.laws.positional_pid import (
    PositionalPidGains,
    PositionalPidState,
    positional_pid,
    positional_pid_init,
)
from controllers.laws.swing import GRAVITY, SHORTEST, Cable, stiffness, swing_gains
from controllers.laws.tracking import Array, JointInput, check_non_negative, check_positive_number, components
from controllers.laws.vectors import Vector, cross, dot, joined, minus, plus, scaled

LIMIT = 2.0  # m/s^2, of each component of the integral


@dataclasses.dataclass(frozen=True)
class LoadGains(PositionalPidGains):
    """Gains of the position law without a load, and of the law at the top.

    Attributes:
        load_mass: m_L (kg).
        vehicle_mass: m (kg).
        load_k_p: Kp (1/s^2).
        load_k_d: Kd (1/s).
        load_k_i: Ki, integral gain of the load's error (1/s^3).
    """

    load_mass: float
    vehicle_mass: float
    load_k_p: float
    load_k_d: float
    load_k_i: float

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in ("load_mass", "vehicle_mass", "load_k_p", "load_k_d"):
            check_positive_number(field, getattr(self, field))
        check_non_negative("load_k_i", self.load_k_i)


class LoadState(NamedTuple):
    """The load's integral (..., 3) (m/s^2), and the memory of the position law."""

    load_integral: Array
    alone: PositionalPidState


def load_start(gains: LoadGains, signals: JointInput) -> LoadState:
    """Memory before the first sample."""
    return LoadState(namespace(signals.q).zeros_like(signals.q), positional_pid_init(gains, signals))


def load_control(
    gains: LoadGains, state: LoadState, signals: JointInput, cable: Cable, period: float
) -> tuple[Array, LoadState]:
    """One sample of the law at the top: F (..., 3) (N), world axes; `signals` are the vehicle's."""
    xp = namespace(signals.q)
    held = cable.held[..., None]
    resting = signals._replace(  # or the integral of the other law would wind up
        q_ref=xp.where(held, signals.q, signals.q_ref), qd_ref=xp.where(held, signals.qd, signals.qd_ref)
    )
    alone, alone_memory = positional_pid(gains, state.alone, resting, period)
    r = components(cable.vector)
    length = xp.maximum(root(dot(r, r), xp), SHORTEST)
    q = scaled(1.0 / length, r)
    rate = components(cable.rate)
    turning = scaled(1.0 / length, minus(rate, scaled(dot(rate, q), q)))

    e, ed, e_vector = _errors(signals, cable, length, xp)
    integral = xp.where(held, xp.clip(state.load_integral + (period * gains.load_k_i) * e_vector, -LIMIT, LIMIT), 0.0)
    square = stiffness(cable, xp)
    k_1, k_2 = swing_gains(gains.load_k_p, gains.load_k_d, square, xp)
    k_q, k_w = gains.load_k_p + square + k_1, gains.load_k_d + k_2
    share = square / k_q
    feedback = plus(scaled(gains.load_k_p * share, e), scaled(gains.load_k_d * share, ed))
    wanted = plus(components(signals.qdd_ref), feedback)
    wanted = plus(wanted, components(integral))
    wanted = (wanted[0], wanted[1], wanted[2] + GRAVITY)
    aim = scaled(-1.0 / xp.sqrt(xp.maximum(dot(wanted, wanted), 1e-6)), wanted)
    inertia = gains.vehicle_mass * length
    along = (gains.vehicle_mass + gains.load_mass) * dot(wanted, q) + inertia * dot(turning, turning)
    turned = plus(scaled(k_q, cross(q, cross(q, aim))), scaled(k_w, turning))
    force = joined(plus(scaled(along, q), scaled(inertia, turned)), xp)
    return xp.where(held, force, alone), LoadState(integral, alone_memory)


def _errors(signals: JointInput, cable: Cable, length: Array, xp: Any) -> tuple[Vector, Vector, Array]:
    """Errors of the load (m, m/s), and the first one as an array."""
    load, speed = signals.q + cable.vector, signals.qd + cable.rate
    below = joined((0.0 * length, 0.0 * length, length), xp)
    e = signals.q_ref - below - load
    return components(e), components(signals.qd_ref - speed), e
