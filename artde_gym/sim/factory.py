"""Engines by name, imported when asked for; which one is the default is decided here alone."""

from __future__ import annotations

import functools
import importlib
import platform
import sys
from typing import TYPE_CHECKING, Literal, cast

from artde_gym.errors import MissingDependencyError, OptionError
from artde_gym.multibody.spec import RobotSpec
from artde_gym.sim.engine import Engine

if TYPE_CHECKING:
    from artde_gym.sim.mujoco_batch import MujocoBatch

EngineName = Literal["bullet", "mujoco"]

ENGINES: dict[EngineName, str] = {"bullet": "PyBullet", "mujoco": "MuJoCo"}
"""All engines, and how they are written."""


def resolve_engine(name: str | None) -> EngineName:
    """Return the engine called `name`; for None, Bullet where it can be imported, else MuJoCo.

    Raises:
        OptionError: for an unknown engine.
    """
    if name is None:
        return "mujoco" if missing_bullet() else "bullet"
    if name not in ENGINES:
        raise OptionError("engine", name, "'bullet', 'mujoco', or None for the default")
    return cast(EngineName, name)


def installed_engines() -> dict[EngineName, str]:
    """Return the engines that can be used here, and how they are written."""
    return {name: written for name, written in ENGINES.items() if name != "bullet" or not missing_bullet()}


@functools.cache
def missing_bullet() -> str:
    """Say why PyBullet cannot be imported here and what to do about it; an empty string where it can."""
    try:
        importlib.import_module("artde_gym.sim.quiet")
    except ImportError as error:
        return why_no_bullet(error)
    return ""


def why_no_bullet(error: ImportError) -> str:
    """Say why an import of PyBullet failed, and what to do about it."""
    if error.name != "pybullet":
        return f"PyBullet is installed, but cannot be imported ({error})"
    if has_wheel(platform.python_implementation(), sys.version_info[:2], sys.platform, platform.machine()):
        return "PyBullet is not installed: pip install pybullet==3.2.7"
    here = f"{platform.python_implementation()} {platform.python_version()} on {platform.system()} {platform.machine()}"
    return (
        f"PyBullet has no wheel for {here}; use engine 'mujoco', CPython 3.11 on Linux x86-64, or a C++ compiler and a "
        "quarter of an hour: pip install 'artde-gym[bullet]'"
    )


def has_wheel(implementation: str, version: tuple[int, int], system: str, machine: str) -> bool:
    """Tell whether PyBullet 3.2.7 has a wheel for a supported Python: the marker in pyproject.toml says the same."""
    return (implementation, system, machine) == ("CPython", "linux", "x86_64") and version < (3, 12)


def make_engine(name: EngineName | None, spec: RobotSpec, time_step: float, *, renders: bool = False) -> Engine:
    """Build `spec` in the engine called `name`, or in the default one.

    Args:
        time_step: of the physics (s).
        renders: whether pictures will be asked for: an engine that cannot draw on this machine then says so at once.

    Raises:
        OptionError: for an unknown engine, one that is not installed (MissingDependencyError), or one that cannot draw.
        RobotError: for a robot that the engine cannot simulate.
    """
    if resolve_engine(name) == "bullet":
        if missing := missing_bullet():
            raise MissingDependencyError("engine", "bullet", missing)
        from artde_gym.sim.bullet import BulletEngine  # imported only when used

        return BulletEngine(spec, time_step)
    from artde_gym.sim.mujoco import MujocoEngine

    return MujocoEngine(spec, time_step, renders=renders)


def make_batch(name: EngineName | None, spec: RobotSpec, n: int, time_step: float, threads: int) -> MujocoBatch:
    """Build `n` worlds of `spec` in the engine called `name`, stepped by so many threads.

    Raises:
        OptionError: for an engine that has no batches.
        RobotError: for a robot that the engine cannot simulate.
    """
    if name not in (None, "mujoco"):
        raise OptionError("engine", name, "'mujoco'; engine 'bullet' has no batches: make single environments there")
    from artde_gym.sim.mujoco_batch import MujocoBatch

    return MujocoBatch(spec, n, time_step, threads)
