"""Attitude on SO(3): its errors, and the attitude that a thrust vector and a yaw angle ask for.

    e_q = 1/2 (R^T R_d - R_d^T R)^vee
    e_w = R^T R_d w_d - w

R turns body axes into world axes, w are body rates. Both errors are desired minus actual, in body axes; for small
angles e_q is the rotation vector from R to R_d. Dantu 2023 prints e_q with the opposite sign and twice the size, which
makes the attitude loop unstable.

The desired attitude has its z axis along a force f and its x axis in the plane of f and of the heading; its rates
follow from those of f and of the yaw angle. Source: Mellinger, Kumar, "Minimum snap trajectory generation and control
for quadrotors" (2011), and Lee, Leok, McClamroch, "Geometric tracking control of a quadrotor UAV on SE(3)" (2010).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from controllers.laws.tracking import Array
from controllers.laws.vectors import Axes, Vector, cross, dot, scaled


class Heading(NamedTuple):
    """A yaw angle by its cosine and sine, and its rate (rad/s), each (...)."""

    cos: Array
    sin: Array
    rate: Array


def heading(yaw: Array, rate: Array, xp: Any = np) -> Heading:
    """Return the heading of a yaw angle (rad) that turns at `rate` (rad/s)."""
    return Heading(xp.cos(yaw), xp.sin(yaw), rate)


def attitude_error(axes: Axes, axes_ref: Axes) -> Vector:
    """e_q, dimensionless, (...) each."""
    (x, y, z), (x_ref, y_ref, z_ref) = axes, axes_ref
    return (
        0.5 * (dot(z, y_ref) - dot(y, z_ref)),
        0.5 * (dot(x, z_ref) - dot(z, x_ref)),
        0.5 * (dot(y, x_ref) - dot(x, y_ref)),
    )


def desired_axes(force: Vector, towards: Heading, xp: Any = np) -> Axes:
    """R_d: z along `force` (N, world), x = y_A x z normalized, y = z x x (Dantu 2023, equation 3.16).

    The force must not vanish, nor be parallel to the heading's y axis.
    """
    z = scaled(1 / xp.sqrt(dot(force, force)), force)
    # y_A x z with y_A = (-sin, cos, 0)
    across = towards.cos * z[2], towards.sin * z[2], -towards.sin * z[1] - towards.cos * z[0]
    x = scaled(1 / xp.sqrt(dot(across, across)), across)
    return x, cross(z, x), z


def desired_rates(axes: Axes, force: Vector, force_rate: Vector, towards: Heading) -> Vector:
    """w_d (rad/s, along the desired axes) of `desired_axes` when the force changes at `force_rate` (N/s).

    z. = w_d x z gives the first two, x^T y_A = 0 at all times the third.
    """
    x, y, z = axes
    turn = scaled(1 / dot(force, z), force_rate)
    pitch = dot(x, turn)
    ahead = towards.cos * x[0] + towards.sin * x[1]  # x^T x_A
    tilt = towards.cos * z[1] - towards.sin * z[0]  # z^T y_A
    side = towards.cos * y[1] - towards.sin * y[0]  # y^T y_A
    return -dot(y, turn), pitch, (towards.rate * ahead + pitch * tilt) / side
