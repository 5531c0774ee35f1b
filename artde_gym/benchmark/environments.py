"""The environments that are measured, without wrappers."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from artde_gym.sim.factory import installed_engines

ENGINES: dict[str, str] = {**installed_engines()}
"""Engines that are installed, and how they are written."""


def biped(**kwargs: Any) -> Any:
    """The biped on a short walk."""
    return gym.make("BipedWalk-Payload-v0", disable_env_checker=True, **{"duration": 6.0, **kwargs}).unwrapped


def quadrotor(**kwargs: Any) -> Any:
    """The quadrotor."""
    return gym.make("QuadInfinity-Payload-v0", disable_env_checker=True, **kwargs).unwrapped


def fleet(size: int, **kwargs: Any) -> Any:
    """Many quadrotors in NumPy."""
    return gym.make_vec("QuadInfinity-Payload-v0", size, "vector_entry_point", engine="numpy", **kwargs)
