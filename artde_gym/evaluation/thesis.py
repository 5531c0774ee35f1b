"""What a publication reports of a scenario, as the robots' kits have it, to be printed beside ours."""

from __future__ import annotations

from typing import Any

from artde_gym.deprecation import warn
from artde_gym.kit import ROBOTS, Reported

_NOTHING = Reported("", {})


_FIELDS = {"TABLES": "table", "VALUES": "values", "TIME_TO_FALL": "time_to_fall"}
"""Old name of all tables -> field of `Reported`."""


def __getattr__(name: str) -> Any:
    """Answer to the names that the tables of all robots had once (PEP 562)."""
    if name not in _FIELDS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warn(f"artde_gym.evaluation.thesis.{name}", "artde_gym.kit.ROBOTS[robot].reported")
    known = {at: getattr(found, _FIELDS[name]) for kit in ROBOTS.values() for at, found in kit.reported.items()}
    return {at: value for at, value in known.items() if value}


def reported(scenario: str | None) -> Reported:
    """Return what is reported of a scenario by its name there; empty where nothing is."""
    known = {name: found for kit in ROBOTS.values() for name, found in kit.reported.items()}
    return known.get(scenario or "", _NOTHING)


def value(scenario: str | None, controller: str, metric: str, axis: str) -> float | None:
    """Return the reported number, or None where there is none."""
    return reported(scenario).values.get(controller, {}).get(metric, {}).get(axis)


def ending(scenario: str | None, controller: str) -> str:
    """Say how a reported episode ended, "" if there was none."""
    found = reported(scenario)
    if controller in found.time_to_fall:
        return f"falls at {found.time_to_fall[controller]:g}"
    return "no fall" if controller in found.values else ""
