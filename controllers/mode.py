"""One mode of time-delay control in discrete time, behind an encoder and its low-pass.

On an eigenvalue lambda of M^-1 m_bar, with the velocity h that the law sees,

    h_k = p h_k-1 + (1 - p) (q_k - q_k-1) / L,  a_k = a_k-1 - lambda (Kd h_k + Kp q_k + (h_k - h_k-1) / L),
    v_k+1 = v_k + L a_k,  q_k+1 = q_k + L v_k+1,

where p = exp(-2 pi f L) is the low-pass of `controllers.laws.velocity_estimate`, and 0 without it: then h is the
velocity itself. Rounding to counts acts as white noise on q_k, of the variance of a uniform distribution.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]


def spectral_radius(lam: float, k_p: float, k_d: float, period: float, cutoff_hz: float | None = None) -> float:
    """Return the largest modulus of the mode's poles: stable below 1.

    Args:
        lam: eigenvalue of M^-1 m_bar.
        k_p, k_d: gains.
        period: L (s).
        cutoff_hz: of the low-pass f (Hz); None without.
    """
    return float(np.abs(np.linalg.eigvals(_loop(lam, k_p, k_d, period, cutoff_hz)[0])).max())


def force_noise(lam: float, k_p: float, k_d: float, period: float, cutoff_hz: float | None = None) -> float:
    """Return the standard deviation of the force over m_bar (1/s^2) for white noise of 1 on the angle.

    Infinite for an unstable mode; arguments are those of `spectral_radius`.
    """
    step, noise = _loop(lam, k_p, k_d, period, cutoff_hz)
    if np.abs(np.linalg.eigvals(step)).max() >= 1:
        return math.inf
    size = len(step)
    variance = np.linalg.solve(np.eye(size**2) - np.kron(step, step), np.outer(noise, noise).ravel())
    return math.sqrt(max(float(variance[-1]), 0.0)) / lam


def _loop(lam: float, k_p: float, k_d: float, period: float, cutoff_hz: float | None) -> tuple[Array, Array]:
    """Return the matrix of the state (q, v, last reading, h, a), and the column of noise on the reading."""
    keep = 0.0 if cutoff_hz is None else math.exp(-2 * math.pi * cutoff_hz * period)
    q, v, before, seen, a = np.eye(6)[:5]
    reading = q + np.eye(6)[5]
    velocity = keep * seen + (1 - keep) / period * (reading - before)
    force = a - lam * (k_d * velocity + k_p * reading + (velocity - seen) / period)
    faster = v + period * force
    rows = np.array([q + period * faster, faster, reading, velocity, force])
    return rows[:, :5], rows[:, 5]
