"""PID in incremental (velocity) form, on measured velocities.

    tau_k = tau_applied,k-1 + K_P L ed_k + K_I L e_k + K_D (L qdd_ref,k - (qd_k - qd_k-1))

The increments of e and ed are taken from the velocity and acceleration signals. With K_P = m_bar Kd / L,
K_I = m_bar Kp / L and K_D = m_bar / L it *is* TDE control: the time-delay estimate is integral action.
Source: Chang, Jung, "A systematic method for gain selection of robust PID control for nonlinear plants of second-order
controller canonical form" (2009).
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace
from controllers.laws.tde import TdeGains
from controllers.laws.tracking import Array, Gain, JointInput, check_positive, errors, make_plain, times


@dataclasses.dataclass(frozen=True)
class PidGains:
    """Proportional (Nm/rad), integral (Nm/(rad s)) and derivative (Nm s/rad) gains, each a number or one a joint."""

    proportional: Gain
    integral: Gain
    derivative: Gain

    def __post_init__(self) -> None:
        make_plain(self)
        for field in dataclasses.fields(self):
            check_positive(field.name, getattr(self, field.name))


class PidState(NamedTuple):
    """Velocity of the sample before (..., n)."""

    qd: Array


def identity_gains(gains: TdeGains, period: float) -> PidGains:
    """Return the PID that equals TDE with scalar or diagonal `gains` at the sampling `period` (s).

    Raises:
        GainError: for a full matrix m_bar.
    """
    if np.ndim(gains.m_bar) > 1:
        raise GainError("m_bar", gains.m_bar, "a number, or one a joint: a PID couples no joints")
    m_bar, k_p, k_d = (np.asarray(value, dtype=np.float64) for value in (gains.m_bar, gains.k_p, gains.k_d))

    def plain(value: NDArray[np.float64]) -> Gain:
        return tuple(value.tolist()) if value.ndim else float(value)

    return PidGains(plain(m_bar * k_d / period), plain(m_bar * k_p / period), plain(m_bar / period))


def pid_init(signals: JointInput, period: float) -> PidState:
    """Memory before the first sample: as if the reference acceleration had acted; the derivative term is zero."""
    return PidState(signals.qd - period * signals.qdd_ref)


def pid(gains: PidGains, state: PidState, signals: JointInput, period: float) -> tuple[Array, PidState]:
    """One sample of the law at the top."""
    xp = namespace(signals.q)
    e, ed = errors(signals)
    slowing = period * signals.qdd_ref - (signals.qd - state.qd)
    tau = signals.tau_applied + times(gains.proportional, period * ed, xp) + times(gains.integral, period * e, xp)
    tau = tau + times(gains.derivative, slowing, xp)
    return tau, PidState(signals.qd)
