"""Registry of physics engines, imported on demand, and the choice of the default engine."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import platform
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias

from artde_gym.errors import MissingDependencyError, OptionError
from artde_gym.multibody.spec import RobotSpec
from artde_gym.registry import Registry
from artde_gym.sim.engine import Engine

if TYPE_CHECKING:
    from artde_gym.sim.mujoco_batch import MujocoBatch

EngineName: TypeAlias = str
"""One of `ENGINES`."""


@dataclasses.dataclass(frozen=True)
class EngineSpec:
    """A physics engine.

    Attributes:
        name: name in arguments and on the command line.
        title: name in texts.
        entry_point: "module:class" of an `artde_gym.sim.engine.Engine`, called with a robot's spec, `time_step` (s) and
            `renders` (True if images will be rendered).
        package: requirement for `pip install` if it is missing.
        vector_entry_point: "module:class" of many worlds at once (as `artde_gym.sim.mujoco_batch.MujocoBatch`), called
            with a spec, their number, `time_step` and a number of threads; None if there is none.
        why_missing: function that returns why it is unavailable and a remedy, or an empty string if it is available;
            None: try to import it.
    """

    name: str
    title: str
    entry_point: str
    package: str
    vector_entry_point: str | None = None
    why_missing: Callable[[], str] | None = None

    def missing(self) -> str:
        """Return why it is unavailable and a remedy; an empty string if it is available."""
        if self.why_missing is not None:
            return self.why_missing()
        try:
            _imported(self.entry_point)
        except ImportError as error:
            return f"{self.title} cannot be imported ({error}): pip install '{self.package}'"
        return ""

    def require(self) -> None:
        """Check that it can be used here.

        Raises:
            MissingDependencyError: if it cannot.
        """
        if missing := self.missing():
            raise MissingDependencyError("engine", self.name, missing)

    def load(self, entry_point: str) -> Any:
        """Import one of its classes.

        Raises:
            MissingDependencyError: if it is unavailable.
        """
        self.require()
        return _imported(entry_point)


def _imported(entry_point: str) -> Any:
    module, name = entry_point.split(":")
    return getattr(importlib.import_module(module), name)


_BULLET = EngineSpec(
    "bullet",
    "PyBullet",
    "artde_gym.sim.bullet:BulletEngine",
    "artde-gym[bullet]",
    why_missing=lambda: missing_bullet(),
)
_MUJOCO = EngineSpec(
    "mujoco",
    "MuJoCo",
    "artde_gym.sim.mujoco:MujocoEngine",
    "mujoco",
    vector_entry_point="artde_gym.sim.mujoco_batch:MujocoBatch",
)

ENGINES: Registry[EngineSpec] = Registry(
    "engine",
    "artde_gym.engines",
    lambda spec: {spec.name: spec},
    {spec.name: spec for spec in (_BULLET, _MUJOCO)},
    reserved=("both", "fastest"),
)
"""All engines by name; the first available one is the default."""


def register_engine(spec: EngineSpec, *, replace: bool = False) -> None:
    """Register an engine for environments and the command line.

    Raises:
        OptionError: if its name is taken and `replace` is not given.
    """
    ENGINES.register(spec.name, spec, replace=replace)


def resolve_engine(name: str | None) -> EngineName:
    """Return the engine called `name`; for None, the first available one: Bullet before MuJoCo.

    Raises:
        OptionError: for an unknown engine.
    """
    if name is None:
        return next((spec.name for spec in ENGINES.values() if not spec.missing()), _MUJOCO.name)
    if not isinstance(name, str) or name not in ENGINES:
        raise OptionError("engine", name, f"{', '.join(map(repr, ENGINES))}, or None for the default")
    return name


def installed_engines() -> dict[EngineName, str]:
    """Return the available engines and their titles."""
    return {name: spec.title for name, spec in ENGINES.items() if not spec.missing()}


@functools.cache
def missing_bullet() -> str:
    """Return why PyBullet is unavailable and a remedy; an empty string if it is available."""
    try:
        importlib.import_module("artde_gym.sim.pybullet_module")
    except MissingDependencyError as error:
        return error.allowed
    return ""


def why_no_bullet(error: ImportError) -> str:
    """Return why an import of PyBullet failed and a remedy."""
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
    """Return True if PyBullet 3.2.7 has a wheel for this Python; keep in step with the marker in pyproject.toml."""
    return (implementation, system, machine) == ("CPython", "linux", "x86_64") and version < (3, 12)


def make_engine(name: EngineName | None, spec: RobotSpec, time_step: float, *, renders: bool = False) -> Engine:
    """Build `spec` in the engine called `name`, or in the default one.

    Args:
        time_step: physics time step (s).
        renders: whether images will be rendered; if the engine cannot do so on this machine, it fails immediately.

    Raises:
        OptionError: for an engine that is unknown, not installed (MissingDependencyError) or unable to render.
        RobotError: for a robot that the engine cannot simulate.
    """
    engine = ENGINES[resolve_engine(name)]
    return engine.load(engine.entry_point)(spec, time_step, renders=renders)


def make_batch(name: EngineName, spec: RobotSpec, n: int, time_step: float, threads: int) -> MujocoBatch:
    """Build `n` worlds of `spec` in the engine called `name`, stepped by `threads` threads.

    Raises:
        OptionError: for an engine that has no batches.
        RobotError: for a robot that the engine cannot simulate.
    """
    able = {one.name: one.vector_entry_point for one in ENGINES.values() if one.vector_entry_point is not None}
    if not isinstance(name, str) or name not in able:
        raise OptionError("engine", name, f"{', '.join(map(repr, able))}; single environments have all engines")
    return ENGINES[name].load(able[name])(spec, n, time_step, threads)
