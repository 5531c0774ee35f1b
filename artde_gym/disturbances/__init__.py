"""Disturbances of a robot as data, in one JSON-able grammar for all environments."""

from artde_gym.disturbances.grammar import Disturbances
from artde_gym.disturbances.kinds import (
    DISTURBANCES,
    DisturbanceSpec,
    Parameter,
    register_disturbance,
)
from artde_gym.disturbances.loads import Load, RobotStates

__all__ = [
    "DISTURBANCES",
    "DisturbanceSpec",
    "Disturbances",
    "Load",
    "Parameter",
    "RobotStates",
    "register_disturbance",
]
