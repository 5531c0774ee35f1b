"""What happens to a robot beyond its own dynamics, as data: one JSON-able grammar for all environments."""

from artde_gym.disturbances.grammar import Disturbances
from artde_gym.disturbances.kinds import (
    DISTURBANCES,
    DisturbanceSpec,
    Load,
    Parameter,
    RobotStates,
    register_disturbance,
)

__all__ = [
    "DISTURBANCES",
    "DisturbanceSpec",
    "Disturbances",
    "Load",
    "Parameter",
    "RobotStates",
    "register_disturbance",
]
