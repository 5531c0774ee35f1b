"""Time-delay estimation (TDE) control: unknown dynamics cancelled with the force and acceleration of one sample ago.

    tau_k   = tau_applied,k-1 + m_bar (u_k - a_k),   a_k = (qd_k - qd_k-1) / L
    u_k     = qdd_ref + Kd ed + Kp e + du_k
    sigma_k = u_k-1 - a_k                            the TDE error

a_k is the mean acceleration over the very interval in which tau_applied acted, so the two belong together exactly.
Source: Dantu 2023, equations 2.5 and 2.6; Hsia, Lasky, Guo, "Robust independent joint controller design for industrial
robot manipulators" (1991). The thesis prints sigma with both signs; M^-1 (N - N_hat), above its
equation 2.7, is this one, and 2.9 the opposite.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace
from controllers.laws.tracking import (
    Array,
    Gain,
    JointInput,
    check_non_negative,
    check_positive,
    check_positive_number,
    desired_acceleration,
    errors,
    is_finite,
    make_plain,
    sliding_variable,
    sliding_weights,
    smooth_sign,
)

Inertia: TypeAlias = "Gain | Sequence[Sequence[float]]"


@dataclasses.dataclass(frozen=True)
class TdeGains:
    """Gains of the law; each a number or one a joint.

    Attributes:
        m_bar: constant nominal inertia (kg m^2); a matrix is allowed too. Stable only while the eigenvalues of
            M(q)^-1 m_bar lie in (0, 2), see `controllers.laws.stability`.
        k_p: stiffness of the error dynamics (1/s^2).
        k_d: damping of the error dynamics (1/s).

    Raises:
        GainError: for a gain that is not finite and above zero.
    """

    m_bar: Inertia
    k_p: Gain
    k_d: Gain

    def __post_init__(self) -> None:
        make_plain(self)
        check_inertia("m_bar", self.m_bar)
        check_positive("k_p", self.k_p)
        check_positive("k_d", self.k_d)


def check_inertia(field: str, m_bar: Inertia) -> None:
    """Raise GainError unless `m_bar` is a positive number, one a joint, or a positive definite matrix."""
    allowed = "a positive number, one a joint, or a positive definite matrix"
    try:
        matrix = np.asarray(m_bar, dtype=np.float64)
    except (TypeError, ValueError):
        raise GainError(field, m_bar, allowed) from None
    if matrix.ndim == 2:
        symmetric = matrix.shape[0] == matrix.shape[1] and np.allclose(matrix, matrix.T)
        numbers = all(map(is_finite, np.asarray(m_bar, dtype=object).ravel().tolist()))  # no text, no truth values
        if not (symmetric and numbers and np.all(np.linalg.eigvalsh(matrix) > 0)):
            raise GainError(field, m_bar, allowed)
    else:
        check_positive(field, m_bar)  # pyright: ignore[reportArgumentType]  # not a matrix here


class TdeState(NamedTuple):
    """State between two samples, each (..., n): qd, u, and sigma for diagnostics."""

    qd: Array
    u: Array
    sigma: Array


def tde_init(signals: JointInput, period: float) -> TdeState:
    """Memory before the first sample: as if the reference acceleration had acted, so that a_0 = qdd_ref, sigma_0 = 0.

    That leaves feedback alone on top of the force that acts.
    """
    rest = namespace(signals.qd).zeros_like(signals.qd)
    return TdeState(signals.qd - period * signals.qdd_ref, signals.qdd_ref, rest)


def tde(
    gains: TdeGains,
    state: TdeState,
    signals: JointInput,
    period: float,
    du: Array | None = None,
    m_bar: Array | None = None,
) -> tuple[Array, TdeState]:
    """One sample of the law at the top.

    `du` (..., n) is whatever is added to the desired acceleration (rad/s^2); `m_bar` (..., n, n) is taken in place of
    the gains' where it is given.
    """
    xp = namespace(signals.q)
    u = desired_acceleration(signals, *errors(signals), gains.k_p, gains.k_d, xp)
    own = gains.m_bar if m_bar is None else m_bar
    return time_delay(own, state, signals, u if du is None else u + du, period, xp)


def time_delay(
    m_bar: Inertia | Array, state: TdeState, signals: JointInput, u: Array, period: float, xp: Any = np
) -> tuple[Array, TdeState]:
    """Return the force that makes the acceleration `u` (..., n) if the dynamics are those of one sample ago."""
    a = (signals.qd - state.qd) / period
    tau = signals.tau_applied + inertia_times(m_bar, u - a, xp)
    return tau, TdeState(signals.qd, u, state.u - a)


def as_matrix(m_bar: Inertia, n: int) -> Array:
    """Return a nominal inertia as a matrix (n, n).

    Raises:
        GainError: for one of another number of joints.
    """
    nominal = np.asarray(m_bar, dtype=np.float64)
    if nominal.ndim < 2 and nominal.size in (1, n):
        return np.diag(np.broadcast_to(nominal, n))
    if nominal.shape != (n, n):
        raise GainError("m_bar", m_bar, f"one number, {n} numbers, or a matrix {n} x {n}")
    return nominal


def inertia_times(m_bar: Inertia | Array, v: Array, xp: Any = np) -> Array:
    """m_bar v for a scalar, diagonal or full nominal inertia, in the precision of v."""
    if type(m_bar) is float or isinstance(m_bar, (int, float)):
        return m_bar * v
    matrix = xp.asarray(m_bar, dtype=v.dtype)
    # column by column: v @ matrix.T rounds differently for one vector and for many
    return matrix * v if matrix.ndim < 2 else xp.matmul(matrix, v[..., None])[..., 0]


@dataclasses.dataclass(frozen=True)
class ConstantGains(TdeGains):
    """TDE with a robust term of constant gain: an ablation, what ARTDE is without adaptation.

    Attributes:
        alpha: factor of the robust term.
        c: its gain (rad/s^2).
        eps: width of the smooth sign.
    """

    alpha: float
    c: float
    eps: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive_number("alpha", self.alpha)
        check_non_negative("c", self.c)
        check_positive_number("eps", self.eps)


def equivalent_gains(gains: ConstantGains) -> TdeGains:
    """Plain TDE with the slope that the robust term has at s = 0, alpha c / sqrt(eps) times the weights of s.

    For |s|^2 well below eps the two laws are one; whatever ARTDE gains over *this* one it owes to adaptation.
    """
    slope = gains.alpha * gains.c / math.sqrt(gains.eps)
    p12, p22 = sliding_weights(gains.k_p, gains.k_d)

    def plus(gain: Gain, weight: Gain) -> Gain:
        total = np.asarray(gain, dtype=np.float64) + slope * np.asarray(weight, dtype=np.float64)
        return tuple(total.tolist()) if total.ndim else float(total)

    return TdeGains(gains.m_bar, plus(gains.k_p, p12), plus(gains.k_d, p22))


def constant_gain_tde(
    gains: ConstantGains, state: TdeState, signals: JointInput, period: float, du: Array | None = None
) -> tuple[Array, TdeState]:
    """TDE with du = alpha c s / sqrt(|s|^2 + eps)."""
    xp = namespace(signals.q)
    s = sliding_variable(*errors(signals), gains.k_p, gains.k_d, xp)
    robust = (gains.alpha * gains.c) * smooth_sign(s, gains.eps, xp)
    return tde(gains, state, signals, period, robust if du is None else robust + du)
