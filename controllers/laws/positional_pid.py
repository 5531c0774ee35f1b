"""PID in positional form, on the acceleration that a nominal inertia turns into a force.

    tau = m_bar (qdd_ref + Kp e + Kd ed + i),   i += L Ki e

Unlike the incremental PID of `controllers.laws.pid`, which is time-delay estimation by another name, it measures no
acceleration: only the integral learns what load there is. It starts from the force that acts, and is clamped so that it
cannot wind up. Source: Astrom, Hagglund, Advanced PID Control (2006), chapter 3.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

from controllers.laws.namespaces import namespace
from controllers.laws.tracking import (
    Array,
    Gain,
    JointInput,
    check_non_negative,
    check_positive,
    desired_acceleration,
    errors,
    make_plain,
    times,
)


@dataclasses.dataclass(frozen=True)
class PositionalPidGains:
    """Gains of the law.

    Attributes:
        m_bar: nominal inertia (kg, kg m^2), a number or one an axis.
        k_p: stiffness (1/s^2), a number or one an axis.
        k_d: damping (1/s), a number or one an axis.
        k_i: integral gain (1/s^3); 0 keeps the integral where it starts.
        integral_limit: largest size of each component of the integral (m/s^2, rad/s^2).
    """

    m_bar: Gain
    k_p: Gain
    k_d: Gain
    k_i: float
    integral_limit: float

    def __post_init__(self) -> None:
        make_plain(self)
        for field in ("m_bar", "k_p", "k_d"):
            check_positive(field, getattr(self, field))
        check_non_negative("k_i", self.k_i)
        check_non_negative("integral_limit", self.integral_limit)


class PositionalPidState(NamedTuple):
    """The integral for the next sample (..., n), as an acceleration."""

    integral: Array


def positional_pid_init(gains: PositionalPidGains, signals: JointInput) -> PositionalPidState:
    """Memory before the first sample: the force that acts is what the reference acceleration takes."""
    m_bar = namespace(signals.q).asarray(gains.m_bar, dtype=signals.q.dtype)
    return PositionalPidState(signals.tau_applied / m_bar - signals.qdd_ref)


def positional_pid(
    gains: PositionalPidGains, state: PositionalPidState, signals: JointInput, period: float
) -> tuple[Array, PositionalPidState]:
    """One sample of the law at the top; the integral of sample k acts in sample k, its change from the next one on."""
    xp = namespace(signals.q)
    e, ed = errors(signals)
    u = desired_acceleration(signals, e, ed, gains.k_p, gains.k_d, xp) + state.integral
    limit = gains.integral_limit
    integral = xp.minimum(xp.maximum(state.integral + (period * gains.k_i) * e, -limit), limit)
    return times(gains.m_bar, u, xp), PositionalPidState(integral)
