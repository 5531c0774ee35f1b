"""Gains in place of a preset's: checked, and given to the controllers that they are for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation.rollout import Policy
from artde_gym.registration import ControllerSpec, make_controller, register_spec


def checked_gains(gains: Any, named: Collection[str]) -> dict[str, dict[str, Any]]:
    """Check gains, and return those of each controller that has any given in a dictionary of its own.

    Raises:
        UnknownNameError: for gains of a controller that is not among those named.
        OptionError: if they are not a mapping of controllers to mappings of their gains.
    """
    if gains is None:
        return {}
    if not isinstance(gains, Mapping):
        raise OptionError("gains", gains, "a mapping of controllers to mappings of their gains")
    for name, values in gains.items():
        if name not in named:
            raise UnknownNameError("gains", name, suggest_names(name, named))
        if not (isinstance(values, Mapping) and all(isinstance(gain, str) for gain in values)):
            raise OptionError(f"gains of {name!r}", values, "a mapping of its gains")
    return {name: dict(values) for name, values in gains.items()}


def policy_for(item: Policy | ControllerSpec, env: Any, gains: dict[str, Any]) -> Policy:
    """Build what drives an environment: a registered controller made for it, or the policy itself.

    Raises:
        OptionError: for gains of a policy.
        GainError: for a bad gain.
    """
    if isinstance(item, ControllerSpec):
        register_spec(item)  # a worker knows only what this project registers itself
        return make_controller(item.name, env, **gains)
    if gains:
        raise OptionError("gains", gains, "gains of registered names; a policy object has its own")
    return item
