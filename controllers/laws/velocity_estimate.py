"""Joint velocities from encoder angles: a difference and a first-order low-pass.

    qd_hat_k = p qd_hat_k-1 + (1 - p) (q_k - q_k-1) / L,       p = exp(-2 pi f L)

Only the velocity is filtered. Passing the applied force through the same low-pass, so that it lags as the acceleration
does, sounds consistent and was tried: it limits the joint stiffness to 2 pi f Kd m_bar, and TDE falls below 60 Hz.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from controllers.laws.tracking import Array, JointInput


class EstimateState(NamedTuple):
    """Angle of the sample before and the low-pass, each (..., n)."""

    q: Array
    qd: Array


def estimate_init(signals: JointInput, period: float) -> EstimateState:
    """Memory before the first sample: as if the robot had moved with the reference."""
    return EstimateState(signals.q - period * signals.qd_ref, signals.qd_ref)


def estimate(
    cutoff_hz: float, state: EstimateState, signals: JointInput, period: float
) -> tuple[JointInput, EstimateState]:
    """The signals with the velocity replaced by its estimate."""
    keep = math.exp(-2 * math.pi * cutoff_hz * period)
    qd = keep * state.qd + ((1 - keep) / period) * (signals.q - state.q)
    return signals._replace(qd=qd), EstimateState(signals.q, qd)
