"""What a frontier varies: a path to one number, its range and its grid, and the standard test around it."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from artde_gym.disturbances import KINDS
from artde_gym.errors import OptionError, UnknownNameError, among
from artde_gym.evaluation.environments import arguments_of
from artde_gym.evaluation.scenarios import SCENARIOS

Harder = Literal["larger", "smaller"]

FINEST = 1e-6  # tolerance relative to the ends; finer steps would drown in the digits of a level's name
MILLISECOND = 1e-3  # s; a control period is a whole number of them


class Default(NamedTuple):
    """Range and grid of a path where the user gives none, and which of its ends is the hard one."""

    low: float
    high: float
    tolerance: float
    harder: Harder = "larger"


DEFAULTS: dict[str, Default] = {
    "push.magnitude": Default(0.0, 60.0, 2.0),
    "payload.mass": Default(0.5, 5.0, 0.25),
    "grf_pulse.magnitude": Default(0.0, 200.0, 10.0),
    "friction.coefficient": Default(0.05, 0.8, 0.05, "smaller"),
    "slope.pitch_deg": Default(0.0, 10.0, 0.5),
    "slope.roll_deg": Default(0.0, 10.0, 0.5),
    "sensor_noise.position": Default(0.0, 0.01, 0.00025),
    "sensor_noise.velocity": Default(0.0, 1.0, 0.025),
    "encoder_bits.bits": Default(8.0, 20.0, 1.0, "smaller"),
    "torque_delay.samples": Default(0.0, 10.0, 1.0),
    "motor_lag.time_constant": Default(0.0, 0.02, 0.001),
    "actuator_loss.factor": Default(0.0, 1.0, 0.05, "smaller"),
    "mass_error.factor": Default(1.0, 2.0, 0.05),
    "control_period": Default(0.001, 0.02, 0.001),
    "speed": Default(0.0, 0.25, 0.01),
}
"""Path -> range. Any other path needs low, high and tolerance."""

ARGUMENT_UNITS = {"control_period": "s", "speed": "m/s", "step_duration": "s", "duration": "s"}

DURATION = 12.0  # s, of the standard test's walk
STRIDE = (5.0, 7.0)  # s, two steps of steady walking at 1 s a step
PUSH: dict[str, Any] = {
    "body": "chest",
    "magnitude": 0.0,
    "direction": [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0],
    "start": {"uniform": list(STRIDE)},
    "duration": 0.2,
}
_REPEATED: dict[str, list[dict[str, Any]]] = {
    "push": [PUSH],
    "actuator_loss": [{"joint": "all"}],
    "initial_pose": [{"joint": "all"}],
}


@dataclasses.dataclass(frozen=True)
class Axis:
    """One number to vary, from `low` to `high` in steps of `tolerance`, all in `unit`.

    Attributes:
        kind: of the disturbance; None for an argument of the environment.
        name: of the disturbance's parameter, or of the argument.
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
        """The grid, the easiest level first; its last step may be shorter than the others."""
        count = math.ceil((self.high - self.low) / self.tolerance - FINEST)
        start, step = (self.low, self.tolerance) if self.harder == "larger" else (self.high, -self.tolerance)
        end = self.high if self.harder == "larger" else self.low
        return [start, *(float(f"{start + i * step:.10g}") for i in range(1, count)), end]

    def place(
        self, value: float, disturbances: Mapping[str, Any], arguments: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Disturbances and arguments of the environment with `value` in its place, the given ones left alone.

        Raises:
            OptionError: if the varied disturbance takes a list and none is given.
        """
        if self.kind is None:
            return dict(disturbances), {**arguments, self.name: value}
        given = disturbances.get(self.kind)
        if KINDS[self.kind].repeated:
            entries = [given] if isinstance(given, Mapping) else given
            if not (isinstance(entries, (list, tuple)) and entries and all(isinstance(e, Mapping) for e in entries)):
                raise OptionError("disturbances", given, f"with a list of at least one {self.kind!r}: it is varied")
            placed: Any = [{**entry, self.name: value} for entry in entries]
        else:
            placed = {**self._parameters(given), self.name: value}
        return {**disturbances, self.kind: placed}, dict(arguments)

    def _parameters(self, given: Any) -> dict[str, Any]:
        """A disturbance's parameters, also from the short form of a bare number or distribution."""
        kind = KINDS[str(self.kind)]
        if given is None:
            return {}
        names = {parameter.name for parameter in kind.parameters}
        if isinstance(given, Mapping) and (kind.scalar is None or not names.isdisjoint(given)):
            return dict(given)
        return {str(kind.scalar): given}


def axis(
    env_id: str,
    path: str,
    low: float | None = None,
    high: float | None = None,
    tolerance: float | None = None,
    harder: Harder | None = None,
) -> Axis:
    """The axis at `path`: "kind.parameter" of `artde_gym.disturbances.KINDS`, or an argument of the environment.

    Raises:
        UnknownNameError: if there is no number at this path.
        OptionError: for a range that is missing, empty, off the grid of whole numbers, or not allowed.
    """
    kind, name, unit = _find(env_id, path)
    default = DEFAULTS.get(path)
    ends: dict[str, float] = {}
    for field, given in (("low", low), ("high", high), ("tolerance", tolerance)):
        value = given if given is not None or default is None else getattr(default, field)
        if value is None:
            raise OptionError(field, None, f"a number: {path} has no default range")
        if isinstance(value, bool) or not (isinstance(value, (int, float)) and math.isfinite(value)):
            raise OptionError(field, value, "a finite number")
        ends[field] = float(value)
    if harder not in (None, "larger", "smaller"):
        raise OptionError("harder", harder, "'larger', 'smaller'")
    chosen = Axis(kind, name, unit, **ends, harder=harder or (default.harder if default else "larger"))
    _check(chosen)
    return chosen


def standard_test(env_id: str, varied: Axis, arguments: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Disturbances and arguments of the standard test; see `artde_gym.evaluation.frontier`.

    Raises:
        OptionError: if the environment has no standard test, or the walk ends before the push.
    """
    if not env_id.startswith("Biped"):
        raise OptionError("disturbances", None, f"a mapping: {env_id} has no standard test")
    arguments = dict(arguments) if varied.path == "duration" else {"duration": DURATION, **arguments}
    disturbances: dict[str, Any] = copy.deepcopy(dict(SCENARIOS["S2"].disturbances))
    if varied.kind in _REPEATED:
        disturbances[varied.kind] = copy.deepcopy(_REPEATED[varied.kind])
    duration = arguments.get("duration", DURATION)
    if varied.kind == "push" and isinstance(duration, (int, float)) and duration < STRIDE[1] + 1.0:
        raise OptionError(
            "duration", duration, f"at least {STRIDE[1] + 1:g} s, as the push comes until {STRIDE[1]:g} s"
        )
    return disturbances, arguments


def _find(env_id: str, path: str) -> tuple[str | None, str, str]:
    disturbances = {
        f"{kind.name}.{parameter.name}": (kind.name, parameter.name, parameter.unit)
        for kind in KINDS.values()
        for parameter in kind.parameters
        if parameter.size == 1
    }
    numbers = [
        name
        for name, argument in arguments_of(env_id).items()
        if isinstance(argument.default, (int, float)) and not isinstance(argument.default, bool)
    ]
    if path in disturbances:
        return disturbances[path]
    if path in numbers:
        return None, path, ARGUMENT_UNITS.get(path, "1")
    raise UnknownNameError("vary", path, among(path, [*disturbances, *numbers]))


def _check(varied: Axis) -> None:
    if varied.low >= varied.high:
        raise OptionError("low", varied.low, f"below high, which is {varied.high:g}")
    span = varied.high - varied.low
    finest = FINEST * max(abs(varied.low), abs(varied.high))
    if not finest <= varied.tolerance <= span * (1 + FINEST):  # 0.3 - 0.2 is less than 0.1
        raise OptionError("tolerance", varied.tolerance, f"{finest:g} to high - low, which is {span:g}")
    quantum = MILLISECOND if varied.path == "control_period" else None
    if varied.kind is not None:
        (parameter,) = (p for p in KINDS[varied.kind].parameters if p.name == varied.name)
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
