"""Names of environments and controllers, as strings that are resolved when used.

Nothing here imports an environment or a controller; a name is looked up the way Gymnasium looks up an environment id.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import gymnasium as gym

from artde_gym.errors import OptionError, UnknownNameError, among
from artde_gym.kit import ROBOTS


@dataclasses.dataclass(frozen=True)
class ControllerSpec:
    """A controller by name: `entry_point` is "module:function", called as function(env, **kwargs).

    `search`, in the same form and called the same way, gives the gains that tuning may change; None if there are none.
    """

    name: str
    entry_point: str
    kwargs: Mapping[str, Any]
    text: str
    search: str | None = None


class GainRange(NamedTuple):
    """Where to look for a gain: from `start`, between `low` and `high`, on a logarithmic scale; all above zero."""

    start: float
    low: float
    high: float


_controllers: dict[str, ControllerSpec] = {}
_own: set[str] = set()
"""Names of the controllers that this project brings."""

REPLACEABLE = "preset"
"""The one fixed argument that an override may replace: it says from which gains to start, not which law it is."""


def register_controller(
    name: str, entry_point: str, *, text: str = "", search: str | None = None, **kwargs: Any
) -> None:
    """Make `name` known to `controllers.make`, to `evaluate` and to the command line.

    Args:
        name: as users will write it.
        entry_point: "module:function"; the function is called as function(env, **kwargs, **overrides) and returns a
            policy with Stable-Baselines3's `predict`.
        text: one line for listings.
        search: "module:function" for `artde-gym tune`; called as function(env, **kwargs), it returns a mapping from
            gains to `GainRange`.
        kwargs: fixed arguments of the function, which no override replaces (but for a `preset`).

    Raises:
        OptionError: for a name that is no word, or that of a controller of this project.
        UnknownNameError: if an entry point is not of that form.
    """
    if not (isinstance(name, str) and name):
        raise OptionError("name of a controller", name, "a word")
    for field, point in (("entry_point", entry_point), ("search", search)):
        if point is not None and not _is_entry_point(point):
            raise UnknownNameError(field, point, '"module:function"')
    spec = ControllerSpec(name, entry_point, dict(kwargs), text, search)
    if name in _own and _controllers[name] != spec:
        raise OptionError("name of a controller", name, f"a new name; these are taken: {', '.join(sorted(_own))}")
    register_spec(spec)


def _is_entry_point(point: object) -> bool:
    return isinstance(point, str) and len(parts := point.split(":")) == 2 and all(parts)


def register_spec(spec: ControllerSpec) -> None:
    """Make a controller known that another process has registered."""
    _controllers[spec.name] = spec


def registered_controllers() -> dict[str, ControllerSpec]:
    """All known controllers by name."""
    return dict(_controllers)


def make_controller(name: str, env: Any, /, **overrides: Any) -> Any:
    """Build the controller called `name` for an environment; `overrides` replace its gains, preset and options.

    Raises:
        UnknownNameError: if no controller has this name, or its entry point names nothing that can be imported.
        OptionError: for arguments that it does not take or that its name has fixed, or if it makes no policy.
    """
    known = _known(name)
    for fixed in known.kwargs.keys() & overrides.keys() - {REPLACEABLE}:
        allowed = f"its gains, `preset` and options; {name!r} stands for {fixed} = {known.kwargs[fixed]!r}"
        raise OptionError(f"gains of {name!r}", {fixed: overrides[fixed]}, allowed)
    make, arguments = _imported(name, known.entry_point), {**known.kwargs, **overrides}
    try:
        inspect.signature(make).bind(env, **arguments)
    except TypeError as error:
        raise OptionError(f"gains of {name!r}", overrides, f"arguments of {known.entry_point} ({error})") from error
    policy = make(env, **arguments)
    if not hasattr(policy, "predict"):
        raise OptionError(f"result of {known.entry_point}", policy, f"an object with `predict`, to be {name!r}")
    return policy


def search_space(name: str, env: Any) -> dict[str, GainRange]:
    """The gains of the controller called `name` that tuning may change, for the robot of an environment.

    Raises:
        UnknownNameError: if no controller has this name, its gains have no ranges, or `search` cannot be imported.
    """
    known = _known(name)
    if known.search is None:
        tunable = [other for other, spec in _controllers.items() if spec.search is not None]
        raise UnknownNameError("controller to be tuned", name, among(name, tunable))
    return dict(_imported(name, known.search)(env, **known.kwargs))


def _known(name: str) -> ControllerSpec:
    if name not in _controllers:
        raise UnknownNameError("controller", name, among(name, _controllers))
    return _controllers[name]


def _imported(name: str, entry_point: str) -> Callable[..., Any]:
    """The function behind a controller.

    Raises:
        UnknownNameError: if it cannot be imported.
    """
    try:
        found = resolved(entry_point)
    except (ImportError, AttributeError) as error:
        allowed = f'"module:function" of what can be imported ({error})'
        raise UnknownNameError(f"entry point of {name!r}", entry_point, allowed) from error
    if not callable(found):
        raise UnknownNameError(f"entry point of {name!r}", entry_point, '"module:function" of a function or class')
    return found


def resolved(entry_point: str) -> Callable[..., Any]:
    """The function that an entry point "module:function" names."""
    module, function = entry_point.split(":")
    return getattr(importlib.import_module(module), function)


def register_all() -> None:
    """Register what all robots and this project bring; called once, by `import artde_gym`."""
    for kit in ROBOTS.values():
        for entry in kit.environments:
            gym.register(id=entry.env_id, entry_point=entry.entry_point, vector_entry_point=entry.vector_entry_point)
    register_laws()


def register_laws() -> None:
    """Register the controllers that this project brings."""

    def law(name: str, text: str, **kwargs: Any) -> None:
        search = "controllers.robots:search_space"
        register_controller(name, "controllers.robots:make_for_robot", text=text, search=search, **kwargs)

    law("tde", "time-delay estimation", law="tde")
    law("atde", "TDE + one adaptive gain", law="atde")
    law("artde", "TDE + adaptive-robust term, as printed in the thesis", law="artde")
    law("artde-robust", "ARTDE with bounded gains", law="artde", preset="robust")
    law("pid", "PID; biped: equal to TDE, quadrotor: positional, in both loops", law="pid")
    law("tde+c", "TDE + robust term of constant gain (ablation)", law="tde+c")
    law("tde+kd", "TDE at the stiffer gains equivalent to it (ablation)", law="tde+kd")
    law("asmc", "quadrotor: adaptive sliding mode (a law of ours)", law="asmc")
    law("indi", "quadrotor: incremental nonlinear dynamic inversion", law="indi")
    law("geometric", "quadrotor: geometric control on SE(3), with an integral", law="geometric")
    register_controller(
        "computed-torque",
        "controllers.model_based:make_computed_torque",
        text="biped: feedback linearisation with the nominal model (upper reference)",
        search="controllers.model_based:search_space",
    )
    register_controller(
        "tde+balance",
        "baselines.saved:make_shipped",
        text="biped: TDE + a linear balance law of 28 gains that CMA-ES has tuned under pushes",
        policies=dict.fromkeys(("BipedPush-v0", "BipedWalk-Payload-v0"), "biped-balance"),
    )
    register_controller(
        "tde+ppo",
        "baselines.saved:make_shipped",
        text="TDE + a residual that reinforcement learning (PPO) has trained, one for each environment",
        policies={
            "BipedPush-v0": "biped-push",
            "BipedWalk-Payload-v0": "biped-walk",
            "QuadInfinity-Payload-v0": "quadrotor-gale",
        },
    )
    _own.update(_controllers)
