"""The largest disturbance that each controller survives in a given share of the episodes."""

from artde_gym.studies.frontier.result import Frontier
from artde_gym.studies.frontier.search import frontier

__all__ = ["Frontier", "frontier"]
