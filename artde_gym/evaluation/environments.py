"""Registered environments by id: their arguments, their metrics, and instances to run."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import load_env_creator
from gymnasium.vector import AutoresetMode

from artde_gym.deprecation import warn
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.kit import ROBOTS
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.sim.factory import ENGINES, resolve_engine

"""Two backends: one environment per episode in a physics engine, or many episodes in one vector environment."""

PICTURES = ("width", "height", "render_mode")
"""Environment arguments that affect rendering only."""

KEPT = 4  # environments kept per process; each one holds a physics client


def arguments_of(env_id: str, vectorized: bool = False) -> Mapping[str, inspect.Parameter]:
    """Return an environment's arguments by name, without the number of environments of a vector.

    Raises:
        UnknownNameError: if there is no such environment.
        OptionError: if `vectorized` is set and it has no vector environment.
    """
    known = dict(inspect.signature(load_env_creator(_entry_point(env_id, vectorized))).parameters)
    known.pop("num_envs", None)
    return known


def metrics_spec_of(env_id: str, kwargs: Mapping[str, Any] | None = None) -> MetricsSpec:
    """Return the metrics of an environment of this project.

    Args:
        env_id: its id.
        kwargs: its arguments, on which its axes may depend: an arm has the joints of its file. None for the defaults.

    Raises:
        OptionError: for any other environment.
        RobotError: for a robot's file that cannot be read.
    """
    creator = _class(env_id)
    given = getattr(creator, "metrics_spec_with", None)
    return creator.metrics_spec if given is None or kwargs is None else given(kwargs)


def robot_of(env_id: str) -> str:
    """Return the name of the robot in an environment of this project.

    Raises:
        OptionError: for any other environment.
    """
    return _class(env_id).robot_name


def with_engine(env_id: str, kwargs: Mapping[str, Any], vectorized: bool = False) -> dict[str, Any]:
    """Return an environment's arguments with the engine that it will run in, so that records name the engine.

    Raises:
        OptionError: for an unknown engine.
    """
    known = arguments_of(env_id, vectorized).get("engine")
    if known is None:
        return dict(kwargs)
    given = kwargs.get("engine", known.default)
    if not vectorized:
        return {**kwargs, "engine": resolve_engine(given)}
    creator: Any = load_env_creator(_entry_point(env_id, vectorized))
    return {**kwargs, "engine": getattr(creator, "own_engine", None) if given is None else given}


def single_arguments(env_id: str, kwargs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of a vector, or of a single environment, as single ones take them."""
    known = arguments_of(env_id)
    kwargs = {name: value for name, value in kwargs.items() if name in known}  # a vector takes others, too
    try:
        return with_engine(env_id, kwargs)
    except OptionError:  # the vector's own physics
        return with_engine(env_id, {name: value for name, value in kwargs.items() if name != "engine"})


def fastest_engine(env_id: str, engine: str | None = None) -> tuple[bool, str]:
    """Tell whether an environment is faster `vectorized` in one engine, or in any; returns the engine, too.

    Raises:
        OptionError: for an unknown engine.
    """
    point = gym.spec(env_id).vector_entry_point
    own = getattr(load_env_creator(point), "own_engine", None) if isinstance(point, str) else None
    if own is not None and engine in (None, own):
        return True, own
    return False, resolve_engine(engine)


def physics_of(kwargs: Mapping[str, Any]) -> str:
    """Return the title of the physics for arguments from `with_engine`."""
    name = kwargs.get("engine", "numpy")
    return ENGINES[name].title if name in ENGINES else {"numpy": "NumPy"}.get(name, str(name))


def ours() -> list[str]:
    """Return the ids of the environments of all robots."""
    return [entry.env_id for kit in ROBOTS.values() for entry in kit.environments]


def main_scenarios(env_id: str) -> tuple[str, ...]:
    """Return the scenarios that run by default in an environment; empty for the environment itself."""
    entries = [entry for kit in ROBOTS.values() for entry in kit.environments]
    return next((entry.main for entry in entries if entry.env_id == env_id), ())


@functools.lru_cache(maxsize=KEPT)
def single(env_id: str, arguments: str) -> Any:
    """Return an environment by id and JSON arguments; building one takes seconds, so a few are cached.

    Raises:
        OptionError: for an unknown argument, or one that the environment rejects.
    """
    return separate(env_id, arguments)


def separate(env_id: str, arguments: str) -> Any:
    """Build an environment as `single`, for one user alone.

    Raises:
        OptionError: as for `single`.
    """
    return gym.make(env_id, disable_env_checker=True, **_checked(env_id, arguments, False))


def vector(env_id: str, arguments: str, size: int) -> Any:
    """Return a vector of `size` environments by id and JSON arguments; finished episodes wait where it supports that.

    Raises:
        OptionError: as for `single`, or for an environment without a vector form.
    """
    given = _checked(env_id, arguments, True)
    creator: Any = load_env_creator(_entry_point(env_id, True))
    if hasattr(creator, "own_engine"):
        given = {"engine": creator.own_engine, "autoreset_mode": AutoresetMode.DISABLED, **given}
    return gym.make_vec(env_id, size, vectorization_mode="vector_entry_point", **given)


@functools.lru_cache(maxsize=KEPT)
def vector_of_one(env_id: str, arguments: str, size: int = 1) -> Any:
    """Build a vector of one environment, to try arguments and disturbances on; a few are kept."""
    return vector(env_id, arguments, size)


def drawing(env_id: str, kwargs: Mapping[str, Any], width: int) -> Any:
    """Build a separate environment that renders frames `width` pixels wide, with a height of three quarters.

    Raises:
        OptionError: as for `single`, or if its engine cannot render.
    """
    given = {"width": width, "height": 3 * width // 4, **_checked(env_id, json.dumps(kwargs), False)}
    return gym.make(env_id, disable_env_checker=True, render_mode="rgb_array", **given)


def _class(env_id: str) -> Any:
    creator: Any = load_env_creator(_entry_point(env_id, False))
    if not hasattr(creator, "metrics_spec") and hasattr(creator, "tracking"):
        warn(f"attribute `tracking` of {creator.__name__}", "`metrics_spec`")
        creator.metrics_spec = creator.tracking
    if not hasattr(creator, "metrics_spec"):
        raise OptionError("env_id", env_id, "an environment of artde_gym")
    return creator


def _checked(env_id: str, arguments: str, vectorized: bool) -> dict[str, Any]:
    known, given = arguments_of(env_id, vectorized), json.loads(arguments)
    known = {name: argument for name, argument in known.items() if name != "render_mode"}  # set by `drawing`
    for name in given:
        if name not in known:
            raise OptionError(f"argument of {env_id}", name, suggest_names(name, known))
    return given


def _entry_point(env_id: str, vectorized: bool) -> str:
    try:
        spec = gym.spec(env_id)
    except (gym.error.Error, ImportError):
        raise UnknownNameError("environment", env_id, suggest_names(env_id, ours())) from None
    if not vectorized:
        return str(spec.entry_point)
    if spec.vector_entry_point is None:
        able = [name for name in ours() if gym.spec(name).vector_entry_point]
        raise OptionError("environment to be vectorized", env_id, ", ".join(able))
    return str(spec.vector_entry_point)
