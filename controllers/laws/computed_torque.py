"""Computed torque: feedback linearization with a model of the robot, the upper reference for laws without one.

    tau = ID(q, qd, u),   u = qdd_ref + Kd ed + Kp e,   ID = inverse dynamics of the nominal model

Source: Siciliano et al., Robotics (2009), section 8.5.2.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from controllers.laws.namespaces import namespace
from controllers.laws.tracking import Array, Gain, JointInput, check_positive, desired_acceleration, errors, make_plain


@dataclasses.dataclass(frozen=True)
class ComputedTorqueGains:
    """Stiffness (1/s^2) and damping (1/s) of the error dynamics, each a number or one a joint."""

    k_p: Gain
    k_d: Gain

    def __post_init__(self) -> None:
        make_plain(self)
        check_positive("k_p", self.k_p)
        check_positive("k_d", self.k_d)


def computed_torque(
    gains: ComputedTorqueGains, signals: JointInput, inverse_dynamics: Callable[[Array, Array, Array], Array]
) -> Array:
    """One sample of the law at the top; `inverse_dynamics` turns q, qd, qdd (..., n) into torques."""
    u = desired_acceleration(signals, *errors(signals), gains.k_p, gains.k_d, namespace(signals.q))
    return inverse_dynamics(signals.q, signals.qd, u)
