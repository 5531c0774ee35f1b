"""What happens to a robot beyond its own dynamics, as data: one JSON-able grammar for all environments."""

from artde_gym.disturbances.grammar import Disturbances
from artde_gym.disturbances.kinds import KINDS, Kind, Load, Parameter, RobotStates, register_disturbance

__all__ = ["KINDS", "Disturbances", "Kind", "Load", "Parameter", "RobotStates", "register_disturbance"]
