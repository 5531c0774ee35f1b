"""Engines by name, imported when asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from artde_gym.errors import OptionError
from artde_gym.multibody.spec import RobotSpec
from artde_gym.sim.engine import Engine

if TYPE_CHECKING:
    from artde_gym.sim.mujoco_batch import MujocoBatch

EngineName = Literal["bullet", "mujoco"]


def make_engine(name: EngineName, spec: RobotSpec, time_step: float, *, renders: bool = False) -> Engine:
    """Build `spec` in the engine called `name`.

    Args:
        time_step: of the physics (s).
        renders: whether pictures will be asked for: an engine that cannot draw on this machine then says so at once.

    Raises:
        OptionError: for an unknown engine, one that is not installed, or one that cannot draw.
        RobotError: for a robot that the engine cannot simulate.
    """
    if name == "bullet":
        from artde_gym.sim.bullet import BulletEngine  # imported only when used

        return BulletEngine(spec, time_step)
    if name == "mujoco":
        try:
            from artde_gym.sim.mujoco import MujocoEngine
        except ModuleNotFoundError as error:
            raise _missing(error, "'bullet', or 'mujoco'") from error
        return MujocoEngine(spec, time_step, renders=renders)
    raise OptionError("engine", name, "'bullet', 'mujoco'")


def make_batch(name: EngineName, spec: RobotSpec, n: int, time_step: float, threads: int) -> MujocoBatch:
    """Build `n` worlds of `spec` in the engine called `name`, stepped by so many threads.

    Raises:
        OptionError: for an engine that has no batches, or is not installed.
        RobotError: for a robot that the engine cannot simulate.
    """
    if name != "mujoco":
        raise OptionError("engine", name, "'mujoco'; engine 'bullet' has no batches: make single environments there")
    try:
        from artde_gym.sim.mujoco_batch import MujocoBatch
    except ModuleNotFoundError as error:
        raise _missing(error, "'mujoco', of release 3.17 or later,") from error
    return MujocoBatch(spec, n, time_step, threads)


def _missing(error: ModuleNotFoundError, allowed: str) -> Exception:
    """What to raise where a module of MuJoCo is missing."""
    if error.name not in ("mujoco", "mujoco.batch"):
        return error
    return OptionError("engine", "mujoco", f"{allowed} after: pip install 'artde-gym[mujoco]'")
