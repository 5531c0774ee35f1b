"""Policies and tuning ranges for the robot of an environment."""

from __future__ import annotations

from typing import Any

from artde_gym.registration import GainRange
from controllers.drive import DRIVES
from controllers.joint_space import make_joint_space
from controllers.policies import ControlInterface, Policy
from controllers.presets import gain_ranges


def make_for_robot(env: Any, *, law: str, **options: Any) -> Policy:
    """Make the policy of a law for the robot of an environment.

    Args:
        env: the environment that it will drive.
        law: name of the law.
        options: of `Drive.make` of the robot: `controllers.joint_space.make_joint_space`,
            `controllers.quadrotor.make_quadrotor`, or a plug-in's own.

    Raises:
        UnknownNameError: for a law that the robot does not have, or an unknown preset.
        GainError: for an unknown gain or a value that is not allowed.
    """
    robot = ControlInterface.of(env).robot
    make = DRIVES[robot].make if robot in DRIVES else None
    return (make or make_joint_space)(env, law=law, **options)


def tuning_space(env: Any, *, law: str, preset: str | None = None) -> dict[str, GainRange]:
    """Return the ranges in which tuning searches a law's gains for the robot of an environment.

    They begin at the gains of the preset, or at those that the robot's drive designs for the environment.

    Raises:
        UnknownNameError: for a law or preset that the robot does not have, or a law without tuning ranges.
    """
    robot = ControlInterface.of(env).robot
    ranges = gain_ranges(robot, law, preset)
    design = DRIVES[robot].feedback
    for name, gain in ({} if design is None else design(env)).items():  # not those of the preset's robot and period
        if name in ranges:
            _, low, high = ranges[name]
            ranges[name] = GainRange(gain, min(low, gain), max(high, gain))
    return ranges
