"""Rotations in plain floats, several times as fast as NumPy for a single vector: they run every step."""

from __future__ import annotations

from typing import TypeAlias

from artde_gym.robots.spec import Vector

Quaternion: TypeAlias = tuple[float, float, float, float]
"""x, y, z, w: the vector part first, as SciPy and PyBullet have it."""


def rotated(vector: Vector, quat_xyzw: Quaternion) -> Vector:
    """R(quat) vector = v + w t + u x t with t = 2 u x v, u and w being the parts of the quaternion."""
    (x, y, z, w), (vx, vy, vz) = quat_xyzw, vector
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx


def moved(velocity: Vector, spin: Vector, arm: Vector) -> Vector:
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
