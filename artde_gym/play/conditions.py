"""Disturbances that last for a whole episode and have one size, such as a wind, as sliders."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from artde_gym.arguments import check_number
from artde_gym.disturbances.kinds import DISTURBANCES, Parameter, in_order, parameters_of
from artde_gym.kit import PAYLOAD


def conditions_of(robot: str) -> list[str]:
    """Return the kinds that a robot supports and that one number sets."""
    return [
        kind.name
        for kind in in_order()
        if kind.shorthand in [one.name for one in kind.parameters_for(robot)]
        and not kind.multiple
        and kind.name != PAYLOAD
        and kind.honored_by(robot)
    ]


def condition_text(kind: str) -> dict[str, Any]:
    """Return what a page has to know of a kind."""
    spec, parameter = DISTURBANCES[kind], _sized(kind)
    unit = "" if parameter.unit in ("", "1") else parameter.unit
    return {
        "kind": kind,
        "text": f"{spec.text} {parameter.name}: {parameter.text}",
        "unit": unit,
        "low": parameter.low,
        "high": parameter.high,
        "integer": parameter.integer,
    }


def with_condition(given: Mapping[str, Any], kind: str, value: Any) -> dict[str, Any]:
    """Return disturbances with a kind at a size, or without it (None).

    Raises:
        OptionError: for a size that is not allowed.
    """
    others = {name: entry for name, entry in given.items() if name != kind}
    if value is None:
        return others
    spec, parameter = DISTURBANCES[kind], _sized(kind)
    low, high = parameter.low, parameter.high
    number = check_number(kind, value, low, high, f"{low:g} to {high:g}")
    kept = {name: one for name, one in parameters_of(kind, given.get(kind)).items() if name not in spec.one_of}
    return {**others, kind: {**kept, parameter.name: round(number) if parameter.integer else number}}


def parameter_of(kind: str, name: str | None) -> Parameter:
    """Return a parameter of a kind by name."""
    return next(one for one in DISTURBANCES[kind].parameters if one.name == name)


def _sized(kind: str) -> Parameter:
    """Return the parameter that a bare number sets."""
    return parameter_of(kind, DISTURBANCES[kind].shorthand)
