"""Adaptive sliding-mode control (ASMC): no time-delay estimate; gain and inertia are learned instead. This law is ours.

    s   = ed + slope e
    u   = qdd_ref + slope ed + k_s s + c s / sqrt(|s|^2 + eps)
    tau = r m_bar (u - g)                                      g: free fall, zero for an attitude
    c  += L (gamma_c |s| - leakage_c (c - c_floor))
    r  += L (gamma_r s^T (u - g) - leakage_r (r - 1)),         r within [1 / r_max, r_max]

With the true inertia r m_bar and an acceleration d of everything unknown, s. = -k_s s - c sig(s) + d; on s = 0 the
error decays at the rate `slope`. The smooth sign is a boundary layer of width sqrt(eps). The thesis' sliding variable
is a multiple of this one, p22 s with slope = p12 / p22 = K1 / (1 + K2).

The thesis compares with Mofid, Mobayen, "Adaptive sliding mode control for finite-time stability of quad-rotor UAVs
with parametric uncertainties" (2018), a law that we could not obtain. The parts here are common ones: Slotine, Li,
Applied Nonlinear Control (1991), chapters 7 and 8; Plestan, Shtessel, Bregeault, Poznyak, "New methodologies for
adaptive sliding mode control" (2010).
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any, NamedTuple

import numpy as np

from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace, root
from controllers.laws.tracking import (
    Array,
    Gain,
    JointInput,
    check_non_negative,
    check_positive,
    check_positive_number,
    errors,
    inner,
    is_finite,
    make_plain,
    times,
)


@dataclasses.dataclass(frozen=True)
class AsmcGains:
    """Gains of the law.

    Attributes:
        m_bar: nominal inertia (kg, kg m^2), a number or one an axis.
        slope: rate at which the error decays on s = 0 (1/s).
        k_s: rate at which s is reached (1/s).
        c_floor: the switching gain's start, to which it leaks back (m/s^2, rad/s^2).
        gamma_c: rate of its growth.
        leakage_c: rate of its decay (1/s).
        eps: square of the boundary layer's width.
        gamma_r: rate of the inertia estimate; 0 for none.
        leakage_r: rate of its decay towards m_bar (1/s).
        r_max: largest factor by which the estimate may differ from m_bar.
        gravity: of the downward free fall (m/s^2) if the last axis points up; 0 for an attitude.
    """

    m_bar: Gain
    slope: float
    k_s: float
    c_floor: float
    gamma_c: float
    leakage_c: float
    eps: float
    gamma_r: float
    leakage_r: float
    r_max: float
    gravity: float

    def __post_init__(self) -> None:
        make_plain(self)
        check_positive("m_bar", self.m_bar)
        for field in ("slope", "eps"):
            check_positive_number(field, getattr(self, field))
        for field in ("k_s", "c_floor", "gamma_c", "leakage_c", "gamma_r", "leakage_r", "gravity"):
            check_non_negative(field, getattr(self, field))
        if not (is_finite(self.r_max) and self.r_max >= 1):
            raise GainError("r_max", self.r_max, "a finite number >= 1")


class AsmcState(NamedTuple):
    """The sliding variable s (..., n), and the gain and the inertia's ratio for the next sample (...)."""

    s: Array
    c: Array
    r: Array


def asmc_init(gains: AsmcGains, signals: JointInput) -> AsmcState:
    """Memory before the first sample: the inertia's ratio is the one for which the force that acts holds the weight."""
    e, ed = errors(signals)
    s = ed + gains.slope * e
    xp = namespace(s)
    c = xp.full(s.shape[:-1], gains.c_floor, dtype=s.dtype)
    if not gains.gravity:
        return AsmcState(s, c, xp.ones_like(c))
    weight = times(gains.m_bar, _lifted(gains, xp.zeros_like(s), xp), xp)
    return AsmcState(s, c, _bounded(gains, inner(signals.tau_applied, weight, xp) / inner(weight, weight, xp), xp))


def asmc(gains: AsmcGains, state: AsmcState, signals: JointInput, period: float) -> tuple[Array, AsmcState]:
    """One sample of the law at the top; what sample k teaches acts from k + 1 on."""
    xp = namespace(signals.q)
    e, ed = errors(signals)
    s = ed + gains.slope * e
    s_squared = inner(s, s, xp)
    reach = gains.k_s + state.c / xp.sqrt(s_squared + gains.eps)
    lifted = _lifted(gains, signals.qdd_ref + gains.slope * ed + reach[..., None] * s, xp)
    tau = state.r[..., None] * times(gains.m_bar, lifted, xp)
    c = state.c + period * (gains.gamma_c * root(s_squared, xp) - gains.leakage_c * (state.c - gains.c_floor))
    r = state.r + period * (gains.gamma_r * inner(s, lifted, xp) - gains.leakage_r * (state.r - 1.0))
    return tau, AsmcState(s, c, _bounded(gains, r, xp))


def _lifted(gains: AsmcGains, u: Array, xp: Any) -> Array:
    """u - g."""
    if not gains.gravity:
        return u
    return u + xp.asarray(_up(u.shape[-1], gains.gravity), dtype=u.dtype)


@functools.lru_cache(maxsize=16)
def _up(axes: int, gravity: float) -> Array:
    up = np.zeros(axes)
    up[-1] = gravity
    return up


def _bounded(gains: AsmcGains, r: Array, xp: Any) -> Array:
    return xp.minimum(xp.maximum(r, 1.0 / gains.r_max), gains.r_max)
