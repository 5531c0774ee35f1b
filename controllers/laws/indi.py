"""Incremental nonlinear dynamic inversion (INDI): an increment on the force that acted, both ends equally filtered.

    tau = tau_f + m_bar (u - a_f),   u = qdd_ref + Kd ed + Kp e
    a_f, tau_f = H(s) a, H(s) tau_applied,   H(s) = w^2 / (s^2 + 2 zeta w s + w^2)

a = dqd/L is the measured acceleration, tau_applied the actuators' state over the same interval. Without the filter, and
with the nominal inertia in the place of a true one, this is time-delay estimation. Source: Smeur, Chu, de Croon,
"Adaptive incremental nonlinear dynamic inversion for attitude control of micro air vehicles" (2016), and "Cascaded
incremental nonlinear dynamic inversion for MAV disturbance rejection" (2018) for the position loop.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

from controllers.laws.namespaces import namespace
from controllers.laws.second_order import FilterState, check_filter, second_order
from controllers.laws.tde import TdeGains, inertia_times
from controllers.laws.tracking import Array, JointInput, desired_acceleration, errors


@dataclasses.dataclass(frozen=True)
class IndiGains(TdeGains):
    """Gains of the law: m_bar is the control effectiveness' inverse, k_p and k_d as for TDE.

    Attributes:
        filter_rate: natural frequency w of the filter (rad/s).
        filter_damping: its zeta, above 0 up to 1.
    """

    filter_rate: float
    filter_damping: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_filter(self.filter_rate, self.filter_damping)


class IndiState(NamedTuple):
    """Velocity of the sample before (..., n), and the filters of acceleration and force."""

    qd: Array
    acceleration: FilterState
    force: FilterState


def indi_init(signals: JointInput, period: float) -> IndiState:
    """Memory before the first sample: as if the reference acceleration and the force had been there for long."""
    rest = namespace(signals.qd).zeros_like(signals.qd)
    return IndiState(
        signals.qd - period * signals.qdd_ref,
        FilterState(signals.qdd_ref, rest),
        FilterState(signals.tau_applied, rest),
    )


def indi(gains: IndiGains, state: IndiState, signals: JointInput, period: float) -> tuple[Array, IndiState]:
    """One sample of the law at the top."""
    xp = namespace(signals.q)
    a = (signals.qd - state.qd) / period
    shape = gains.filter_rate, gains.filter_damping, period
    acceleration = second_order(state.acceleration, a, *shape)
    force = second_order(state.force, signals.tau_applied, *shape)
    u = desired_acceleration(signals, *errors(signals), gains.k_p, gains.k_d, xp)
    tau = force.value + inertia_times(gains.m_bar, u - acceleration.value, xp)
    return tau, IndiState(signals.qd, acceleration, force)
