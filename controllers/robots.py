"""Which kind of policy drives which robot."""

from __future__ import annotations

from typing import Any

from artde_gym.registration import GainRange
from controllers.drive import DRIVES
from controllers.joint_space import make_joint_space
from controllers.policies import ControlInterface, Policy
from controllers.presets import gain_ranges


def make_for_robot(env: Any, *, law: str, **options: Any) -> Policy:
    """The policy of a law for the robot of an environment.

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
    """Where tuning may look for the gains of a law for the robot of an environment.

    Raises:
        UnknownNameError: for a law or preset that the robot does not have, or a law whose gains nobody tunes.
    """
    return gain_ranges(ControlInterface.of(env).robot, law, preset)
