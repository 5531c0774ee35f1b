"""The quadrotor of the thesis: a Q-450 frame with a computer and a gripper, 1.48 kg.

The thesis gives the frame, 1.4 kg without computer and gripper, and the gripper's 0.03 kg; the rest is ours
(`docs/deviations.md`). Body frame: at the center of mass; x forward, y left, z up along the thrust. Four rotors in X
configuration, counted counter-clockwise from the front left as seen from above; neighbours turn in opposite directions.
"""

from __future__ import annotations

import functools
import math
from typing import TypeVar

import numpy as np

from artde_gym.arrays import Array
from artde_gym.multibody.spec import Box, Link, RobotSpec, Vector

MASS = 1.4 + 0.05 + 0.03  # kg: frame, computer, gripper
INERTIA: Vector = (0.0125, 0.0125, 0.0225)  # kg m^2
ARM = 0.225  # m, rotor axis to center
ROTOR_RADIUS = 0.127  # m, of a ten inch propeller
MAX_THRUST = 8.5  # N, of one rotor
TORQUE_PER_THRUST = 0.016  # m, a rotor's reaction torque over its thrust
ROTOR_LAG = 0.035  # s, of thrust behind its command
DRAG = 0.35  # N s/m, of the rotors against the air, in every direction

ROTORS = ("front_left", "rear_left", "rear_right", "front_right")
SPIN = (1, -1, 1, -1)  # sign of the reaction torque about z: the front left rotor turns clockwise
PAYLOAD_PLACE: Vector = (0.01, 0.0, -0.10)  # m, where the gripper holds its load

_SIDE = ARM / math.sqrt(2.0)
_PER_TILT, _PER_TURN = 0.25 / _SIDE, 0.25 / TORQUE_PER_THRUST
ROTOR_PLACES: tuple[Vector, ...] = (
    (_SIDE, _SIDE, 0.0),
    (-_SIDE, _SIDE, 0.0),
    (-_SIDE, -_SIDE, 0.0),
    (_SIDE, -_SIDE, 0.0),
)

MIXER: Array = np.array(
    [
        [1.0, 1.0, 1.0, 1.0],
        [y for _, y, _ in ROTOR_PLACES],
        [-x for x, _, _ in ROTOR_PLACES],
        [TORQUE_PER_THRUST * sign for sign in SPIN],
    ]
)
"""Rotor thrusts (N) to the wrench [u1 (N), u2, u3, u4 (Nm)]: thrust along body z, torques about body x, y, z."""
ALLOCATION: Array = np.linalg.inv(MIXER)
"""The wrench to rotor thrusts, before their limits."""
MIXER.flags.writeable = ALLOCATION.flags.writeable = False

MAX_WRENCH = (4 * MAX_THRUST, 2 * MAX_THRUST * _SIDE, 2 * MAX_THRUST * _SIDE, 2 * MAX_THRUST * TORQUE_PER_THRUST)
"""The most that the rotors can give of each, one at a time (N, Nm)."""
MIN_WRENCH = (0.0, -MAX_WRENCH[1], -MAX_WRENCH[2], -MAX_WRENCH[3])
"""The least."""

Number = TypeVar("Number", float, Array)

STRIPS = 12  # of a rotor disc in pictures

_DARK = (0.16, 0.17, 0.20, 1.0)
_RED = (0.75, 0.20, 0.18, 1.0)
_WHITE = (0.90, 0.90, 0.92, 1.0)
_BLADE = (0.25, 0.27, 0.32, 1.0)


def wrench(front_left: Number, rear_left: Number, rear_right: Number, front_right: Number) -> tuple[Number, ...]:
    """`MIXER` times the rotors' thrusts, elementwise: u1 (N), u2, u3, u4 (Nm)."""
    left, right = front_left + rear_left, front_right + rear_right
    rear, front = rear_left + rear_right, front_left + front_right
    turning, counter_turning = front_left + rear_right, rear_left + front_right
    return (
        left + right,
        _SIDE * (left - right),
        _SIDE * (rear - front),
        TORQUE_PER_THRUST * (turning - counter_turning),
    )


def thrusts(u1: Number, u2: Number, u3: Number, u4: Number) -> tuple[Number, ...]:
    """`ALLOCATION` times a wrench, elementwise: thrusts of the rotors (N), not yet limited."""
    lift, roll, pitch, yaw = 0.25 * u1, _PER_TILT * u2, _PER_TILT * u3, _PER_TURN * u4
    return lift + roll - pitch + yaw, lift + roll + pitch - yaw, lift - roll + pitch + yaw, lift - roll - pitch - yaw


def rotor_heights(height: Number, ahead: Number, aside: Number) -> tuple[Number, Number, Number, Number]:
    """World z of the rotors, elementwise, from that of the center and those of the body's x and y axes."""
    x, y = _SIDE * ahead, _SIDE * aside
    both, apart = x + y, x - y
    return height + both, height - apart, height - both, height + apart


@functools.cache
def q450() -> RobotSpec:
    """The quadrotor as one rigid body that can be pushed at its center, `body`, and at each rotor."""
    body = Link("body", MASS, com=(0.0, 0.0, 0.0), inertia=INERTIA, visuals=_visuals())
    sites = [("body", "body", (0.0, 0.0, 0.0))]
    sites += [(name, "body", place) for name, place in zip(ROTORS, ROTOR_PLACES, strict=True)]
    return RobotSpec(name="q450", links=(body,), actuated=(), torque_limit=0.0, sites=tuple(sites))


def _visuals() -> tuple[Box, ...]:
    """Boxes lie along the axes: an arm, at 45 degrees to them, is a row of them; a rotor disc is cut into strips."""
    shapes = [Box((0.11, 0.11, 0.05), (0.0, 0.0, 0.0), _WHITE), Box((0.05, 0.04, 0.03), (0.0, 0.0, -0.04), _DARK)]
    for (x, y, _), color in zip(ROTOR_PLACES, (_RED, _DARK, _DARK, _RED), strict=True):  # red is ahead
        steps = [0.2 + 0.8 * i / 9 for i in range(10)]
        shapes += [Box((0.026, 0.026, 0.018), (share * x, share * y, 0.0), color) for share in steps]
        shapes.append(Box((0.03, 0.03, 0.04), (x, y, 0.01), _DARK))
        for i in range(STRIPS):
            aside = ROTOR_RADIUS * ((2 * i + 1) / STRIPS - 1)
            size = (2 * math.sqrt(ROTOR_RADIUS**2 - aside**2), 2 * ROTOR_RADIUS / STRIPS, 0.004)
            shapes.append(Box(size, (x, y + aside, 0.035), _BLADE))
    for x in (-0.08, 0.08):  # skids
        for y in (-0.08, 0.08):
            shapes.append(Box((0.012, 0.012, 0.08), (x, y, -0.05), _DARK))
        shapes.append(Box((0.012, 0.24, 0.012), (x, 0.0, -0.09), _DARK))
    return tuple(shapes)
