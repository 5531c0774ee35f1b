"""The standard test of a frontier: each robot's own, see `artde_gym.kit.FrontierTest`."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from artde_gym.errors import OptionError
from artde_gym.evaluation.environments import robot_of
from artde_gym.kit import ROBOTS, FrontierTest
from artde_gym.scenarios import SCENARIOS


def standard_for(env_id: str) -> FrontierTest | None:
    """Return the standard test of an environment, or of its robot, if there is one."""
    kit = ROBOTS[robot_of(env_id)]
    own = (entry.frontier for entry in kit.environments if entry.env_id == env_id)
    return next(own, None) or kit.frontier


def standard_test(env_id: str, path: str, arguments: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Disturbances and arguments of the standard test in which `path` is varied; see `frontier`.

    Raises:
        OptionError: if the environment's robot has no standard test, or the episode ends before the push.
    """
    standard = standard_for(env_id)
    if standard is None:
        raise OptionError("disturbances", None, f"a mapping: {env_id} has no standard test")
    arguments = dict(arguments) if path == "duration" else {"duration": standard.duration, **arguments}
    disturbances: dict[str, Any] = copy.deepcopy(dict(SCENARIOS[standard.scenario].disturbances))
    kind = path.split(".")[0]
    if kind in standard.repeated:
        disturbances[kind] = copy.deepcopy(standard.repeated[kind])
    duration, last = arguments.get("duration", standard.duration), standard.when[1]
    if kind == "push" and isinstance(duration, (int, float)) and duration < last + 1.0:
        raise OptionError("duration", duration, f"at least {last + 1:g} s, as the push comes until {last:g} s")
    return disturbances, arguments
