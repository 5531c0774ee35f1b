"""Adaptive-robust TDE (ARTDE): a robust term whose gain follows the bound |sigma| <= beta_0 + beta_1 |xi|.

    du     = alpha (b_0 + b_1 |xi|) s / sqrt(|s|^2 + eps)
    b_j   += L gamma_j |xi|^j |s|     if any b_i <= floor_i  or  s_k^T (s_k - s_k-1) > 0
    b_j   -= L gamma_j |xi|^j |s|     otherwise,             j = 0, 1

Source: Dantu 2023, equations 2.19 to 2.21, in discrete time: du_k uses the gains of sample k, whose change acts from
sample k + 1 on. Two properties of the law as printed are worth knowing: s_k^T (s_k - s_k-1) is biased upward by
|s_k - s_k-1|^2 / 2, and since one gain at its floor lets *all* of them grow, b_1 dithers at its floor while b_0
ratchets up. Nothing in the law bounds the gains; where they settle, or whether, is up to the plant and its noise. The
options of `ArtdeGains` mend each point; the defaults are the law as printed.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Literal, NamedTuple

from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace, root
from controllers.laws.tde import TdeGains, TdeState, tde_init, time_delay
from controllers.laws.tracking import (
    Array,
    JointInput,
    check_non_negative,
    check_positive_number,
    check_switch,
    desired_acceleration,
    errors,
    inner,
    is_finite,
    signed_step,
    sliding_variable,
    times_rows,
)


@dataclasses.dataclass(frozen=True)
class ArtdeGains(TdeGains):
    """Gains of TDE and of the robust term.

    Attributes:
        alpha: factor of the robust term; the stability proof asks for more than 1.
        gamma_0, gamma_1: adaptation rates.
        beta_floor: floor of both gains, above zero.
        beta_start: their value at the start, at least the floor.
        eps: width of the smooth sign.
        growth: "printed", the test at the top; "midpoint", |s_k|^2 - |s_k-1|^2 > 0 with the weight
            (|s_k| + |s_k-1|) / 2 in place of |s_k|, which has no bias.
        clamp: False as printed; True, each b_j is held at its floor by itself and does not drive the others.
        leakage: rate (1/s) at which the gains decay towards their floor; 0 as printed.
        cap: largest gain; infinite as printed.
    """

    alpha: float
    gamma_0: float
    gamma_1: float
    beta_floor: float
    beta_start: float
    eps: float
    growth: Literal["printed", "midpoint"] = "printed"
    clamp: bool = False
    leakage: float = 0.0
    cap: float = math.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in ("alpha", "beta_floor", "eps"):
            check_positive_number(field, getattr(self, field))
        for field in ("gamma_0", "gamma_1", "leakage"):
            check_non_negative(field, getattr(self, field))
        if not (is_finite(self.beta_start) and self.beta_start >= self.beta_floor):
            raise GainError("beta_start", self.beta_start, f"a finite number >= beta_floor = {self.beta_floor:g}")
        check_switch("clamp", self.clamp)
        if self.growth not in ("printed", "midpoint"):
            raise GainError("growth", self.growth, "'printed', 'midpoint'")
        if not ((is_finite(self.cap) or self.cap == math.inf) and self.cap >= self.beta_start):
            raise GainError("cap", self.cap, f"a number >= beta_start = {self.beta_start:g}")


class ArtdeState(NamedTuple):
    """TDE's memory, the sliding variable s (..., n), the gains for the next sample (...), and c for those who look."""

    tde: TdeState
    s: Array
    beta_0: Array
    beta_1: Array
    c: Array


def artde_init(gains: ArtdeGains, signals: JointInput, period: float) -> ArtdeState:
    """Memory before the first sample, as if s had been the same just before."""
    xp = namespace(signals.q)
    s = sliding_variable(*errors(signals), gains.k_p, gains.k_d, xp)
    beta = xp.full(s.shape[:-1], gains.beta_start, dtype=s.dtype)
    return ArtdeState(tde_init(signals, period), s, beta, beta, beta)


def artde(
    gains: ArtdeGains,
    state: ArtdeState,
    signals: JointInput,
    period: float,
    du: Array | None = None,
    m_bar: Array | None = None,
) -> tuple[Array, ArtdeState]:
    """One sample of the law at the top; `du` (..., n) is added to the robust term, `m_bar` as for TDE."""
    xp = namespace(signals.q)
    e, ed = errors(signals)
    s = sliding_variable(e, ed, gains.k_p, gains.k_d, xp)
    s_squared = inner(s, s, xp)
    xi = root(inner(e, e, xp) + inner(ed, ed, xp), xp)
    c = state.beta_0 + state.beta_1 * xi
    robust = times_rows(gains.alpha * c / xp.sqrt(s_squared + gains.eps), s)
    u = desired_acceleration(signals, e, ed, gains.k_p, gains.k_d, xp) + robust
    own = gains.m_bar if m_bar is None else m_bar
    tau, tde_state = time_delay(own, state.tde, signals, u if du is None else u + du, period, xp)
    return tau, ArtdeState(tde_state, s, *_adapt(gains, state, s, s_squared, xi, period, xp), c)


def _adapt(
    gains: ArtdeGains, state: ArtdeState, s: Array, s_squared: Array, xi: Array, period: float, xp: Any
) -> tuple[Array, Array]:
    """Return the gains for the next sample."""
    weight = root(s_squared, xp)
    if gains.growth == "midpoint":
        before = inner(state.s, state.s, xp)
        grows = s_squared > before
        weight = 0.5 * (weight + root(before, xp))
    else:
        grows = s_squared > inner(s, state.s, xp)  # s_k^T (s_k - s_k-1) > 0
    if not gains.clamp:
        grows = grows | (state.beta_0 <= gains.beta_floor) | (state.beta_1 <= gains.beta_floor)
    signed = signed_step(period * weight, grows)

    def moved(beta: Array, change: Array) -> Array:
        if gains.leakage:
            change = change - (period * gains.leakage) * (beta - gains.beta_floor)
        beta = beta + change
        if gains.clamp:
            beta = xp.maximum(beta, gains.beta_floor)
        return xp.minimum(beta, gains.cap) if math.isfinite(gains.cap) else beta

    return moved(state.beta_0, gains.gamma_0 * signed), moved(state.beta_1, gains.gamma_1 * (xi * signed))
