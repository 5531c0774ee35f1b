"""Names of environments and controllers, as strings that are resolved when used.

Nothing here imports an environment or a controller; a name is looked up the way Gymnasium looks up an environment id.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Mapping
from typing import Any

import gymnasium as gym

from artde_gym.errors import UnknownNameError, among


@dataclasses.dataclass(frozen=True)
class ControllerSpec:
    """A controller by name: `entry_point` is "module:function", called as function(env, **kwargs)."""

    name: str
    entry_point: str
    kwargs: Mapping[str, Any]
    text: str


_controllers: dict[str, ControllerSpec] = {}


def register_controller(name: str, entry_point: str, *, text: str = "", **kwargs: Any) -> None:
    """Make `name` known to `controllers.make`, to `evaluate` and to the command line.

    Args:
        name: as users will write it.
        entry_point: "module:function"; the function is called as function(env, **kwargs, **overrides) and returns a
            policy with Stable-Baselines3's `predict`.
        text: one line for listings.
        kwargs: fixed arguments of the function.

    Raises:
        UnknownNameError: if the entry point is not of that form.
    """
    if entry_point.count(":") != 1:
        raise UnknownNameError("entry_point", entry_point, '"module:function"')
    register_spec(ControllerSpec(name, entry_point, dict(kwargs), text))


def register_spec(spec: ControllerSpec) -> None:
    """Make a controller known that another process has registered."""
    _controllers[spec.name] = spec


def registered_controllers() -> dict[str, ControllerSpec]:
    """All known controllers by name."""
    return dict(_controllers)


def make_controller(name: str, env: Any, **overrides: Any) -> Any:
    """Build the controller called `name` for an environment; `overrides` replace its arguments and gains.

    Raises:
        UnknownNameError: if no controller has this name.
    """
    known = _controllers.get(name)
    if known is None:
        raise UnknownNameError("controller", name, among(name, _controllers))
    module, function = known.entry_point.split(":")
    return getattr(importlib.import_module(module), function)(env, **{**known.kwargs, **overrides})


def register_all() -> None:
    """Register what this project brings; called once, by `import artde_gym`."""
    gym.register(id="BipedWalk-Payload-v0", entry_point="artde_gym.envs.biped_walk:BipedWalkPayloadEnv")
    gym.register(id="BipedPush-v0", entry_point="artde_gym.envs.biped_push:BipedPushEnv")
    gym.register(
        id="QuadInfinity-Payload-v0",
        entry_point="artde_gym.envs.quadrotor:QuadInfinityPayloadEnv",
        vector_entry_point="artde_gym.envs.quadrotor_batch:QuadInfinityPayloadVectorEnv",
    )
    law = "controllers.robots:make_for_robot"
    register_controller("tde", law, law="tde", text="time-delay estimation")
    register_controller("atde", law, law="atde", text="TDE + one adaptive gain")
    register_controller("artde", law, law="artde", text="TDE + adaptive-robust term, as printed in the thesis")
    register_controller("artde-robust", law, law="artde", preset="robust", text="ARTDE with bounded gains")
    register_controller("pid", law, law="pid", text="PID; biped: equal to TDE, quadrotor: a tuned cascade")
    register_controller("tde+c", law, law="tde+c", text="TDE + robust term of constant gain (ablation)")
    register_controller("tde+kd", law, law="tde+kd", text="TDE at the stiffer gains equivalent to it (ablation)")
    register_controller("asmc", law, law="asmc", text="quadrotor: adaptive sliding mode (a law of ours)")
    register_controller("indi", law, law="indi", text="quadrotor: incremental nonlinear dynamic inversion")
    register_controller("geometric", law, law="geometric", text="quadrotor: geometric control on SE(3), with integral")
    register_controller(
        "computed-torque",
        "controllers.model_based:make_computed_torque",
        text="biped: feedback linearisation with the nominal model (upper reference)",
    )
