"""The standard test of a frontier, defined by each robot; see `artde_gym.kit.FrontierTest`."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from artde_gym.errors import OptionError
from artde_gym.evaluation.environments import robot_of
from artde_gym.kit import ROBOTS, FrontierTest
from artde_gym.scenarios import scenario as find_scenario


def standard_for(env_id: str) -> FrontierTest | None:
    """Return the standard test of an environment, or of its robot, or None."""
    kit = ROBOTS[robot_of(env_id)]
    own = (entry.frontier for entry in kit.environments if entry.env_id == env_id)
    return next(own, None) or kit.frontier


def standard_test(
    env_id: str, path: str, arguments: Mapping[str, Any], scenario: str | None = None
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Disturbances and arguments of the standard test in which `path` is varied; see `frontier`.

    Args:
        env_id: of the environment.
        path: that is varied.
        arguments: of the environment, which are kept.
        scenario: in place of the test's own.

    Raises:
        UnknownNameError: for an unknown scenario.
        OptionError: if the environment's robot has no standard test, the scenario is another robot's, or the episode
            ends before the push.
    """
    standard = standard_for(env_id)
    if standard is None:
        raise OptionError("env_id", env_id, "pass `disturbances`", "has no standard test")
    test = find_scenario(scenario or standard.scenario)
    if robot_of(test.env_id) != robot_of(env_id):
        raise OptionError("scenario", scenario, f"one of the robot in {env_id}")
    own = standard.ranges[path].duration if path in standard.ranges else None
    usual = {} if path == "duration" else {"duration": own or standard.duration}
    arguments = {**usual, **(test.kwargs if scenario else {}), **arguments}
    disturbances: dict[str, Any] = copy.deepcopy(dict(test.disturbances))
    kind = path.split(".")[0]
    if kind in disturbances and path not in standard.ranges:  # what is varied would not complete the standard's entry
        return disturbances, arguments
    if kind in standard.repeated:
        disturbances[kind] = copy.deepcopy(standard.repeated[kind])
    duration, last = arguments.get("duration", standard.duration), standard.when[1]
    if kind == "push" and isinstance(duration, (int, float)) and duration < last + 1.0:
        raise OptionError("duration", duration, f"at least {last + 1:g} s, as the push comes until {last:g} s")
    return disturbances, arguments
