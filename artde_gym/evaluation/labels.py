"""Labels: the names under which controllers are listed, and what they stand for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation import canonical
from artde_gym.evaluation.rollout import Policy
from artde_gym.registration import ControllerSpec, registered_controllers

_LIST = "a list of names or policies, at least one"


def labelled(controllers: Any) -> dict[str, str | Policy]:
    """Give each controller the name under which it is listed.

    Raises:
        OptionError: for no controller, a name that is no word, or one that comes twice.
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
            raise OptionError("name of a controller", label, "a word")
    if again := canonical.twice(label for label, _ in pairs):
        raise OptionError("controllers", again, "each name once; give a mapping to tell two of one name apart")
    return dict(pairs)


def named_controllers(controllers: Any) -> dict[str, Policy | ControllerSpec]:
    """Find controllers by the name under which they are listed, names replaced by what they stand for.

    Raises:
        UnknownNameError, OptionError: for an unknown name, or what is no controller.
    """
    known = registered_controllers()
    named: dict[str, Policy | ControllerSpec] = {}
    for label, item in labelled(controllers).items():
        if isinstance(item, str):
            if item not in known:
                raise UnknownNameError("controller", item, suggest_names(item, known))
            named[label] = known[item]
        elif hasattr(item, "predict"):
            named[label] = item
        else:
            raise OptionError("controllers", item, "a registered name, or an object with `predict`")
    return named
