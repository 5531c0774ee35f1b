"""Parsing, validation and sampling of disturbances.

    {"payload": 1.3,
     "push": [{"body": "chest", "magnitude": {"uniform": [5, 40]}, "direction": [1, 0, 0], "start": 28.0}],
     "friction": {"coefficient": {"choice": [0.7, 0.8, 0.9]}}}

Any number may be a distribution: {"uniform": [low, high]}, {"normal": [mean, std]} (truncated to the allowed range by
resampling) or {"choice": [...]}, whose items are vectors if the parameter is a vector.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from artde_gym.deprecation import current_disturbances, warn
from artde_gym.disturbances.kinds import ALL, DISTURBANCES, NEVER, DisturbanceSpec, Parameter, allowed, in_order
from artde_gym.errors import DisturbanceError, suggest_names
from artde_gym.kit import PAYLOAD

DISTRIBUTIONS = ("uniform", "normal", "choice")
NORMAL_DRAWS = 1000  # tries to hit the allowed range before the mean, which is in it, is used


@dataclasses.dataclass(frozen=True)
class Disturbances:
    """Validated disturbances of one robot; build them with `parse`.

    `entries` holds (kind, {parameter: value or distribution}) with all defaults filled in, in a fixed order,
    so that a seed gives the same samples for any order of the user's keys.
    """

    entries: tuple[tuple[str, Mapping[str, Any]], ...] = ()

    @classmethod
    def parse(
        cls,
        given: Mapping[str, Any] | None,
        sites: Collection[str],
        joints: Collection[str] = (),
        robot: str | None = None,
    ) -> Disturbances:
        """Parse and validate a user's disturbances.

        Args:
            given: disturbances in the grammar.
            sites: names of the robot's sites for pushes.
            joints: names of the robot's joints or rotors.
            robot: one of `artde_gym.kit.ROBOTS`, for its kinds and defaults; None: any kind is accepted.

        Raises:
            DisturbanceError: for an unknown kind, key or site, a kind that the robot does not support, a wrong type, or
                a value that is out of range or not finite.
        """
        if given is None:
            return cls()
        if not isinstance(given, Mapping):
            raise DisturbanceError("disturbances", given, "a mapping of kinds to their parameters")
        named: Mapping[str, Any] = current_disturbances(given, told=True)
        honored = [kind.name for kind in DISTURBANCES.values() if kind.honored_by(robot)]
        for name in named:
            if name not in honored:
                of_robot = f"{robot} supports " if name in DISTURBANCES else ""
                raise DisturbanceError("disturbances", name, of_robot + suggest_names(name, honored))
        entries: list[tuple[str, Mapping[str, Any]]] = []
        for kind in in_order():
            if (name := kind.name) in named:
                for path, entry in _entries(kind, named[name]):
                    parsed = _parse_entry(kind, entry, path, {"site": sites, "joint": (*joints, ALL)}, robot)
                    entries += [(name, one) for one in _each_joint(parsed, joints)]
        _require_load(entries)
        return cls(tuple(entries))

    def sample(self, rng: np.random.Generator) -> dict[str, Any]:
        """Return sampled values in the same grammar, which `Disturbances.parse` reads."""
        sampled: dict[str, Any] = {}
        for name, entry in self.entries:
            kind = DISTURBANCES[name]
            values = {
                parameter.name: _draw(entry[parameter.name], parameter, rng)
                for parameter in kind.parameters
                if parameter.name in entry
            }
            if kind.multiple:
                sampled.setdefault(name, []).append(values)
            else:
                sampled[name] = values
        return sampled

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        """Return `sample(rng)`; deprecated."""
        warn("Disturbances.draw", "Disturbances.sample")
        return self.sample(rng)

    def idle(self, duration: float) -> list[str]:
        """Return which kinds can never happen in an episode of `duration` seconds, and why."""
        never: dict[str, set[str]] = {}
        for name, entry in self.entries:
            never.setdefault(name, set()).add(_idle(entry, duration))
        return [f"{name} can never happen: {' or '.join(sorted(why))}" for name, why in never.items() if "" not in why]

    def to_json(self) -> str:
        """Return the disturbances as JSON that `parse` reads."""
        grouped: dict[str, Any] = {}
        for name, entry in self.entries:
            if DISTURBANCES[name].multiple:
                grouped.setdefault(name, []).append(dict(entry))
            else:
                grouped[name] = dict(entry)
        return json.dumps(grouped)


def _require_load(entries: Sequence[tuple[str, Mapping[str, Any]]]) -> None:
    """See that there is a payload where one is pushed."""
    kinds = {name for name, _ in entries}
    for name, entry in entries:
        if name == "push" and entry["body"] == PAYLOAD and "payload" not in kinds:
            raise DisturbanceError("push.body", PAYLOAD, "choose a site of the robot, or add a payload", "is missing")


def _idle(entry: Mapping[str, Any], duration: float) -> str:
    """Return why an entry can never happen; "" if it can."""
    begin = min(_range(entry.get("start", entry.get("attach_time", 0.0))))
    if begin >= duration:
        return f"begins at {begin:g} s and the episode ends at {duration:g} s"
    if "detach_time" in entry and max(_range(entry["detach_time"])) <= begin:
        return f"ends at {max(_range(entry['detach_time'])):g} s and begins at {begin:g} s"
    return ""


def _range(value: Any) -> list[float]:
    """Return numbers that bound a validated number or distribution."""
    if not isinstance(value, dict):
        return [value]
    ((kind, arguments),) = value.items()
    return [0.0, NEVER] if kind == "normal" else arguments


def _entries(kind: DisturbanceSpec, given: Any) -> list[tuple[str, Any]]:
    if not kind.multiple:
        return [(kind.name, given)]
    if isinstance(given, Mapping):
        return [(f"{kind.name}[0]", given)]
    if isinstance(given, Sequence) and not isinstance(given, str):
        return [(f"{kind.name}[{i}]", entry) for i, entry in enumerate(given)]
    raise DisturbanceError(kind.name, given, "a list of mappings")


def _each_joint(entry: dict[str, Any], joints: Collection[str]) -> list[dict[str, Any]]:
    """Expand an entry for "all" joints to one per joint, so that each is sampled separately."""
    return [{**entry, "joint": joint} for joint in joints] if entry.get("joint") == ALL else [entry]


def _parse_entry(
    kind: DisturbanceSpec, given: Any, path: str, words: Mapping[str, Collection[str]], robot: str | None
) -> dict[str, Any]:
    names = {parameter.name: parameter for parameter in kind.parameters_for(robot)}
    if kind.shorthand is not None and (_is_number(given) or _is_distribution(given)):
        given = {kind.shorthand: given}
    if not isinstance(given, Mapping):
        raise DisturbanceError(path, given, f"a mapping with keys among {', '.join(names)}")
    for key in given:
        if key not in names:
            raise DisturbanceError(f"{path} key", key, suggest_names(key, names))
    chosen = [name for name in kind.one_of if name in given]
    if kind.one_of and len(chosen) != 1:
        raise DisturbanceError(path, dict(given), f"exactly one of {', '.join(kind.one_of)}")
    entry = {}
    for name, parameter in names.items():
        if name in kind.one_of and name not in chosen:
            continue
        field = f"{path}.{name}"
        if name not in given and parameter.default is None:
            raise DisturbanceError(field, None, f"{allowed(parameter)} (it has no default)")
        value = given.get(name, kind.default_of(parameter, robot, given))
        entry[name] = _word(value, parameter, field, words) if parameter.size == 0 else _check(value, parameter, field)
    return entry


def _word(value: Any, parameter: Parameter, field: str, words: Mapping[str, Collection[str]]) -> str:
    known = words[parameter.choices] if isinstance(parameter.choices, str) else parameter.choices
    if not (isinstance(value, str) and value in known):
        raise DisturbanceError(field, value, suggest_names(value, known))
    return value


def _check(value: Any, parameter: Parameter, field: str) -> Any:
    """Validate a value and convert its numbers to floats."""
    if _is_distribution(value):
        ((kind, arguments),) = value.items()
        return {kind: _check_distribution(kind, arguments, parameter, field)}
    if parameter.size > 1:
        if not (_is_list(value) and len(value) == parameter.size):
            raise DisturbanceError(field, value, f"{parameter.size} numbers, or {{'choice': [...]}} of such vectors")
        component = dataclasses.replace(parameter, size=1)
        checked = [_check(item, component, f"{field}[{i}]") for i, item in enumerate(value)]
        if parameter.nonzero and not any(_may_be_nonzero(item) for item in checked):
            raise DisturbanceError(field, value, "any vector but zero")
        return checked
    if not (_is_number(value) and parameter.low <= value <= parameter.high):  # nan fails both comparisons
        raise DisturbanceError(field, value, allowed(parameter))
    if parameter.integer:
        if value != int(value):
            raise DisturbanceError(field, value, allowed(parameter))
        return int(value)
    return float(value)


def _check_distribution(kind: str, arguments: Any, parameter: Parameter, field: str) -> list[Any]:
    if kind == "choice":
        if not (_is_list(arguments) and len(arguments) > 0):
            raise DisturbanceError(f"{field}.choice", arguments, "a list with at least one item")
        items = list(enumerate(arguments))
        for i, item in items:
            if _is_distribution(item):
                raise DisturbanceError(f"{field}.choice[{i}]", item, "a plain value, not a distribution")
        return [_check(item, parameter, f"{field}.choice[{i}]") for i, item in items]
    if parameter.size > 1:
        raise DisturbanceError(field, {kind: arguments}, "a list of components, each a number or a distribution")
    if not (_is_list(arguments) and len(arguments) == 2):
        raise DisturbanceError(f"{field}.{kind}", arguments, "two numbers")
    first = _check(arguments[0], parameter, f"{field}.{kind}[0]")
    if kind == "uniform":
        second = _check(arguments[1], parameter, f"{field}.uniform[1]")
        if first > second:
            raise DisturbanceError(f"{field}.uniform", arguments, "two numbers, the lower one first")
        return [first, second]
    deviation = arguments[1]
    if not (_is_number(deviation) and 0 <= deviation <= sys.float_info.max):
        raise DisturbanceError(f"{field}.normal[1]", deviation, "a finite standard deviation >= 0")
    return [first, float(deviation)]


def duplicate(sampled: Any) -> Any:
    """Copy sampled values, dictionaries and lists of numbers and words, faster than `copy.deepcopy`."""
    if isinstance(sampled, dict):
        return {name: duplicate(value) for name, value in sampled.items()}
    return [duplicate(value) for value in sampled] if isinstance(sampled, list) else sampled


def _draw(value: Any, parameter: Parameter, rng: np.random.Generator) -> Any:
    if isinstance(value, list):
        for _ in range(NORMAL_DRAWS):
            drawn = [_draw(item, parameter, rng) if isinstance(item, dict) else item for item in value]
            if any(drawn) or not parameter.nonzero:
                return drawn
        return [1.0, *[0.0] * (parameter.size - 1)]  # a nonzero vector has next to no chance
    if not isinstance(value, dict):
        return value
    ((kind, arguments),) = value.items()
    if kind == "choice":
        return _draw(arguments[int(rng.integers(len(arguments)))], parameter, rng)  # a vector may hold distributions
    if kind == "uniform":
        low, high = arguments
        return int(rng.integers(low, high + 1)) if parameter.integer else float(rng.uniform(low, high))
    for _ in range(NORMAL_DRAWS):
        drawn = float(rng.normal(*arguments))
        if parameter.low <= drawn <= parameter.high:
            return round(drawn) if parameter.integer else drawn
    return arguments[0]


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _is_list(value: Any) -> bool:
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def _is_distribution(value: Any) -> bool:
    return isinstance(value, Mapping) and len(value) == 1 and next(iter(value)) in DISTRIBUTIONS


def _may_be_nonzero(component: Any) -> bool:
    """Return True if a validated number or distribution can be nonzero."""
    return any(next(iter(component.values()))) if isinstance(component, dict) else component != 0
