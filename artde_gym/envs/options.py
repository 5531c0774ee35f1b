"""Reset options that all environments understand."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

from artde_gym.disturbances import Disturbances
from artde_gym.errors import OptionError
from artde_gym.scenarios import scenario


def warn_of_idle(disturbances: Disturbances, duration: float) -> None:
    """Warn of disturbances that were asked for and can never happen in an episode of `duration` seconds."""
    for text in disturbances.idle(duration):
        warnings.warn(text, stacklevel=5)  # where gymnasium.make was called


def disturbances_in(options: Mapping[str, Any], env: Any) -> Any:
    """The disturbances that reset options ask for, as they are given or those of a scenario; None if they do not.

    Raises:
        OptionError: for an unknown option, or a scenario that needs other arguments than the environment has.
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
