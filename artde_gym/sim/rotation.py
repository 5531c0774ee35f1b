"""Rotations in plain floats, several times as fast as NumPy for a single vector: they run every step."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias, TypeVar

from artde_gym.arrays import Array
from artde_gym.multibody.spec import Vector

Number = TypeVar("Number", float, Array)

Quaternion: TypeAlias = tuple[float, float, float, float]
"""x, y, z, w: the vector part first, as SciPy and PyBullet have it."""


def rotate(
    vector: tuple[Number, Number, Number], quat_xyzw: tuple[Number, Number, Number, Number]
) -> tuple[Number, Number, Number]:
    """R(quat) vector = v + w t + u x t with t = 2 u x v, u and w being the parts of the quaternion; elementwise."""
    (x, y, z, w), (vx, vy, vz) = quat_xyzw, vector
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx


def point_velocity(velocity: Vector, spin: Vector, arm: Vector) -> Vector:
    """Velocity v + w x r of a body's point at `arm` from the point that has `velocity`."""
    (vx, vy, vz), (wx, wy, wz), (ax, ay, az) = velocity, spin, arm
    return vx + wy * az - wz * ay, vy + wz * ax - wx * az, vz + wx * ay - wy * ax


def matrix(quat_xyzw: Quaternion) -> tuple[float, float, float, float, float, float, float, float, float]:
    """R(quat), row by row."""
    x, y, z, w = quat_xyzw
    x2, y2, z2 = x + x, y + y, z + z
    xx, yy, zz, xy, xz, yz = x * x2, y * y2, z * z2, x * y2, x * z2, y * z2
    wx, wy, wz = w * x2, w * y2, w * z2
    return 1 - yy - zz, xy - wz, xz + wy, xy + wz, 1 - xx - zz, yz - wx, xz - wy, yz + wx, 1 - xx - yy


def roll_pitch(
    quat_xyzw: tuple[Number, Number, Number, Number],
    arctangent: Callable[[Number, Number], Number],
    arcsine: Callable[[Number], Number],
) -> tuple[Number, Number]:
    """Angles (rad) of roll about x and pitch about y, the last two of the turns about z, y and x that make R(quat).

    `arctangent` and `arcsine` are those for this kind of number; see `arcsine` below.
    """
    x, y, z, w = quat_xyzw
    return arctangent(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), arcsine(2 * (w * y - z * x))


def arcsine(value: float) -> float:
    """`math.asin`, of values too that rounding has led beyond 1."""
    return math.asin(max(-1.0, min(1.0, value)))
