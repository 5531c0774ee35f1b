"""Canonical forms of names, arguments and disturbances, so that equal cases compare equal."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Mapping
from typing import Any

from artde_gym.disturbances import DISTURBANCES
from artde_gym.disturbances.kinds import parameters_of
from artde_gym.errors import ArtdeGymError
from artde_gym.evaluation.environments import arguments_of, ours, robot_of

EXACT = 2**53
"""Whole numbers below this are exact as floats."""


def name(text: str) -> str:
    """Return a name without surrounding space, in Unicode's normal form NFC."""
    return unicodedata.normalize("NFC", text.strip())


def twice(names: Iterable[str]) -> str | None:
    """Find a name that comes twice, in whatever spelling; files are named by it, and many disks ignore case."""
    seen: set[str] = set()
    for text in names:
        spelling = name(name(text).casefold())
        if spelling in seen:
            return text
        seen.add(spelling)
    return None


def numbers(value: Any) -> Any:
    """Return whole numbers as integers, in mappings and lists too: 1.0 becomes 1."""
    if isinstance(value, Mapping):
        return {key: numbers(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [numbers(item) for item in value]
    whole = isinstance(value, float) and abs(value) < EXACT and value == int(value)
    return int(value) if whole else value


def disturbances(given: Mapping[str, Any], env_id: str) -> dict[str, Any]:
    """Return disturbances in full, with all defaults; kinds outside the grammar are left as they are."""
    robot = robot_of(env_id) if env_id in ours() else None
    written = {kind: _entries(kind, value, robot) if kind in DISTURBANCES else value for kind, value in given.items()}
    return {kind: numbers(value) for kind, value in written.items() if value != []}


def arguments(given: Mapping[str, Any], env_id: str, vectorized: bool) -> dict[str, Any]:
    """Return an environment's arguments without those at their defaults, its disturbances in full."""
    try:
        known = arguments_of(env_id, vectorized) if env_id in ours() else {}
    except ArtdeGymError:
        known = {}
    if isinstance(given.get("disturbances"), Mapping):
        given = {**given, "disturbances": disturbances(given["disturbances"], env_id)}
    return {key: numbers(value) for key, value in given.items() if key not in known or _differs(value, known[key])}


def _differs(value: Any, argument: Any) -> bool:
    default = argument.default
    return type(numbers(value)) is not type(numbers(default)) or numbers(value) != numbers(default)


def _entries(kind: str, given: Any, robot: str | None) -> Any:
    if not DISTURBANCES[kind].multiple:
        return _full(kind, given, robot)
    entries = [given] if isinstance(given, Mapping) else given
    return [_full(kind, entry, robot) for entry in entries] if isinstance(entries, (list, tuple)) else given


def _full(kind: str, given: Any, robot: str | None) -> dict[str, Any]:
    known = DISTURBANCES[kind]
    own, parameters = parameters_of(kind, given), known.parameters_for(robot)
    defaults = {one.name: known.default_of(one, robot, own) for one in parameters if one.default is not None}
    return {**defaults, **own}
