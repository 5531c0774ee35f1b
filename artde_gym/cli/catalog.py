"""Catalog of all registered entries as JSON-able data, for `list`."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

from artde_gym.disturbances import DISTURBANCES
from artde_gym.disturbances.kinds import ALL, allowed, other_defaults
from artde_gym.evaluation.environments import arguments_of, ours, robot_of
from artde_gym.kit import ROBOTS
from artde_gym.registration import registered_controllers
from artde_gym.scenarios import SCENARIOS
from artde_gym.sim.factory import ENGINES

Entries = list[dict[str, Any]]


def environments() -> Entries:
    """Return every environment with its arguments and defaults."""
    return [
        {
            "name": name,
            "robot": robot_of(name),
            "engines": engines(name),
            "arguments": {
                argument: None if parameter.default is inspect.Parameter.empty else parameter.default
                for argument, parameter in arguments_of(name).items()
            },
        }
        for name in ours()
    ]


def scenarios() -> Entries:
    """Return every scenario with its environment, arguments and disturbances."""
    return [
        {
            "name": entry.name,
            "text": entry.text,
            "environment": entry.env_id,
            "engines": engines(entry.env_id),
            "arguments": dict(entry.kwargs),
            "disturbances": dict(entry.disturbances),
            "thesis": entry.thesis,
        }
        for entry in SCENARIOS.values()
    ]


def controllers() -> Entries:
    """Return every controller with the gains of its presets by robot."""
    from controllers.drive import DRIVES  # with all laws behind it: only when it is asked for
    from controllers.presets import LOOPS, law_presets, named_gains
    from controllers.presets.units import unit_of

    found = []
    for name, spec in registered_controllers().items():
        law, wanted = spec.kwargs.get("law", name), spec.kwargs.get("preset")
        presets: Entries = []
        own_gains: dict[str, None] = {}
        for robot, drive in DRIVES.items():
            table = law_presets(drive, law)
            if wanted not in (None, *table):
                continue  # the name stands for a preset that the robot does not have
            names = list(table)
            for preset, entry in table.items():
                for loop in [getattr(entry.gains, field) for field in LOOPS if hasattr(entry.gains, field)] or [
                    entry.gains
                ]:
                    own_gains |= dict.fromkeys(named_gains(loop))
                presets.append({
                    "robot": robot,
                    "preset": preset,
                    "default": preset == (wanted or names[0]),
                    "source": entry.source,
                    "gains": {
                        gain: {"value": _plain(value), "unit": unit_of(gain)}
                        for gain, value in named_gains(entry.gains).items()
                    },
                })  # fmt: skip
        found.append(
            {
                "name": name,
                "text": spec.text,
                "entry_point": spec.entry_point,
                "gains": list(own_gains),
                "presets": presets,
            }
        )
    return found


def disturbances() -> Entries:
    """Return every kind of disturbance with the schema of its parameters."""
    return [
        {
            "name": kind.name,
            "text": kind.text,
            "robots": [robot for robot in ROBOTS if kind.honored_by(robot)],
            "list": kind.multiple,
            "bare_number": kind.shorthand,
            "choices": {
                robot: {
                    parameter.name: _words(parameter.choices, robot)
                    for parameter in kind.parameters
                    if parameter.size == 0
                }
                for robot in ROBOTS
                if kind.honored_by(robot)
            },
            "parameters": [
                {
                    "name": parameter.name,
                    "unit": parameter.unit,
                    "allowed": allowed(parameter),
                    "required": parameter.default is None,
                    "default": _plain(parameter.default),
                    "other_defaults": {
                        robot: _plain(value) for robot, value in other_defaults(kind, parameter).items()
                    },
                    "text": parameter.text,
                    **({} if parameter.requires is None else {"requires": parameter.requires}),
                }
                for parameter in kind.parameters
            ],
        }
        for kind in DISTURBANCES.values()
    ]


def frontiers() -> Entries:
    """Return every path with a default range in `frontier`."""
    return [
        {"name": path, "robot": robot, "environment": entry.env_id, **values._asdict()}
        for robot, kit in ROBOTS.items()
        for entry in kit.environments
        if (test := entry.frontier or kit.frontier) is not None
        for path, values in test.ranges.items()
    ]


def _words(words: tuple[str, ...] | str, robot: str) -> list[str]:
    """Return the allowed words of a parameter; sites and joints are the robot's."""
    if not isinstance(words, str):
        return list(words)
    kit = ROBOTS[robot]
    return list(kit.sites) if words == "site" else [*kit.joints, ALL]


TOPICS: dict[str, Callable[[], Entries]] = {
    "environments": environments,
    "scenarios": scenarios,
    "controllers": controllers,
    "disturbances": disturbances,
    "frontiers": frontiers,
}


def engines(env_id: str) -> list[str]:
    """Return the engines of an environment; "batch" stands for vector environments."""
    able = [*ENGINES] if "engine" in arguments_of(env_id) else []
    return [*able, *(["batch"] if gym.spec(env_id).vector_entry_point else [])]


def _plain(value: Any) -> Any:
    """Convert a gain or default to JSON: matrices and vectors to lists, infinities and NaN to words."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, (np.ndarray, tuple, list)):
        return [_plain(item) for item in np.asarray(value).tolist()]
    return value
