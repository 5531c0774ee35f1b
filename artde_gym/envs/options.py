"""Reset options of all environments."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Mapping
from typing import Any

from artde_gym.disturbances import Disturbances
from artde_gym.errors import OptionError
from artde_gym.scenarios import scenario


def warn_of_idle(disturbances: Disturbances, duration: float) -> None:
    """Warn of disturbances that can never happen in an episode of `duration` seconds."""
    for text in disturbances.idle(duration):
        warnings.warn(text, stacklevel=user_level())


def user_level() -> int:
    """Return the `stacklevel` of a warning that points at the user's line, which calls `gym.make` or `reset`."""
    frame, level = inspect.currentframe(), 0
    while frame is not None and frame.f_globals.get("__name__", "").split(".")[0] in ("artde_gym", "gymnasium"):
        frame, level = frame.f_back, level + 1
    return level


def disturbances_in(options: Mapping[str, Any], env: Any) -> Any:
    """Return the disturbances in reset options, given directly or by a scenario; None if there are none.

    Raises:
        OptionError: for an unknown option, or a scenario whose arguments differ from the environment's.
        UnknownNameError: for an unknown scenario.
    """
    if not isinstance(options, Mapping):
        raise OptionError("reset options", options, "a mapping with 'disturbances', 'scenario'")
    for key in options:
        if key not in ("disturbances", "scenario"):
            raise OptionError("reset option", key, "'disturbances', 'scenario'")
    disturbances = None
    if options.get("scenario") is not None:
        entry = scenario(options["scenario"])
        for name, value in entry.kwargs.items():
            if getattr(env, name, None) != value:
                raise OptionError(f"{name} of this environment", getattr(env, name, None), f"{value!r} in {entry.name}")
        disturbances = entry.disturbances
    given = options.get("disturbances")
    return disturbances if given is None else given
