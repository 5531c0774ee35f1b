"""Adaptive TDE (ATDE): a robust term with one adaptive gain, blind to the state.

    du = alpha c s / sqrt(|s|^2 + eps)
    c += L gamma_0 |s|     if c <= floor  or  |s_k| > |s_k-1|
    c -= L gamma_0 |s|     otherwise

The gain of sample k acts in sample k, its change from the next one on. The printed cases overlap at the floor; growth
wins, as in ARTDE. Source: Dantu 2023, equation 2.38, after Pi, Kang, Xu, Li, Li, "Adaptive time-delay balance control
of biped robots" (2020).
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace, root
from controllers.laws.tde import TdeGains, TdeState, tde_init, time_delay
from controllers.laws.tracking import (
    Array,
    JointInput,
    check_non_negative,
    check_positive_number,
    desired_acceleration,
    errors,
    inner,
    is_finite,
    signed_step,
    sliding_variable,
    times_rows,
)


@dataclasses.dataclass(frozen=True)
class AtdeGains(TdeGains):
    """Gains of TDE and of the robust term.

    Attributes:
        alpha: factor of the robust term.
        gamma_0: adaptation rate.
        c_floor: floor of the gain, above zero.
        c_start: its value at the start, at least the floor.
        eps: width of the smooth sign.
    """

    alpha: float
    gamma_0: float
    c_floor: float
    c_start: float
    eps: float

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in ("alpha", "c_floor", "eps"):
            check_positive_number(field, getattr(self, field))
        check_non_negative("gamma_0", self.gamma_0)
        if not (is_finite(self.c_start) and self.c_start >= self.c_floor):
            raise GainError("c_start", self.c_start, f"a finite number >= c_floor = {self.c_floor:g}")


class AtdeState(NamedTuple):
    """TDE's memory, the sliding variable s (..., n), and the gain for the next sample (...)."""

    tde: TdeState
    s: Array
    c: Array


def atde_init(gains: AtdeGains, signals: JointInput, period: float) -> AtdeState:
    """Memory before the first sample, as if s had been the same just before."""
    xp = namespace(signals.q)
    s = sliding_variable(*errors(signals), gains.k_p, gains.k_d, xp)
    return AtdeState(tde_init(signals, period), s, xp.full(s.shape[:-1], gains.c_start, dtype=s.dtype))


def atde(
    gains: AtdeGains,
    state: AtdeState,
    signals: JointInput,
    period: float,
    du: Array | None = None,
    m_bar: Array | None = None,
) -> tuple[Array, AtdeState]:
    """One sample of the law at the top; `du` (..., n) is added to the robust term, `m_bar` as for TDE."""
    xp = namespace(signals.q)
    e, ed = errors(signals)
    s = sliding_variable(e, ed, gains.k_p, gains.k_d, xp)
    s_squared = inner(s, s, xp)
    robust = times_rows(gains.alpha * state.c / xp.sqrt(s_squared + gains.eps), s)
    grows = (state.c <= gains.c_floor) | (s_squared > inner(state.s, state.s, xp))
    change = signed_step((period * gains.gamma_0) * root(s_squared, xp), grows)
    u = desired_acceleration(signals, e, ed, gains.k_p, gains.k_d, xp) + robust
    own = gains.m_bar if m_bar is None else m_bar
    tau, tde_state = time_delay(own, state.tde, signals, u if du is None else u + du, period, xp)
    return tau, AtdeState(tde_state, s, state.c + change)
