"""Engines by name, imported when asked for."""

from __future__ import annotations

from typing import Literal

from artde_gym.errors import OptionError
from artde_gym.robots.spec import RobotSpec
from artde_gym.sim.engine import Engine

EngineName = Literal["bullet"]


def make_engine(name: EngineName, spec: RobotSpec, time_step: float) -> Engine:
    """Build `spec` in the engine called `name`.

    Raises:
        OptionError: for an unknown engine.
    """
    if name == "bullet":
        from artde_gym.sim.bullet import BulletEngine  # imported only when used

        return BulletEngine(spec, time_step)
    raise OptionError("engine", name, "'bullet'")
