"""Labels of controllers, and the registered controllers and policies that they stand for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation import canonical
from artde_gym.evaluation.rollout import Policy
from artde_gym.registration import ControllerSpec, registered_controllers

_LIST = "a list of names or policies, at least one"


def labeled(controllers: Any) -> dict[str, str | Policy]:
    """Return the controllers by label.

    Raises:
        OptionError: if there is no controller, a label is not text, or a label is given twice.
    """
    if isinstance(controllers, str) or not isinstance(controllers, Iterable):
        raise OptionError("controllers", controllers, _LIST)
    if isinstance(controllers, Mapping):
        pairs = list(controllers.items())
    else:
        pairs = [
            (item if isinstance(item, str) else getattr(item, "name", type(item).__name__), item)
            for item in controllers
        ]
    if not pairs:
        raise OptionError("controllers", controllers, _LIST)
    for label, _ in pairs:
        if not isinstance(label, str):
            raise OptionError("name of a controller", label, "text")
    if again := canonical.twice(label for label, _ in pairs):
        raise OptionError("controller", again, "pass a mapping to label each one", "is given twice")
    return dict(pairs)


def named_controllers(controllers: Any) -> dict[str, Policy | ControllerSpec]:
    """Return the controllers by label, names replaced by the registered controllers.

    Raises:
        UnknownNameError, OptionError: for an unknown name, or an object that is not a controller.
    """
    known = registered_controllers()
    named: dict[str, Policy | ControllerSpec] = {}
    for label, item in labeled(controllers).items():
        if isinstance(item, str):
            if item not in known:
                raise UnknownNameError("controller", item, suggest_names(item, known))
            named[label] = known[item]
        elif hasattr(item, "predict"):
            named[label] = item
        else:
            raise OptionError("controllers", item, "a registered name, or an object with `predict`")
    return named
