"""Geometric control of a load on a cable, on R^3 x S^2: the rival that knows the load's mass.

With the load at x, the cable's direction q from vehicle to load, its length l, the masses m (vehicle) and m_L, and
e = x_ref - x, the vehicle's force is

    A   = xdd_ref + Kd ed + Kp e + i + g e_3,   i += L Ki e     the load's desired acceleration, against gravity
    q_c = -A / |A|                                              where the cable ought to point
    F   = ((m + m_L) A . q + m l |qd|^2) q + m l (w_q^2 q x (q x q_c) + 2 zeta w_q qd)

The first part pulls along the cable, the second one turns it. Derivatives of q_c, which hold the load's jerk, are
taken for zero: from a filter they crash. A position law takes over where no load hangs. The load's reference is the
vehicle's, one cable below.

Source: K. Sreenath, T. Lee, V. Kumar, "Geometric control and differential flatness of a quadrotor UAV with a
cable-suspended load", CDC 2013; the integral is ours.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from controllers.laws.positional_pid import (
    PositionalPidGains,
    PositionalPidMemory,
    positional_pid,
    positional_pid_start,
)
from controllers.laws.swing import GRAVITY, SHORTEST, Cable
from controllers.laws.tracking import Array, Signals, check_non_negative, check_positive_number, components
from controllers.laws.vectors import Vector, cross, dot, joined, minus, plus, scaled

LIMIT = 2.0  # m/s^2, of each component of the integral


@dataclasses.dataclass(frozen=True)
class LoadGains(PositionalPidGains):
    """Gains of the position law without a load, and of the law at the top.

    Attributes:
        load_mass: m_L (kg).
        vehicle_mass: m (kg).
        load_k_p: stiffness of the load's error (1/s^2).
        load_k_d: its damping (1/s).
        load_k_i: its integral gain (1/s^3).
        swing_rate: w_q (rad/s).
        swing_damping: zeta.
    """

    load_mass: float
    vehicle_mass: float
    load_k_p: float
    load_k_d: float
    load_k_i: float
    swing_rate: float
    swing_damping: float

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in ("load_mass", "vehicle_mass", "load_k_p", "load_k_d", "swing_rate", "swing_damping"):
            check_positive_number(field, getattr(self, field))
        check_non_negative("load_k_i", self.load_k_i)


class LoadMemory(NamedTuple):
    """The load's integral (..., 3) (m/s^2), and the memory of the position law."""

    load_integral: Array
    alone: PositionalPidMemory


def load_start(gains: LoadGains, signals: Signals) -> LoadMemory:
    """Memory before the first sample."""
    return LoadMemory(np.zeros_like(signals.q), positional_pid_start(gains, signals))


def load_control(
    gains: LoadGains, memory: LoadMemory, signals: Signals, cable: Cable, period: float
) -> tuple[Array, LoadMemory]:
    """One sample of the law at the top: F (..., 3) (N), world axes; `signals` are the vehicle's."""
    held = cable.held[..., None]
    resting = signals._replace(  # or the integral of the other law would wind up
        q_ref=np.where(held, signals.q, signals.q_ref), qd_ref=np.where(held, signals.qd, signals.qd_ref)
    )
    alone, alone_memory = positional_pid(gains, memory.alone, resting, period)
    r = components(cable.vector)
    length = np.maximum(np.sqrt(dot(r, r)), SHORTEST)
    q = scaled(1.0 / length, r)
    rate = components(cable.rate)
    turning = scaled(1.0 / length, minus(rate, scaled(dot(rate, q), q)))

    e, ed, e_vector = _errors(signals, cable, length)
    integral = np.where(held, np.clip(memory.load_integral + (period * gains.load_k_i) * e_vector, -LIMIT, LIMIT), 0.0)
    wanted = plus(components(signals.qdd_ref), plus(scaled(gains.load_k_p, e), scaled(gains.load_k_d, ed)))
    wanted = plus(wanted, components(integral))
    wanted = (wanted[0], wanted[1], wanted[2] + GRAVITY)
    aim = scaled(-1.0 / np.sqrt(np.maximum(dot(wanted, wanted), 1e-6)), wanted)
    inertia = gains.vehicle_mass * length
    along = (gains.vehicle_mass + gains.load_mass) * dot(wanted, q) + inertia * dot(turning, turning)
    turned = plus(
        scaled(gains.swing_rate**2, cross(q, cross(q, aim))),
        scaled(2.0 * gains.swing_damping * gains.swing_rate, turning),
    )
    force = joined(plus(scaled(along, q), scaled(inertia, turned)))
    return np.where(held, force, alone), LoadMemory(integral, alone_memory)


def _errors(signals: Signals, cable: Cable, length: Array) -> tuple[Vector, Vector, Array]:
    """Errors of the load (m, m/s), and the first one as an array."""
    load, speed = signals.q + cable.vector, signals.qd + cable.rate
    below = joined((0.0 * length, 0.0 * length, length))
    e = signals.q_ref - below - load
    return components(e), components(signals.qd_ref - speed), e
