"""Registration of environments and controllers by name; names are resolved when used.

Nothing here imports an environment or a controller; names are looked up as Gymnasium looks up environment ids.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import gymnasium as gym

from artde_gym.arguments import check_name
from artde_gym.deprecation import renamed_arguments
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.kit import ROBOTS
from artde_gym.registry import Registry


@dataclasses.dataclass(frozen=True)
class ControllerSpec:
    """A controller by name: `entry_point` is "module:function", called as function(env, **kwargs).

    `tuning_space`, in the same form and called the same way, returns the tunable gains; None if there are none.
    """

    name: str
    entry_point: str
    kwargs: Mapping[str, Any]
    text: str
    tuning_space: str | None = None


class GainRange(NamedTuple):
    """Search range of a gain: from `initial`, between `low` and `high`, on a logarithmic scale; all above zero."""

    initial: float
    low: float
    high: float


RESERVED = ("none", "matched")
"""Words for no controller below a residual, and for the second pass of a multiverse."""

_brought: Registry[ControllerSpec] = Registry(
    "controller", "artde_gym.controllers", lambda specs: {spec.name: spec for spec in specs}, reserved=RESERVED
)
"""Controllers of this project and of installed plug-ins; each entry point names a sequence of specs."""
_controllers: dict[str, ControllerSpec] = {}
"""Controllers registered at run time."""

REPLACEABLE = "preset"
"""The only fixed argument that an override may replace: it selects the initial gains, not the law."""


@renamed_arguments({"search": "tuning_space"})
def register_controller(
    name: str, entry_point: str, *, text: str = "", tuning_space: str | None = None, **kwargs: Any
) -> None:
    """Make `name` known to `controllers.make`, to `evaluate` and to the command line.

    Args:
        name: name for users.
        entry_point: "module:function"; the function is called as function(env, **kwargs, **overrides) and returns a
            policy with Stable-Baselines3's `predict`.
        text: one line for listings.
        tuning_space: "module:function" for `artde-gym tune`; called as function(env, **kwargs), with a `preset` where
            its caller has one, it returns a mapping from gains to `GainRange`.
        kwargs: fixed arguments of the function, which overrides cannot replace (except a `preset`).

    Raises:
        OptionError: if the name is invalid or belongs to a controller of this project or of a plug-in.
        UnknownNameError: if an entry point does not have that form.
    """
    check_name("name of a controller", name, RESERVED)
    for field, point in (("entry_point", entry_point), ("tuning_space", tuning_space)):
        if point is not None and not _is_entry_point(point):
            raise UnknownNameError(field, point, '"module:function"')
    spec = ControllerSpec(name, entry_point, dict(kwargs), text, tuning_space)
    if _brought.get(name, spec) != spec:
        raise OptionError("name of a controller", name, f"any name except {', '.join(sorted(_brought))}")
    register_spec(spec)


def _is_entry_point(point: object) -> bool:
    return isinstance(point, str) and len(parts := point.split(":")) == 2 and all(parts)


def register_spec(spec: ControllerSpec) -> None:
    """Register a controller that another process has registered."""
    _controllers[spec.name] = spec


def registered_controllers() -> dict[str, ControllerSpec]:
    """Return all known controllers by name."""
    return {**_brought, **_controllers}


def make_controller(name: str, env: Any, /, **overrides: Any) -> Any:
    """Build the controller called `name` for an environment; `overrides` replace its gains, preset and options.

    Raises:
        UnknownNameError: if no controller has this name, or its entry point cannot be imported.
        OptionError: for arguments that it does not take or that its name fixes, or if it returns no policy.
    """
    known = _known(name)
    for fixed in known.kwargs.keys() & overrides.keys() - {REPLACEABLE}:
        problem = f"cannot be changed: the name stands for {fixed} = {known.kwargs[fixed]!r}"
        todo = "choose another controller, or change its gains, `preset` and options"
        raise OptionError(f"gains of {name!r}", {fixed: overrides[fixed]}, todo, problem)
    make, arguments = _imported(name, known.entry_point), {**known.kwargs, **overrides}
    try:
        inspect.signature(make).bind(env, **arguments)
    except TypeError as error:
        raise OptionError(f"gains of {name!r}", overrides, f"arguments of {known.entry_point} ({error})") from error
    policy = make(env, **arguments)
    if not hasattr(policy, "predict"):
        raise OptionError(f"result of {known.entry_point}", policy, f"an object with `predict`, to be {name!r}")
    return policy


def tuning_space(name: str, env: Any, preset: str | None = None) -> dict[str, GainRange]:
    """Return the tunable gains of the controller called `name` for the robot of an environment.

    Args:
        name: name of a controller.
        env: the environment that it drives.
        preset: preset whose gains are the initial ones; None for the controller's own.

    Raises:
        UnknownNameError: if no controller has this name, it has no tunable gains, or `tuning_space` cannot be
            imported.
    """
    known = _known(name)
    if known.tuning_space is None:
        tunable = [other for other, spec in registered_controllers().items() if spec.tuning_space is not None]
        raise UnknownNameError("controller to be tuned", name, suggest_names(name, tunable))
    selected = {} if preset is None else {REPLACEABLE: preset}
    return dict(_imported(name, known.tuning_space)(env, **{**known.kwargs, **selected}))


def _known(name: str) -> ControllerSpec:
    known = registered_controllers()
    if name not in known:
        raise UnknownNameError("controller", name, suggest_names(name, known))
    return known[name]


def _imported(name: str, entry_point: str) -> Callable[..., Any]:
    """Import the function of a controller.

    Raises:
        UnknownNameError: if it cannot be imported.
    """
    try:
        found = resolved(entry_point)
    except (ImportError, AttributeError) as error:
        todo = 'give a "module:function" that can'
        raise UnknownNameError(
            f"entry point of {name!r}", entry_point, todo, f"cannot be imported ({error})"
        ) from error
    if not callable(found):
        raise UnknownNameError(f"entry point of {name!r}", entry_point, '"module:function" of a function or class')
    return found


def resolved(entry_point: str) -> Callable[..., Any]:
    """Return the function that an entry point "module:function" names."""
    module, function = entry_point.split(":")
    return getattr(importlib.import_module(module), function)


def register_all() -> None:
    """Register the environments of all robots; called once, by `import artde_gym`."""
    for kit in ROBOTS.values():
        for entry in kit.environments:
            gym.register(id=entry.env_id, entry_point=entry.entry_point, vector_entry_point=entry.vector_entry_point)
