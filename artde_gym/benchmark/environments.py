"""The environments to measure, without wrappers."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from artde_gym.sim.factory import installed_engines

ENGINES: dict[str, str] = {**installed_engines()}
"""Installed engines, and their titles."""


def biped(**kwargs: Any) -> Any:
    """Return the biped on a short walk."""
    return gym.make("BipedWalk-Payload-v0", disable_env_checker=True, **{"duration": 6.0, **kwargs}).unwrapped


def arm(**kwargs: Any) -> Any:
    """Return the built-in arm at pick and place."""
    return gym.make("ArmTrack-Payload-v0", disable_env_checker=True, **{"duration": 12.0, **kwargs}).unwrapped


def quadrotor(**kwargs: Any) -> Any:
    """Return the quadrotor."""
    return gym.make("QuadInfinity-Payload-v0", disable_env_checker=True, **kwargs).unwrapped


def fleet(size: int, **kwargs: Any) -> Any:
    """Return many quadrotors in NumPy."""
    return gym.make_vec("QuadInfinity-Payload-v0", size, "vector_entry_point", engine="numpy", **kwargs)
