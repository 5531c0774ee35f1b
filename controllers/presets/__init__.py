"""Gains of every law for every robot, each with its source."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from artde_gym.deprecation import warn
from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.registration import GainRange
from controllers.drive import DRIVES, Drive, Preset, Ranges
from controllers.law_table import find_law, known_laws
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
    """Return the ranges in which tuning searches a law's gains, from a preset on.

    Raises:
        UnknownNameError: as `preset_gains`, or for a law without tuning ranges.
    """
    gains = named_gains(_preset(robot, law, preset).gains)
    drive = DRIVES[robot]
    found = _ranges(drive, law)
    if not found:
        known = [name for name in {**drive.ranges, **known_laws()} if _ranges(drive, name)]
        raise UnknownNameError(f"controller of {robot!r} to be tuned", law, suggest_names(law, known))
    return {name: GainRange(gains[name], low, high) for name, (low, high) in found.items() if name in gains}


def law_presets(drive: Drive, law: str) -> dict[str, Preset]:
    """Return a law's gains on a robot by preset: the robot's for it, else those of the law that it is like."""
    own = {name: preset for (of, name), preset in drive.presets.items() if of == law}
    like = None if own else _like(law)
    if like is None:
        return own
    kind = find_law(law).gains
    taken = {name: (_as(kind, preset.gains), preset.source) for name, preset in law_presets(drive, like).items()}
    return {name: Preset(gains, f"as for {like}: {source}") for name, (gains, source) in taken.items() if gains}


def all_presets(drive: Drive) -> dict[tuple[str, str], Preset]:
    """Return the gains of all laws on a robot by (law, preset)."""
    laws = dict.fromkeys([*(law for law, _ in drive.presets), *known_laws()])
    return {(law, name): preset for law in laws for name, preset in law_presets(drive, law).items()}


def _like(law: str) -> str | None:
    """Return the law whose presets a law takes; None for a law of its own, and for any other name."""
    return find_law(law).like if ":" in law or law in known_laws() else None


def _as(kind: Any, gains: Any) -> Any:
    """Return gains as those of another law, of a cascade in both loops; None if it needs others."""
    loops = {loop: _as(kind, getattr(gains, loop)) for loop in LOOPS if hasattr(gains, loop)}
    if loops:
        return dataclasses.replace(gains, **loops) if all(loops.values()) else None
    fields = dataclasses.fields(kind)
    if any(field.default is dataclasses.MISSING and not hasattr(gains, field.name) for field in fields):
        return None
    return kind(**{field.name: getattr(gains, field.name) for field in fields if hasattr(gains, field.name)})


def _ranges(drive: Drive, law: str) -> Ranges:
    """Return a law's tuning ranges on a robot; empty if it has none."""
    like = None if law in drive.ranges else _like(law)
    if like is None:
        return drive.ranges.get(law, {})
    cascade = any(hasattr(preset.gains, loop) for preset in law_presets(drive, law).values() for loop in LOOPS)
    suffixes = [f"_{suffix}" for suffix in LOOPS.values()] if cascade else [""]
    own = {f"{gain}{suffix}": span for gain, span in find_law(law).ranges.items() for suffix in suffixes}
    return {**_ranges(drive, like), **own}


def _given(robot: str, law: str, preset: str | None, gains: dict[str, Any]) -> Any:
    """Gains of a robot without presets, all of them given."""
    if preset is not None:
        raise UnknownNameError(f"preset of {law!r} for {robot!r}", preset, "none: the robot has no presets")
    known = known_laws()
    if law not in known and ":" not in law:
        raise UnknownNameError(f"controller of {robot!r}", law, suggest_names(law, known))
    kind: Any = find_law(law).gains
    fields = {field.name: field for field in dataclasses.fields(kind)}
    for name in gains:
        if name not in fields:
            raise GainError(f"of {law!r}", name, suggest_names(name, fields))
    needed = [name for name, field in fields.items() if field.default is dataclasses.MISSING]
    if missing := [name for name in needed if name not in gains]:
        allowed = f"{', '.join(needed)}, all of them: {robot!r} has no presets, for which its plug-in needs a Drive"
        raise GainError(f"of {law!r} not given", ", ".join(missing), allowed)
    return kind(**gains)


def _preset(robot: str, law: str, preset: str | None) -> Preset:
    if robot not in DRIVES:
        raise UnknownNameError("robot with presets", robot, suggest_names(robot, DRIVES))
    known = law_presets(DRIVES[robot], law)
    if not known:
        laws = list(dict.fromkeys(name for name, _ in all_presets(DRIVES[robot])))
        raise UnknownNameError(f"controller of {robot!r}", law, suggest_names(law, laws) if laws else "none yet")
    if preset is not None and preset not in known:
        raise UnknownNameError(f"preset of {law!r} for {robot!r}", preset, ", ".join(map(repr, known)))
    return known[preset or next(iter(known))]


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
    """Replace some of the gains, by the names of `_flat`."""
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
