"""The axis of a frontier: the path of the varied number, its range and its grid."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from artde_gym.deprecation import current_path, warn
from artde_gym.disturbances import DISTURBANCES
from artde_gym.disturbances.kinds import parameters_of
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation.environments import PICTURES, arguments_of, robot_of
from artde_gym.kit import Harder
from artde_gym.studies.frontier.standard import standard_for

FINEST = 1e-6  # tolerance relative to the ends; finer steps exceed the digits of a level's name


GAINS = "gains"
"""Kind of a path to a gain of all controllers."""
GAIN_UNITS = {"m_bar": "kg m^2"}
ARGUMENT_UNITS = {"control_period": "s", "speed": "m/s", "step_duration": "s", "duration": "s"}


@dataclasses.dataclass(frozen=True)
class Axis:
    """One number to vary, from `low` to `high` in steps of `tolerance`, all in `unit`.

    Attributes:
        kind: of the disturbance; None for an argument of the environment, "gains" for a gain.
        name: of the disturbance's parameter, of the argument, or of the gain.
    """

    kind: str | None
    name: str
    unit: str
    low: float
    high: float
    tolerance: float
    harder: Harder

    @property
    def path(self) -> str:
        return self.name if self.kind is None else f"{self.kind}.{self.name}"

    @property
    def levels(self) -> list[float]:
        """The grid, easiest level first; its last step may be shorter than the others."""
        count = math.ceil((self.high - self.low) / self.tolerance - FINEST)
        start, step = (self.low, self.tolerance) if self.harder == "larger" else (self.high, -self.tolerance)
        end = self.high if self.harder == "larger" else self.low
        return [start, *(float(f"{start + i * step:.10g}") for i in range(1, count)), end]

    def place(
        self, value: float, disturbances: Mapping[str, Any], arguments: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return disturbances and environment arguments with `value` at the axis; the given ones are not changed.

        A gain has no place among them.

        Raises:
            OptionError: if the varied disturbance takes a list and none is given.
        """
        if self.kind == GAINS:
            return dict(disturbances), dict(arguments)
        if self.kind is None:
            return dict(disturbances), {**arguments, self.name: value}
        return placed(disturbances, self.kind, self.name, value), dict(arguments)


def placed(disturbances: Mapping[str, Any], kind: str, name: str, value: Any) -> dict[str, Any]:
    """Return disturbances with `value` for one parameter of a kind, in all its entries; the given ones are not changed.

    Raises:
        OptionError: for a kind that takes a list, if none is given.
    """
    given = disturbances.get(kind)
    if not DISTURBANCES[kind].multiple:
        return {**disturbances, kind: {**parameters_of(kind, given), name: value}}
    entries = [given] if isinstance(given, Mapping) else given
    if not (isinstance(entries, (list, tuple)) and entries and all(isinstance(entry, Mapping) for entry in entries)):
        raise OptionError("disturbances", given, "add one, or vary another", f"have no {kind!r} to vary")
    return {**disturbances, kind: [{**entry, name: value} for entry in entries]}


def axis(
    env_id: str,
    path: str,
    low: float | None = None,
    high: float | None = None,
    tolerance: float | None = None,
    harder: Harder | None = None,
) -> Axis:
    """Return the axis at `path`: a parameter of `artde_gym.disturbances.DISTURBANCES`, "gains.name", or an argument.

    Raises:
        UnknownNameError: if there is no number at this path.
        OptionError: for a range that is missing, empty, invalid, or off the grid of whole numbers.
    """
    if current_path(path) != path:
        warn(f"path {path!r}", repr(current_path(path)))
        path = current_path(path)
    kind, name, unit = _find(env_id, path)
    standard = standard_for(env_id)
    default = None if standard is None else standard.ranges.get(path)
    ends: dict[str, float] = {}
    for field, given in (("low", low), ("high", high), ("tolerance", tolerance)):
        value = given if given is not None or default is None else getattr(default, field)
        if value is None:
            raise OptionError(field, None, "give a number", f"is no number, and {path} has no default range")
        if isinstance(value, bool) or not (isinstance(value, (int, float)) and math.isfinite(value)):
            raise OptionError(field, value, "a finite number")
        ends[field] = float(value)
    if harder not in (None, "larger", "smaller"):
        raise OptionError("harder", harder, "'larger', 'smaller'")
    chosen = Axis(kind, name, unit, **ends, harder=harder or (default.harder if default else _harder(kind, name)))
    _check(chosen, None if standard is None else standard.time_step)
    return chosen


def _harder(kind: str | None, name: str) -> Harder:
    """Say which values of a parameter are harder, by what is known of its kind."""
    parameters = DISTURBANCES[kind].parameters if kind is not None and kind in DISTURBANCES else ()
    return "smaller" if any(one.name == name and one.smaller_is_harder for one in parameters) else "larger"


def _find(env_id: str, path: str) -> tuple[str | None, str, str]:
    robot = robot_of(env_id)
    disturbances = {
        f"{kind.name}.{parameter.name}": (kind.name, parameter.name, parameter.unit)
        for kind in DISTURBANCES.values()
        if kind.honored_by(robot)
        for parameter in kind.parameters_for(robot)
        if parameter.size == 1
    }
    numbers = [
        name
        for name, argument in arguments_of(env_id).items()
        if name not in PICTURES
        and isinstance(argument.default, (int, float))
        and not isinstance(argument.default, bool)
    ]
    kind, _, gain = path.partition(".")
    if kind == GAINS and gain:
        return GAINS, gain, GAIN_UNITS.get(gain, "1")  # whether controllers have it, they know themselves
    if path in disturbances:
        return disturbances[path]
    if path in numbers:
        return None, path, ARGUMENT_UNITS.get(path, "1")
    raise UnknownNameError("vary", path, suggest_names(path, [*disturbances, *numbers]))


def _check(varied: Axis, time_step: float | None) -> None:
    if varied.low >= varied.high:
        raise OptionError("low", varied.low, f"below high, which is {varied.high:g}")
    span = varied.high - varied.low
    finest = FINEST * max(abs(varied.low), abs(varied.high))
    if not finest <= varied.tolerance <= span * (1 + FINEST):  # 0.3 - 0.2 is less than 0.1
        raise OptionError("tolerance", varied.tolerance, f"{finest:g} to high - low, which is {span:g}")
    quantum = time_step if varied.path == "control_period" else None
    if varied.kind not in (None, GAINS):
        (parameter,) = (p for p in DISTURBANCES[varied.kind].parameters if p.name == varied.name)
        for field, value in (("low", varied.low), ("high", varied.high)):
            if not parameter.low <= value <= parameter.high:
                raise OptionError(field, value, f"{parameter.low:g} to {parameter.high:g} for {varied.path}")
        quantum = 1.0 if parameter.integer else None
    if quantum is None:
        return
    for field in ("low", "high", "tolerance"):
        value = getattr(varied, field)
        if not math.isclose(value, round(value / quantum) * quantum, rel_tol=1e-9, abs_tol=1e-12):
            raise OptionError(field, value, f"a whole multiple of {quantum:g} for {varied.path}")
