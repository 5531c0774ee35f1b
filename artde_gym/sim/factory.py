"""Engines by name, imported when asked for."""

from __future__ import annotations

from typing import Literal

from artde_gym.errors import OptionError
from artde_gym.robots.spec import RobotSpec
from artde_gym.sim.engine import Engine

EngineName = Literal["bullet", "mujoco"]


def make_engine(
    name: EngineName, spec: RobotSpec, time_step: float, *, renders: bool = False, window: bool = False
) -> Engine:
    """Build `spec` in the engine called `name`.

    Args:
        time_step: of the physics (s).
        renders: whether pictures will be asked for: an engine that cannot draw on this machine then says so at once.
        window: whether it shows itself in a window.

    Raises:
        OptionError: for an unknown engine, one that is not installed, one that cannot draw, or has no window.
        RobotError: for a robot that the engine cannot simulate.
    """
    if name == "bullet":
        from artde_gym.sim.bullet import BulletEngine  # imported only when used

        return BulletEngine(spec, time_step, window=window)
    if window:
        raise OptionError("engine of a window", name, "'bullet'")
    if name == "mujoco":
        try:
            from artde_gym.sim.mujoco import MujocoEngine
        except ModuleNotFoundError as error:
            if error.name != "mujoco":
                raise
            allowed = "'bullet', or 'mujoco' after: pip install 'artde-gym[mujoco]'"
            raise OptionError("engine", name, allowed) from error
        return MujocoEngine(spec, time_step, renders=renders)
    raise OptionError("engine", name, "'bullet', 'mujoco'")
