"""Gains of time-delay control for an arm without tuning, from its model and the control period.

With D the diagonal of min 1 / [M(q)^-1]_ii over the workspace,

    m_bar = level D / max eig(D^1/2 M(q)^-1 D^1/2),

so that every eigenvalue lambda of M^-1 m_bar lies in (0, level]. On each of them the law in discrete time moves as
a+ = (1 - lambda) a + lambda u, v+ = v + L a+, q+ = q + L v+, which is stable (Jury's criterion) where

    K_d + K_p L / 2 < 2 (2 - lambda) / (lambda L)  and  K_p L (1 - lambda) / lambda < K_d.

With K_p = omega^2, K_d = 2 omega these limit omega; the design takes a third of the limit. A payload lowers the
smallest lambda, by up to `LOADED`. Reflected inertia decides everything: a design with rotors that the arm does not
have is unstable.
"""

from __future__ import annotations

import math
import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.arm.workspace import workspace_inertia
from controllers.laws.errors import GainError
from controllers.laws.stability import tde_eigenvalues
from controllers.laws.tracking import check_positive_number

LEVEL = 1.0
"""Largest eigenvalue: behind encoders, 1.4 would lower errors by a twentieth and raise chatter by half."""
LOADED = 0.55
"""Factor of the smallest eigenvalue with a payload."""
MARGIN = 3.0
"""Factor of the bandwidth up to its limit."""

Array = NDArray[np.floating[Any]]


class ArmGains(NamedTuple):
    """Gains of an arm: `m_bar` of each joint (kg m^2 or kg), and `k_p`, `k_d` of all."""

    m_bar: tuple[float, ...]
    k_p: float
    k_d: float


def designed(inertia: Array, period: float, level: float = LEVEL) -> ArmGains:
    """Return gains for an inertia M (k, n, n) over the workspace.

    Args:
        inertia: of poses all over the workspace.
        period: L (s).
        level: largest eigenvalue of M^-1 m_bar, above 0 and below 2.

    Raises:
        GainError: for a level or a period out of range.
    """
    check_positive_number("period", period)
    if not 0 < level < 2:
        raise GainError("level", level, "a number above 0 and below 2")
    inverse = np.linalg.inv(inertia)
    shape = (1.0 / np.diagonal(inverse, axis1=1, axis2=2)).min(axis=0)
    m_bar = shape * level / tde_eigenvalues(inertia, tuple(shape.tolist())).max()
    smallest = LOADED * float(tde_eigenvalues(inertia, tuple(m_bar.tolist())).min())
    omega = largest_bandwidth(smallest, level, period) / MARGIN
    return ArmGains(tuple(m_bar.tolist()), omega**2, 2 * omega)


def largest_bandwidth(smallest: float, largest: float, period: float) -> float:
    """Return the omega (rad/s) below which K_p = omega^2, K_d = 2 omega are stable for all eigenvalues in a range."""
    return min(stable_factors(1.0, 2.0, smallest, largest, period))


def stable_factors(k_p: float, k_d: float, smallest: float, largest: float, period: float) -> tuple[float, float]:
    """Return the factors x at which K_p x^2, K_d x make the largest and the smallest eigenvalue of a range unstable."""
    quick = (math.sqrt(k_d**2 + k_p * 4 * (2 - largest) / largest) - k_d) / (k_p * period)
    slow = k_d * smallest / ((1 - smallest) * period * k_p) if smallest < 1 else math.inf
    return quick, slow


def design_arm(spec: RobotSpec, period: float, *, warns: bool = True) -> ArmGains:
    """Return gains for an arm; warn if it has no reflected inertia, unless told not to."""
    if warns and not any(spec.armature):
        warnings.warn(
            "the arm has no reflected rotor inertia, as geared arms have: pass armature= (kg m^2) to its environment",
            stacklevel=4,
        )
    return designed(workspace_inertia(spec), period)
