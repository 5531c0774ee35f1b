"""Loads on robots by disturbances, and functions from the states of robots to such loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from artde_gym.arrays import Array


class RobotStates(NamedTuple):
    """The states of n robots for effects; those of the base are of its link's origin, in world axes.

    Attributes:
        time: time since the start of each episode (n,) (s).
        q, qd: positions and velocities of the actuated joints (n, joints) (rad, rad/s).
        position, velocity: position and velocity of the base (n, 3) (m, m/s).
        quat_xyzw: attitude of the base (n, 4).
        angular_velocity: angular velocity of the base (n, 3) (rad/s).
    """

    time: Array
    q: Array
    qd: Array
    position: Array
    quat_xyzw: Array
    velocity: Array
    angular_velocity: Array


class Load(NamedTuple):
    """Loads on n robots in addition to those of actuators and ground; None for none.

    Attributes:
        tau: torques on the actuated joints (n, joints) (Nm).
        force: force at the center of mass of the base link (n, 3) (N), world axes.
        torque: torque on the base link (n, 3) (Nm), world axes.
    """

    tau: Array | None = None
    force: Array | None = None
    torque: Array | None = None


Effect = Callable[[Mapping[str, Array], RobotStates], Load]
"""A function from sampled values and the states of n robots to a disturbance's loads in the next physics step.

A value is (n,) or (n, size); a word is its index among the allowed ones. The function is pure, without memory or
randomness.
"""
