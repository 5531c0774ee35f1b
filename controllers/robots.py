"""Which kind of policy drives which robot."""

from __future__ import annotations

from typing import Any

from artde_gym.errors import UnknownNameError, among
from artde_gym.registration import GainRange
from controllers.biped import make_biped
from controllers.policies import Plant, Policy
from controllers.presets import gain_ranges
from controllers.quadrotor import make_quadrotor

_MAKERS = {"ojas": make_biped, "q450": make_quadrotor}


def make_for_robot(env: Any, *, law: str, **options: Any) -> Policy:
    """The policy of a law for the robot of an environment.

    Args:
        env: the environment that it will drive.
        law: name of the law.
        options: of the robot's own function in `controllers.biped` or `controllers.quadrotor`.

    Raises:
        UnknownNameError: for a robot that nobody drives, a law that the robot does not have, or an unknown preset.
        GainError: for an unknown gain or a value that is not allowed.
    """
    robot = Plant.of(env).robot
    if robot not in _MAKERS:
        raise UnknownNameError("robot", robot, among(robot, _MAKERS))
    return _MAKERS[robot](env, law=law, **options)


def search_space(env: Any, *, law: str, preset: str | None = None) -> dict[str, GainRange]:
    """Where tuning may look for the gains of a law for the robot of an environment.

    Raises:
        UnknownNameError: for a law or preset that the robot does not have, or a law whose gains nobody tunes.
    """
    return gain_ranges(Plant.of(env).robot, law, preset)
