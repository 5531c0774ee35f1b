"""The standard test of a frontier for each robot, and ranges for what is usually varied in it."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from artde_gym.errors import OptionError
from artde_gym.evaluation.environments import robot_of
from artde_gym.evaluation.scenarios import SCENARIOS

Harder = Literal["larger", "smaller"]


class Range(NamedTuple):
    """Ends and grid of a path where the user gives none, and which of its ends is the hard one."""

    low: float
    high: float
    tolerance: float
    harder: Harder = "larger"


@dataclasses.dataclass(frozen=True)
class Standard:
    """One robot's test.

    Attributes:
        scenario: whose disturbances it has.
        duration: s.
        when: (s) between which a varied push comes.
        repeated: what is varied of kinds that take a list, in place of the scenario's own of that kind.
        time_step: s, of which control periods are whole multiples.
        ranges: path -> range. Any other path needs low, high and tolerance.
    """

    scenario: str
    duration: float
    when: tuple[float, float]
    repeated: Mapping[str, list[dict[str, Any]]]
    time_step: float
    ranges: Mapping[str, Range]


def _push(body: str, when: tuple[float, float]) -> dict[str, Any]:
    return {
        "body": body,
        "magnitude": 0.0,
        "direction": [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0],
        "start": {"uniform": list(when)},
        "duration": 0.2,
    }


_STRIDE = (5.0, 7.0)  # s, two steps of steady walking at 1 s a step
_LOOP = (6.0, 16.0)  # s, half a loop at full speed

STANDARDS: dict[str, Standard] = {
    "ojas": Standard(
        scenario="S2",
        duration=12.0,
        when=_STRIDE,
        repeated={
            "push": [_push("chest", _STRIDE)],
            "actuator_loss": [{"joint": "all"}],
            "initial_pose": [{"joint": "all"}],
        },
        time_step=0.001,
        ranges={
            "push.magnitude": Range(0.0, 60.0, 2.0),
            "payload.mass": Range(0.5, 5.0, 0.25),
            "grf_pulse.magnitude": Range(0.0, 200.0, 10.0),
            "grf_pulse.share": Range(0.0, 1.0, 0.02),
            "friction.coefficient": Range(0.05, 0.8, 0.05, "smaller"),
            "slope.pitch_deg": Range(0.0, 10.0, 0.5),
            "slope.roll_deg": Range(0.0, 10.0, 0.5),
            "sensor_noise.position": Range(0.0, 0.01, 0.00025),
            "sensor_noise.velocity": Range(0.0, 1.0, 0.025),
            "encoder_bits.bits": Range(8.0, 20.0, 1.0, "smaller"),
            "torque_delay.samples": Range(0.0, 10.0, 1.0),
            "motor_lag.time_constant": Range(0.0, 0.02, 0.001),
            "actuator_loss.factor": Range(0.0, 1.0, 0.05, "smaller"),
            "mass_error.factor": Range(1.0, 2.0, 0.05),
            "control_period": Range(0.001, 0.02, 0.001),
            "speed": Range(0.0, 0.25, 0.01),
        },
    ),
    "q450": Standard(
        scenario="Q1",
        duration=20.0,
        when=_LOOP,
        repeated={
            "push": [_push("body", _LOOP)],
            "actuator_loss": [{"joint": "front_left", "start": {"uniform": list(_LOOP)}}],
        },
        time_step=0.005,
        ranges={
            "wind.scale": Range(0.0, 10.0, 0.25),
            "payload.mass": Range(0.1, 2.0, 0.05),
            "push.magnitude": Range(0.0, 60.0, 2.0),
            "torque_delay.samples": Range(0.0, 10.0, 1.0),
            "motor_lag.time_constant": Range(0.0, 0.2, 0.005),
            "actuator_loss.factor": Range(0.0, 1.0, 0.05, "smaller"),
            "mass_error.factor": Range(0.5, 2.0, 0.05),
            "ground_effect.strength": Range(0.0, 10.0, 0.5),
            "sensor_noise.position": Range(0.0, 0.1, 0.0025),
            "sensor_noise.velocity": Range(0.0, 1.0, 0.025),
            "control_period": Range(0.005, 0.05, 0.005),
        },
    ),
}
"""Robot -> its test."""


def standard_for(env_id: str) -> Standard | None:
    """The standard test of an environment's robot, if it has one."""
    return STANDARDS.get(robot_of(env_id))


def standard_test(env_id: str, path: str, arguments: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Disturbances and arguments of the standard test in which `path` is varied; see `artde_gym.evaluation.frontier`.

    Raises:
        OptionError: if the environment's robot has no standard test, or the episode ends before the push.
    """
    standard = standard_for(env_id)
    if standard is None:
        raise OptionError("disturbances", None, f"a mapping: {env_id} has no standard test")
    arguments = dict(arguments) if path == "duration" else {"duration": standard.duration, **arguments}
    disturbances: dict[str, Any] = copy.deepcopy(dict(SCENARIOS[standard.scenario].disturbances))
    kind = path.split(".")[0]
    if kind in standard.repeated:
        disturbances[kind] = copy.deepcopy(standard.repeated[kind])
    duration, last = arguments.get("duration", standard.duration), standard.when[1]
    if kind == "push" and isinstance(duration, (int, float)) and duration < last + 1.0:
        raise OptionError("duration", duration, f"at least {last + 1:g} s, as the push comes until {last:g} s")
    return disturbances, arguments
