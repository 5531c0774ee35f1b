"""A figure-eight of the tool, by inverse kinematics.

    p(theta) = p_0 + (0, a sin(theta), b sin(2 theta)),  theta' rises from 0 to 2 pi / T with minimum jerk

At knots of one round, q minimizes |W (p(q) - p)|^2 + |q - q_0|^2 with a large W: of all poses that reach the point the
one closest to q_0, so that each round is the same. A periodic quintic spline joins them.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.errors import OptionError
from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.arm.tool import Tool

KNOTS = 32  # of one round
WEIGHT = 1e4  # 1/m, W: the tool misses its place by less than a micrometer
MISSED = 1e-5  # m, by which it may miss a knot
ZERO = 1e-6  # rad or m, below which a joint is at zero


def figure_eight(
    spec: RobotSpec, pose: Array, size: tuple[float, float], period: float, rise: float, time: Array
) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations of the joints (samples, n).

    Args:
        spec: the arm.
        pose: of the joints at its center (n,), and at the start.
        size: a and b (m), across along y and up along z of the base.
        period: duration of a round (s).
        rise: duration of the rise of its speed (s).
        time: of the samples (samples,) (s).

    Raises:
        OptionError: for a figure that the tool cannot reach.
    """
    path = _round(spec, tuple(pose.tolist()), size)
    omega, x = 2 * np.pi / period, np.clip(time / rise, 0.0, 1.0)
    phase = omega * (rise * (2.5 * x**4 - 3.0 * x**5 + x**6) + np.maximum(time - rise, 0.0))
    rate = omega * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    rate_dot = omega * 30.0 * x**2 * (1.0 - x) ** 2 / rise
    q, by_phase, twice = (path(phase % (2 * np.pi), nu=order) for order in range(3))
    return q, by_phase * rate[:, None], twice * rate[:, None] ** 2 + by_phase * rate_dot[:, None]


@functools.lru_cache(maxsize=8)
def _round(spec: RobotSpec, pose: tuple[float, ...], size: tuple[float, float]) -> Callable[..., Array]:
    """Return the joints' path as a function of the phase."""
    from scipy.interpolate import make_interp_spline  # SciPy only when such a reference is asked for

    phase = np.linspace(0.0, 2 * np.pi, KNOTS + 1)
    tool, q = Tool(spec), np.array(pose)
    offset = np.stack([0 * phase, size[0] * np.sin(phase), size[1] * np.sin(2 * phase)], axis=1)
    knots = [q]
    for place in tool.position(q) + offset[1:-1]:
        knots.append(_reached(tool, np.array(pose), knots[-1], place, size))
    return make_interp_spline(phase, np.array([*knots, q]), k=5, bc_type="periodic")


def _reached(tool: Tool, pose: Array, start: Array, place: Array, size: tuple[float, float]) -> Array:
    """Return the joints that reach a place, closest to `pose`, searched from `start`."""
    from scipy import optimize

    least_squares: Any = optimize.least_squares  # its annotation knows no function as `jac`

    def miss(q: Array) -> Array:
        return np.concatenate([WEIGHT * (tool.position(q) - place), q - pose])

    def slope(q: Array) -> Array:
        return np.concatenate([WEIGHT * tool.jacobian(q), np.eye(len(q))])

    def searched(begin: Array) -> Array:
        return least_squares(miss, begin, slope, method="lm", xtol=1e-12, ftol=1e-12, gtol=1e-12).x

    def missed(q: Array) -> bool:
        return bool(np.linalg.norm(tool.position(q) - place) > MISSED)

    found = searched(start)
    if missed(found):  # the first step is 100 times the joints: all but none where these are all but zero
        found = searched(np.where(np.abs(start) < ZERO, 0.0, start))
    if missed(found):
        raise OptionError("size of the reference", size, "a figure within the tool's reach around its pose")
    return found
