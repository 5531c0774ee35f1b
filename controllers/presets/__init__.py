"""Gains of every law for every robot, each with its source."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from artde_gym.deprecation import warn
from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.registration import GainRange
from controllers.drive import DRIVES, Preset
from controllers.law_table import GAINS
from controllers.laws.errors import GainError

LOOPS = {"position": "p", "attitude": "q"}
"""Fields of a cascade's gains that hold the gains of a loop, and the suffix by which an override names one of those."""


def __getattr__(name: str) -> Any:
    """Answer to the name that all presets had once (PEP 562)."""
    if name != "PRESETS":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warn("controllers.presets.PRESETS", "controllers.drive.DRIVES[robot].presets")
    return {robot: dict(drive.presets) for robot, drive in DRIVES.items()}


def preset_gains(robot: str, law: str, preset: str | None, joints: int, overrides: dict[str, Any]) -> Any:
    """Gains of `law` for `robot` with so many `joints`, some of them replaced.

    Args:
        robot: by the environment's `robot_name`.
        law: by name.
        preset: by name; None for the law's default.
        joints: number of components that a gain with one value each must have.
        overrides: name -> value; of a cascade, `k_p_p` is the position loop's k_p and `k_p_q` the attitude loop's.

    Raises:
        UnknownNameError: if the robot has no such law, or the law no such preset.
        GainError: for a gain that the law does not have, or a value that it does not allow.
    """
    if robot in DRIVES:
        gains = _preset(robot, law, preset).gains
        flat = named_gains(gains)
        for name in overrides:
            if name not in flat:
                raise GainError(f"of {law!r}", name, suggest_names(name, flat))
        gains = _replaced(gains, overrides)
    else:
        gains = _given(robot, law, preset, overrides)
    for name, value in named_gains(gains).items():
        if np.ndim(value) > 0 and np.shape(value)[0] != joints:
            raise GainError(name, value, f"one number, or one for each of the {joints} joints")
    return gains


def gain_ranges(robot: str, law: str, preset: str | None) -> dict[str, GainRange]:
    """Where tuning may look for the gains of a law, from a preset on.

    Raises:
        UnknownNameError: as `preset_gains`, or for a law whose gains nobody tunes.
    """
    gains = named_gains(_preset(robot, law, preset).gains)
    known = DRIVES[robot].ranges
    if law not in known:
        raise UnknownNameError(f"controller of {robot!r} to be tuned", law, suggest_names(law, known))
    return {name: GainRange(gains[name], low, high) for name, (low, high) in known[law].items()}


def _given(robot: str, law: str, preset: str | None, gains: dict[str, Any]) -> Any:
    """Gains of a robot without presets, all of them given."""
    if preset is not None:
        raise UnknownNameError(f"preset of {law!r} for {robot!r}", preset, "none: the robot has no presets")
    if law not in GAINS:
        raise UnknownNameError(f"controller of {robot!r}", law, suggest_names(law, GAINS))
    fields = {field.name: field for field in dataclasses.fields(GAINS[law])}
    for name in gains:
        if name not in fields:
            raise GainError(f"of {law!r}", name, suggest_names(name, fields))
    needed = [name for name, field in fields.items() if field.default is dataclasses.MISSING]
    if missing := [name for name in needed if name not in gains]:
        allowed = f"{', '.join(needed)}, all of them: {robot!r} has no presets, for which its plug-in needs a Drive"
        raise GainError(f"of {law!r} not given", ", ".join(missing), allowed)
    return GAINS[law](**gains)


def _preset(robot: str, law: str, preset: str | None) -> Preset:
    if robot not in DRIVES:
        raise UnknownNameError("robot with presets", robot, suggest_names(robot, DRIVES))
    known = DRIVES[robot].presets
    laws = list(dict.fromkeys(name for name, _ in known))
    if law not in laws:
        raise UnknownNameError(f"controller of {robot!r}", law, suggest_names(law, laws) if laws else "none yet")
    names = [name for own, name in known if own == law]
    if preset is not None and preset not in names:
        raise UnknownNameError(f"preset of {law!r} for {robot!r}", preset, ", ".join(map(repr, names)))
    return known[law, preset or names[0]]


def named_gains(gains: Any) -> dict[str, Any]:
    """All gains by the name that an override uses."""
    named: dict[str, Any] = {}
    for field in dataclasses.fields(gains):
        value = getattr(gains, field.name)
        if field.name in LOOPS:
            named |= {f"{name}_{LOOPS[field.name]}": inner for name, inner in named_gains(value).items()}
        else:
            named[field.name] = value
    return named


def _replaced(gains: Any, overrides: dict[str, Any]) -> Any:
    """The gains with some replaced, by the names of `_flat`."""
    changes: dict[str, Any] = {}
    for field in dataclasses.fields(gains):
        if field.name in LOOPS:
            loop, suffix = getattr(gains, field.name), f"_{LOOPS[field.name]}"
            own = {f.name: overrides[f.name + suffix] for f in dataclasses.fields(loop) if f.name + suffix in overrides}
            try:
                changes[field.name] = dataclasses.replace(loop, **own)
            except GainError as error:
                raise GainError(error.field + suffix, error.value, error.allowed) from error
        elif field.name in overrides:
            changes[field.name] = overrides[field.name]
    return dataclasses.replace(gains, **changes)
