"""Laws as controllers by name."""

from __future__ import annotations

import dataclasses
from typing import Any

from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.registration import ControllerSpec, register_controller
from controllers.law_spec import LawSpec
from controllers.law_table import LAWS, find_law

MAKE, TUNE = "controllers.robots:make_for_robot", "controllers.robots:tuning_space"


def law_controller(name: str, text: str, **kwargs: Any) -> ControllerSpec:
    """Return the controller of a law, `law=` by name, at its own presets or one of them, `preset=`.

    A package lists it in its entry points `artde_gym.controllers`; its own law has the name "module:object".
    """
    return ControllerSpec(name, MAKE, kwargs, text, TUNE)


def register_law(name: str, law: str) -> None:
    """Make a law of your own a controller on every robot that has presets for it or for the law that it is like.

    Args:
        name: name for users, as in `artde_gym.register_controller`.
        law: "module:object" of its `LawSpec`, which worker processes import, too.

    Raises:
        OptionError: if the name is taken, the object is no `LawSpec` of a law with gains, or these have further fields
            without defaults.
        UnknownNameError: if `law` has another form, or the law that it is like is unknown.
    """
    if ":" not in law:
        raise UnknownNameError("law", law, '"module:object"')
    spec = find_law(law)
    check_law(name, spec)
    register_controller(name, MAKE, text=spec.text, tuning_space=TUNE, law=law)


def check_law(name: str, spec: LawSpec) -> None:
    """Raise OptionError or UnknownNameError for a law that no preset fits."""
    if spec.gains is None:
        raise OptionError(f"gains of {name!r}", None, "a dataclass: a controller needs one")
    if spec.like is None:
        return
    if spec.like not in LAWS or (family := LAWS[spec.like].gains) is None:
        known = [one for one, other in LAWS.items() if other.gains is not None]
        raise UnknownNameError(f"law that {name!r} is like", spec.like, suggest_names(spec.like, known))
    shared = {one.name for one in dataclasses.fields(family)}
    for one in dataclasses.fields(spec.gains):
        if one.name not in shared and one.default is dataclasses.MISSING:
            problem = f"has no default, and no preset of {spec.like!r} has it"
            raise OptionError(f"gain of {name!r}", one.name, "give it a default", problem)
