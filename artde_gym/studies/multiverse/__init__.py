"""Claims over plausible worlds: a space-filling sample of what is not known, and in how much of it each claim holds."""

from artde_gym.studies.multiverse.claims import WorldClaim, register_world_claims
from artde_gym.studies.multiverse.execution import multiverse
from artde_gym.studies.multiverse.result import Multiverse, read_multiverse

__all__ = ["Multiverse", "WorldClaim", "multiverse", "read_multiverse", "register_world_claims"]
