"""Gains that override a preset's: validation, and building controllers with them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation.rollout import Policy
from artde_gym.registration import ControllerSpec, make_controller, register_spec


def checked_gains(gains: Any, named: Collection[str]) -> dict[str, dict[str, Any]]:
    """Validate gains and return the given ones of each controller.

    Raises:
        UnknownNameError: for gains of a controller that is not listed.
        OptionError: if they are not a mapping of controllers to mappings of their gains.
    """
    if gains is None:
        return {}
    if not isinstance(gains, Mapping):
        raise OptionError("gains", gains, "a mapping of controllers to mappings of gains")
    for name, values in gains.items():
        if name not in named:
            raise UnknownNameError("gains", name, suggest_names(name, named))
        if not (isinstance(values, Mapping) and all(isinstance(gain, str) for gain in values)):
            raise OptionError(f"gains of {name!r}", values, "a mapping of gains")
    return {name: dict(values) for name, values in gains.items()}


def policy_for(item: Policy | ControllerSpec, env: Any, gains: dict[str, Any]) -> Policy:
    """Return the policy for an environment: a registered controller built for it, or the policy itself.

    Raises:
        OptionError: for gains of a policy.
        GainError: for an invalid gain.
    """
    if isinstance(item, ControllerSpec):
        register_spec(item)  # a worker otherwise knows only this project's own registrations
        return make_controller(item.name, env, **gains)
    if gains:
        raise OptionError("gains", gains, "set them on the policy object", "belong to no registered name")
    return item
