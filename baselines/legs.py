"""Kinematics of Ojas' legs as an agent needs them: mirror symmetry, ankles from joints and joints from ankles.

Joint vectors are (..., 12), left leg then right leg, each q1..q6; see `artde_gym.robots.ojas.model`.
"""

from __future__ import annotations

import numpy as np

from artde_gym.layout import Layout
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas.leg_ik import leg_angles
from controllers.laws.tracking import Array

JOINTS = 12
LEG = JOINTS // 2
REACH = (0.1, 0.398)  # m, hip to ankle, within which offsets are kept; a pattern stays below 0.397

_SWAP = np.r_[LEG:JOINTS, 0:LEG]
_SIGN = np.tile([-1.0, -1.0, 1.0, 1.0, 1.0, -1.0], 2)  # yaw and rolls change sign in a mirror
_POLAR, _AXIAL = (1.0, -1.0, 1.0), (-1.0, 1.0, -1.0)
_MIRROR: dict[str, tuple[float, ...]] = {
    "base_height": (1.0,),
    "tilt": (-1.0, 1.0),
    "base_velocity": _POLAR,
    "base_angular_velocity": _AXIAL,
    "phase": (1.0,),
}
"""Signs of a field's components in a mirror that swaps left and right."""


def mirrored_joints(v: Array) -> Array:
    """Joint angles (or rates, torques) of the robot seen in a mirror."""
    return (_SIGN * v[..., _SWAP]).astype(v.dtype, copy=False)


class Mirror:
    """An environment's observations seen in a mirror that swaps left and right."""

    def __init__(self, layout: Layout) -> None:
        order, sign, offset = np.arange(layout.size), np.ones(layout.size), np.zeros(layout.size)
        for field in layout.fields:
            part = layout[field.name]
            if field.name == "load_left_ref":
                sign[part], offset[part] = -1.0, 1.0
            elif field.name == "contact":
                order[part] = order[part][::-1]
            elif field.name == "ground_force":
                order[part] = np.roll(order[part], 3)
                sign[part] = np.tile(_POLAR, 2)
            elif field.name in _MIRROR:
                sign[part] = _MIRROR[field.name]
            else:
                order[part] = part.start + _SWAP
                sign[part] = _SIGN
        self._order, self._sign, self._offset = order, sign, offset

    def __call__(self, observation: Array) -> Array:
        turned = self._sign * observation[..., self._order] + self._offset
        return turned.astype(observation.dtype, copy=False)


def ankle(leg: Array) -> Array:
    """Ankle from hip (..., 3) (m), base axes, of one leg's joints (..., 6): R_z R_x R_y applied to the bent leg."""
    yaw, roll, pitch, knee = (leg[..., i] for i in range(4))
    below = pitch + knee
    x = -robot.THIGH * np.sin(pitch) - robot.SHANK * np.sin(below)
    z = -robot.THIGH * np.cos(pitch) - robot.SHANK * np.cos(below)
    y, z = -np.sin(roll) * z, np.cos(roll) * z
    sin, cos = np.sin(yaw), np.cos(yaw)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)


def joint_offsets(ankles: Array, offsets: Array) -> Array:
    """Change of joints (..., 2, 6) when `ankles` (..., 2, 3), under level feet, move by `offsets`, within reach.

    Zero, exactly, where the offsets are.
    """
    wanted = np.stack([ankles, ankles + offsets])
    reach = np.sqrt(np.vecdot(wanted, wanted))
    within = np.minimum(np.maximum(reach, REACH[0]), REACH[1])
    before, after = leg_angles(wanted * (within / reach)[..., None], robot.THIGH, robot.SHANK)
    return after - before


def level(tilt: Array, v: Array) -> Array:
    """A vector in base axes in level axes that share the base's heading: R_y(pitch) R_x(roll) v."""
    sin_roll, sin_pitch = np.sin(tilt[..., 0]), np.sin(tilt[..., 1])
    cos_roll, cos_pitch = np.cos(tilt[..., 0]), np.cos(tilt[..., 1])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    y, z = cos_roll * y - sin_roll * z, sin_roll * y + cos_roll * z
    return np.stack([cos_pitch * x + sin_pitch * z, y, cos_pitch * z - sin_pitch * x], axis=-1)
