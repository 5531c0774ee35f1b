"""Analytic inverse kinematics of a leg whose hip axes meet in one point and whose ankle axes meet in another.

Source: Kajita et al., Introduction to Humanoid Robotics (2014), section 2.5.2.
"""

from __future__ import annotations

import numpy as np

from artde_gym.arrays import Array
from artde_gym.errors import RobotError


def leg_angles(ankle_from_hip: Array, thigh: float, shank: float, rot_foot_to_base: Array | None = None) -> Array:
    """Return hip yaw, roll, pitch, knee, ankle pitch, ankle roll (..., 6) (rad), knee bent forward (>= 0).

    Args:
        ankle_from_hip: ankle minus hip, in base axes, (..., 3) (m).
        rot_foot_to_base: orientation of the foot, (..., 3, 3); level and straight ahead by default.

    Raises:
        RobotError: if the ankle is out of the leg's reach.
    """
    rot_foot = np.eye(3) if rot_foot_to_base is None else rot_foot_to_base
    r = -(np.swapaxes(rot_foot, -1, -2) @ ankle_from_hip[..., None])[..., 0]  # hip from ankle, in foot axes
    reach = np.linalg.norm(r, axis=-1)
    if not (np.all(reach < thigh + shank) and np.all(reach > abs(thigh - shank))):
        allowed = f"distances from {abs(thigh - shank):g} to {thigh + shank:g} m"
        raise RobotError("distance of hip and ankle", float(np.max(reach)), allowed)
    bend = np.arccos((thigh**2 + shank**2 - reach**2) / (2 * thigh * shank))
    knee = np.pi - bend
    ankle_roll = np.arctan2(r[..., 1], r[..., 2])
    lean = np.arcsin(np.clip(thigh * np.sin(knee) / reach, -1.0, 1.0))
    ankle_pitch = -np.arctan2(r[..., 0], np.hypot(r[..., 1], r[..., 2])) - lean
    # rot_hip = R_z(yaw) R_x(roll) R_y(pitch) = rot_foot R_x(-ankle_roll) R_y(-knee - ankle_pitch)
    rot_hip = rot_foot @ _about_x(-ankle_roll) @ _about_y(-knee - ankle_pitch)
    yaw = np.arctan2(-rot_hip[..., 0, 1], rot_hip[..., 1, 1])
    roll = np.arctan2(rot_hip[..., 2, 1], np.hypot(rot_hip[..., 0, 1], rot_hip[..., 1, 1]))
    pitch = np.arctan2(-rot_hip[..., 2, 0], rot_hip[..., 2, 2])
    return np.stack([yaw, roll, pitch, knee, ankle_pitch, ankle_roll], axis=-1)


def _about_x(angle: Array) -> Array:
    return _turn(angle, 1, 2)


def _about_y(angle: Array) -> Array:
    return _turn(angle, 2, 0)


def _turn(angle: Array, i: int, j: int) -> Array:
    """Return the rotation in the plane of the coordinate axes i, j, from i to j."""
    rot = np.zeros((*np.shape(angle), 3, 3))
    rot[..., range(3), range(3)] = 1.0
    rot[..., i, i] = rot[..., j, j] = np.cos(angle)
    rot[..., j, i], rot[..., i, j] = np.sin(angle), -np.sin(angle)
    return rot
