"""Attitude control of a rigid body with known inertia, on SO(3).

    tau = J u + w x J w,   u = qdd_ref + Kd e_w + Kp e_q

With the feedforward of `controllers.laws.cascade` in qdd_ref this is the attitude part of Lee, Leok, McClamroch,
"Geometric tracking control of a quadrotor UAV on SE(3)" (2010), equation 16, with k_R = J Kp and k_Omega = J Kd.
"""

from __future__ import annotations

import dataclasses

from controllers.laws.computed_torque import ComputedTorqueGains, computed_torque
from controllers.laws.namespaces import namespace
from controllers.laws.tracking import Array, Gain, JointInput, check_positive, components, times
from controllers.laws.vectors import cross, joined


@dataclasses.dataclass(frozen=True)
class RigidAttitudeGains(ComputedTorqueGains):
    """Stiffness (1/s^2), damping (1/s) and moments of inertia (kg m^2), each a number or one an axis."""

    inertia: Gain

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive("inertia", self.inertia)


def rigid_attitude(gains: RigidAttitudeGains, signals: JointInput) -> Array:
    """One sample of the law at the top."""
    xp = namespace(signals.q)

    def inverse_dynamics(_q: Array, qd: Array, qdd: Array) -> Array:
        gyroscopic = cross(components(qd), components(times(gains.inertia, qd, xp)))
        return times(gains.inertia, qdd, xp) + joined(gyroscopic, xp)

    return computed_torque(gains, signals, inverse_dynamics)
