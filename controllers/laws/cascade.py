"""The cascade of a quadrotor: a law for its position asks for a force, a law for its attitude turns the thrust there.

One sample, at position p, velocity v, rotation R (body to world) and body rates w, after [u1, u2, u3, u4] have acted on
average since the sample before:

    tau_p,applied = 1/2 (R_k-1 + R_k) e3 u1            the mean force on p, world axes
    tau_q,applied = [u2, u3, u4]                       the mean torque, body axes
    tau_p = position law(p, v, references, tau_p,applied), kept within reach of the rotors
    f, f. = a critically damped low-pass of tau_p, which gives the attitude R_d and rates w_d to be flown
    tau_q = attitude law(e_q, e_w, feedforward, tau_q,applied)
    u1    = tau_p^T R e3

The attitude law sees q = -e_q, q_ref = 0, qd = w, qd_ref = R^T R_d w_d, so that e = e_q and ed = e_w, and the
acceleration qdd_ref = R^T R_d alpha_d - w x (R^T R_d w_d) that keeps both where they are. So any law of
`controllers.laws` on `JointInput` serves in either loop. alpha_d = (w_d,k+1 - w_d,k) / L is the mean over the coming
period; the filter's pointwise acceleration, which jumps with its input, crashes at the thesis' gains. (The yaw's own
acceleration is in no observation and taken for zero.)

Two variants of Dantu 2023, which fly into the ground, are there to be looked at: `remembered_force="commanded"` takes
the *commanded* tau_p for the force of one sample ago ((tau_p)_L in its equation 3.6), although the attitude had not got
there yet; `attitude_error="printed"` uses its e_q and e_q., actual minus desired, in a law that expects the opposite.

Sources: Dantu 2023, sections 3.3.2 and 3.3.3; Mellinger, Kumar (2011); Lee, Leok, McClamroch (2010).
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Literal, NamedTuple

from controllers.laws.attitude import attitude_error, desired_axes, desired_rates, heading
from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace, root
from controllers.laws.second_order import FilterState, second_order
from controllers.laws.tracking import (
    Array,
    JointInput,
    Law,
    check_positive_number,
    components,
    is_finite,
    times,
)
from controllers.laws.vectors import (
    Axes,
    Vector,
    cross,
    dot,
    joined,
    minus,
    plus,
    scaled,
    to_body,
    to_world,
)


class QuadrotorInput(NamedTuple):
    """One sample of a quadrotor.

    Attributes:
        position, velocity: (..., 3) in m and m/s, world axes.
        axes: the body's axes in world axes, columns of R.
        rates: w (..., 3) (rad/s), body axes.
        position_ref, velocity_ref, acceleration_ref, jerk_ref: (..., 3), world axes.
        yaw_ref, yaw_rate_ref: (...) in rad and rad/s.
        thrust_applied: u1 (...) (N), mean over the period before.
        torque_applied: [u2, u3, u4] (..., 3) (Nm), mean over the period before.
        turning_ref: added to the attitude's reference acceleration (..., 3) (rad/s^2), body axes; None for nothing.
    """

    position: Array
    velocity: Array
    axes: Axes
    rates: Array
    position_ref: Array
    velocity_ref: Array
    acceleration_ref: Array
    jerk_ref: Array
    yaw_ref: Array
    yaw_rate_ref: Array
    thrust_applied: Array
    torque_applied: Array
    turning_ref: Array | None = None


@dataclasses.dataclass(frozen=True)
class CascadeGains:
    """Gains of both laws, and what lies between them.

    Attributes:
        position: of the position law.
        attitude: of the attitude law.
        command_rate: natural frequency of the low-pass on tau_p (rad/s).
        tilt_max_deg: largest angle between tau_p and the vertical, below 90.
        lift_min, lift_max: smallest and largest vertical component of tau_p (N), both above zero: the thrust points
            upward in this domain, and R_d is always defined.
        command: what R_d, w_d and alpha_d follow: "filtered", the low-pass; "reference", tau_p itself, at rates from
            the reference's jerk.
        remembered_force: "applied", or "commanded" as a demonstration.
        attitude_error: "desired" minus actual, or as "printed" as a demonstration.
    """

    position: Any
    attitude: Any
    command_rate: float
    tilt_max_deg: float
    lift_min: float
    lift_max: float
    command: Literal["filtered", "reference"] = "filtered"
    remembered_force: Literal["applied", "commanded"] = "applied"
    attitude_error: Literal["desired", "printed"] = "desired"

    def __post_init__(self) -> None:
        for field in ("command_rate", "lift_min"):
            check_positive_number(field, getattr(self, field))
        if not (is_finite(self.tilt_max_deg) and 0 < self.tilt_max_deg < 90):
            raise GainError("tilt_max_deg", self.tilt_max_deg, "an angle above 0 and below 90 deg")
        if not (is_finite(self.lift_max) and self.lift_max >= self.lift_min):
            raise GainError("lift_max", self.lift_max, f"a finite number >= lift_min = {self.lift_min:g}")
        if self.command not in ("filtered", "reference"):
            raise GainError("command", self.command, "'filtered', 'reference'")
        if self.remembered_force not in ("applied", "commanded"):
            raise GainError("remembered_force", self.remembered_force, "'applied', 'commanded'")
        if self.attitude_error not in ("desired", "printed"):
            raise GainError("attitude_error", self.attitude_error, "'desired', 'printed'")


class CascadeState(NamedTuple):
    """State between two samples; the body's and the desired axes are those of the sample itself.

    Attributes:
        position, attitude: of the two laws.
        command: the low-pass (..., 3) (N, N/s).
        force: tau_p (..., 3) (N).
        axes, axes_ref: R and R_d.
    """

    position: Any
    attitude: Any
    command: FilterState
    force: Array
    axes: Axes
    axes_ref: Axes


def cascade_init(
    position: Law, attitude: Law, gains: CascadeGains, flight: QuadrotorInput, period: float
) -> CascadeState:
    """Memory before the first sample: as if the thrust that acts had been asked for, at rest, for long."""
    xp = namespace(flight.position)
    outer = _position_signals(flight, joined(scaled(flight.thrust_applied, flight.axes[2]), xp))
    force = joined(_within_reach(gains, components(outer.tau_applied), xp), xp)
    rest = FilterState(force, xp.zeros_like(force))
    command = rest if gains.command == "filtered" else _reference_command(gains, force, flight, xp)
    axes_ref, rates_ref = _attitude_command(command, flight, 0.0, xp)
    inner = _attitude_signals(gains, flight, axes_ref, rates_ref, scaled(0.0, rates_ref), xp)
    return CascadeState(
        position.start(gains.position, outer, period),
        attitude.start(gains.attitude, inner, period),
        command,
        outer.tau_applied,
        flight.axes,
        axes_ref,
    )


def cascade(
    position: Law, attitude: Law, gains: CascadeGains, state: CascadeState, flight: QuadrotorInput, period: float
) -> tuple[Array, CascadeState]:
    """One sample of the cascade at the top: the wrench [u1 (N), u2, u3, u4 (Nm)] (..., 4), and its memory."""
    xp = namespace(flight.position)
    if gains.remembered_force == "applied":
        thrust_axis = scaled(0.5, plus(state.axes[2], flight.axes[2]))
        applied = joined(scaled(flight.thrust_applied, thrust_axis), xp)
    else:
        applied = state.force
    force, position_state = position.step(gains.position, state.position, _position_signals(flight, applied), period)
    reachable = _within_reach(gains, components(force), xp)
    force = joined(reachable, xp)

    command, axes_ref, rates_ref, turning = _command(gains, state.command, force, flight, period, xp)
    inner = _attitude_signals(gains, flight, axes_ref, rates_ref, turning, xp)
    torque, attitude_state = attitude.step(gains.attitude, state.attitude, inner, period)
    thrust = dot(reachable, flight.axes[2])
    wrench = joined((thrust, *components(torque)), xp)
    return wrench, CascadeState(position_state, attitude_state, command, force, flight.axes, axes_ref)


def attitude_errors(gains: CascadeGains, state: CascadeState, flight: QuadrotorInput) -> tuple[Array, Array]:
    """e_q and e_w (..., 3) that the attitude law is about to see, for the command "filtered" exactly."""
    xp = namespace(flight.position)
    axes_ref, rates_ref = _attitude_command(state.command, flight, 0.0, xp)
    q, qd_ref = _attitude_feedback(gains, flight, axes_ref, rates_ref, _carried(flight, axes_ref, rates_ref), xp)
    return 0.0 - q, qd_ref - flight.rates


def _position_signals(flight: QuadrotorInput, applied: Array) -> JointInput:
    return JointInput(
        flight.position,
        flight.velocity,
        flight.position_ref,
        flight.velocity_ref,
        flight.acceleration_ref,
        applied,
    )


def _command(
    gains: CascadeGains, before: FilterState, force: Array, flight: QuadrotorInput, period: float, xp: Any
) -> tuple[FilterState, Axes, Vector, Vector]:
    """Compute the command for the next sample; R_d, w_d and alpha_d of this one."""
    if gains.command == "filtered":  # the difference to the next sample, which is known already
        now, distance = before, period
        other = command = second_order(before, force, gains.command_rate, 1.0, period)
    else:  # the difference to the sample before
        other, distance = before, -period
        now = command = _reference_command(gains, force, flight, xp)
    axes_ref, rates_ref = _attitude_command(now, flight, 0.0, xp)
    _, rates_other = _attitude_command(other, flight, distance, xp)
    return command, axes_ref, rates_ref, scaled(1 / distance, minus(rates_other, rates_ref))


def _reference_command(gains: CascadeGains, force: Array, flight: QuadrotorInput, xp: Any) -> FilterState:
    """Return a force at the rate that the reference's jerk takes."""
    return FilterState(force, times(gains.position.m_bar, flight.jerk_ref, xp))


def _attitude_command(command: FilterState, flight: QuadrotorInput, distance: float, xp: Any) -> tuple[Axes, Vector]:
    """R_d and w_d of a force and its rate, `distance` (s) from this sample."""
    force, rate = components(command.value), components(command.rate)
    towards = heading(flight.yaw_ref + distance * flight.yaw_rate_ref, flight.yaw_rate_ref, xp)
    axes = desired_axes(force, towards, xp)
    return axes, desired_rates(axes, force, rate, towards)


def _attitude_signals(
    gains: CascadeGains, flight: QuadrotorInput, axes_ref: Axes, rates_ref: Vector, turning: Vector, xp: Any
) -> JointInput:
    """Return the attitude law's signals, see the top; `turning` is alpha_d."""
    carried = _carried(flight, axes_ref, rates_ref)
    q, qd_ref = _attitude_feedback(gains, flight, axes_ref, rates_ref, carried, xp)
    turning = _carried(flight, axes_ref, turning)
    acceleration = joined(minus(turning, cross(components(flight.rates), carried)), xp)
    if flight.turning_ref is not None:
        acceleration = acceleration + flight.turning_ref
    return JointInput(q, flight.rates, xp.zeros_like(q), qd_ref, acceleration, flight.torque_applied)


def _attitude_feedback(
    gains: CascadeGains, flight: QuadrotorInput, axes_ref: Axes, rates_ref: Vector, carried: Vector, xp: Any
) -> tuple[Array, Array]:
    """q and qd_ref of the attitude law; `carried` is R^T R_d w_d."""
    e = attitude_error(flight.axes, axes_ref)
    if gains.attitude_error == "printed":
        e = scaled(-2.0, e)
        rates = components(flight.rates)
        # e_q. = w - R_d^T R w_d
        carried = plus(rates, minus(rates, to_body(axes_ref, to_world(flight.axes, rates_ref))))
    return joined(scaled(-1.0, e), xp), joined(carried, xp)


def _carried(flight: QuadrotorInput, axes_ref: Axes, a: Vector) -> Vector:
    """R^T R_d a: from the desired axes to the body's."""
    return to_body(flight.axes, to_world(axes_ref, a))


def _within_reach(gains: CascadeGains, force: Vector, xp: Any) -> Vector:
    """Clamp the vertical part of a force, then shorten its horizontal part to the largest tilt."""
    x, y, lift = force
    lift = xp.minimum(xp.maximum(lift, gains.lift_min), gains.lift_max)
    allowed = math.tan(math.radians(gains.tilt_max_deg)) * lift
    shrink = allowed / xp.maximum(root(x * x + y * y, xp), allowed)
    return shrink * x, shrink * y, lift
