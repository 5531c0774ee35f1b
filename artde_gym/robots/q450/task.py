"""Flight task of the Q450 for single and vector environments: layouts, reward, termination and documentation."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances.ground_effect import thrust_gain
from artde_gym.disturbances.numeric import Words
from artde_gym.disturbances.wind import GRID
from artde_gym.kit import PAYLOAD
from artde_gym.layout import Field, Layout
from artde_gym.metrics_spec import EffortSignal, Fields, MetricsSpec, TrackedSignal
from artde_gym.multibody.dynamics import GRAVITY
from artde_gym.multibody.spec import Vector
from artde_gym.robots.q450 import model as robot
from artde_gym.robots.q450.infinity import START, infinity_path

STREAMS = 3  # noise streams per episode: wind, motion capture, sensor noise
DEFAULT_DISTURBANCES: dict[str, Any] = {
    "payload": {"mass": 0.35, "detach_time": 35.0},
    "wind": 1.0,
    "ground_effect": 1.0,
}

FLIGHT_BOUND = 3.0  # m, bound of x and y on either side of the start, and of the height
MAX_SPIN = 30.0  # rad/s, bound of the body rates' norm
GROUND_HEIGHT = 0.1  # m, of the vehicle's origin when the skids touch the ground
MAX_RATE = 1000.0  # rad/s, bound of observed body rates
MAX_SPEED = 100.0  # m/s, bound of observed velocities

OBSERVATION = Layout(
    (
        Field("position", 3, "m", -10.0, 10.0, "vehicle's center of mass without payload, world axes"),
        Field("velocity", 3, "m/s", -MAX_SPEED, MAX_SPEED, "velocity of that point, world axes"),
        Field("rot_body_to_world", 9, "1", -1.01, 1.01, "rotation matrix R, body to world, row by row"),
        Field("body_rates", 3, "rad/s", -MAX_RATE, MAX_RATE, "angular velocity, body axes"),
        Field("position_ref", 3, "m", -5.0, 5.0, "reference at this instant"),
        Field("velocity_ref", 3, "m/s", -5.0, 5.0, "reference velocity"),
        Field("acceleration_ref", 3, "m/s^2", -10.0, 10.0, "reference acceleration"),
        Field("jerk_ref", 3, "m/s^3", -50.0, 50.0, "reference jerk"),
        Field("yaw_ref", 1, "rad", -math.pi, math.pi, "reference heading"),
        Field("yaw_rate_ref", 1, "rad/s", -10.0, 10.0, "reference rate of heading"),
        Field(
            "wrench_applied",
            4,
            "N, Nm",
            robot.MIN_WRENCH,
            robot.MAX_WRENCH,
            "mean [u1, u2, u3, u4] of the rotors over the last control period",
        ),
        Field("rotor_thrust", 4, "N", 0.0, robot.MAX_THRUST, "thrust of each rotor at this instant"),
        Field("phase", 1, "1", 0.0, 1.0, "time over duration"),
    )
)
POSITION, VELOCITY, ROT, RATES = (
    OBSERVATION[name] for name in ("position", "velocity", "rot_body_to_world", "body_rates")
)
MEASURED = slice(POSITION.start, RATES.stop)
REFERENCE = slice(OBSERVATION["position_ref"].start, OBSERVATION["yaw_rate_ref"].stop)
WRENCH, THRUST, PHASE = (OBSERVATION[name] for name in ("wrench_applied", "rotor_thrust", "phase"))
ACTION = Layout(
    (
        Field(
            "wrench",
            4,
            "N, Nm",
            robot.MIN_WRENCH,
            robot.MAX_WRENCH,
            "u1, thrust along body z; u2, u3, u4, torques about body x, y, z",
        ),
    )
)

AIR_DENSITY = 1.225  # kg/m^3


def _heading_error(fields: Fields) -> Array:
    """Return the observable error of (phi, theta, psi): the policy chooses the other two references."""
    rot = fields["rot_body_to_world"]
    error = fields["yaw_ref"][..., 0] - np.arctan2(rot[..., 3], rot[..., 0])
    unknown = np.full_like(error, np.nan)
    return np.stack([unknown, unknown, (error + math.pi) % (2.0 * math.pi) - math.pi], axis=-1)


def _induced_power(fields: Fields) -> Array:
    """Return the sum of T^1.5 / sqrt(2 rho A), the power of ideal hovering rotors (W)."""
    disc, thrust = math.pi * robot.ROTOR_RADIUS**2, np.maximum(fields["rotor_thrust"], 0.0)
    return (thrust * np.sqrt(thrust)).sum(axis=-1) / math.sqrt(2.0 * AIR_DENSITY * disc)


METRICS_SPEC = MetricsSpec(
    errors=(
        TrackedSignal("m", 1.0, {"x": 0, "y": 1, "z": 2}, lambda fields: fields["position_ref"] - fields["position"]),
        TrackedSignal(
            "deg", 180.0 / math.pi, {"phi": 0, "theta": 1, "psi": 2}, _heading_error, diagnostic="attitude_error"
        ),
    ),
    norm=True,
    settling_band=0.02,
    efforts=(
        EffortSignal("thrust", "n", "wrench_applied", slice(0, 1), {"u1": 0}),
        EffortSignal("torque", "nm", "wrench_applied", slice(1, 4), {"u2": 0, "u3": 1, "u4": 2}),
    ),
    power=_induced_power,
    saturated_field="rotor_thrust",
    saturation_margin=0.01,
    tde_errors={"tde_error_rms_p": "sigma_p", "tde_error_rms_q": "sigma_q"},
    diagnostic_means={"robust_gain_mean_p": "c_p", "robust_gain_mean_q": "c_q"},
)
"""Position and attitude, as in table 3.1 of the thesis; an error of 2 cm counts as recovered."""


def documentation(
    observation: Layout, *, reference: str, terms: str, perfect: float, end: str, disturbances: str
) -> str:
    """Write what the pages of an environment and of its vector share; their own arguments follow."""
    return f"""\
## Action
`wrench`, four numbers: thrust u1 (N) along the body's z axis, and torques u2, u3, u4 (Nm) about its x, y and z axes:

{ACTION.table()}

Held for one control period; clipped to the bounds, which the rotors can reach for one component at a time; allocated to
the four rotors, each of which is limited to 0 to {robot.MAX_THRUST:g} N and follows its command with a first-order lag
of {robot.ROTOR_LAG:g} s. Use Gymnasium's `RescaleAction` for [-1, 1].

## Observation
{observation.table()}

`wrench_applied` is the wrench that acted, after limits, lag and losses of rotors, but without ground effect, as needed
by the time-delay estimate. Policies do not observe payload, wind, pushes and ground effect.

## Reference
{reference}

## Reward
For a control period L, L times the sum of scale x term; `info` has each term (`reward_alive`, ...):

| term | scale | value |
|---|---|---|
| `alive` | 1 | 1 |
| `position` | 2 | exp(-\\|e\\|^2 / 0.01), e = position_ref - position in m |
| `velocity` | 0.5 | exp(-\\|e\\|^2 / 0.05), e = velocity_ref - velocity in m/s |
| `upright` | 0.5 | cosine of the tilt |
| `effort` | -0.05 | mean of (rotor thrust / 8.5 N)^2 |
| `smoothness` | -0.05 | mean of (change of rotor thrust / 8.5 N)^2 |{terms}

A flight of 70 s without an error earns a little under {perfect:g}.

## Start
At rest and level at the path's start, in equilibrium with the payload and with steady-state thrusts.

## End
*Terminated* by a crash, with the reason in `info`: `fell_ground` (the vehicle's origin below {GROUND_HEIGHT:g} m),
`fell_inverted` (tilt above 90 degrees) or `fell_bounds` (x or y beyond {FLIGHT_BOUND:g} m, z above {FLIGHT_BOUND:g} m,
or body rates with a norm above {MAX_SPIN:g} rad/s).{end} *Truncated* after `duration`.

## Physics
Vehicle of {robot.MASS:g} kg with linear drag of {robot.DRAG:g} N s/m against the air; see `artde_gym.robots.q450`. Wind
and ground effect are those of `artde_gym.disturbances`; the aerodynamic force is computed every {GRID:g} s and constant
in body axes in between.

## Arguments
| name | default | allowed | meaning |
|---|---|---|---|
| `disturbances` | {disturbances} | see `artde_gym.disturbances` | disturbances; `{{}}` for none |
| `control_period` | 0.015 | whole multiples of {GRID:g} s up to 0.05 | control period L |
| `measurement` | "ideal" | "ideal", "mocap" | the true state, or its estimate by `artde_gym.disturbances.mocap` |
| `duration` | 70.0 | 0.1 to 7200 s | duration of the flight |"""


DOCUMENTATION = documentation(
    OBSERVATION,
    reference="""\
The infinity-shaped path of `artde_gym.robots.q450.infinity`: loop 1 until 33 s, rest until 37 s, loop 2 until 70 s;
yaw 0.""",
    terms="",
    perfect=280,
    end="",
    disturbances="payload of 0.35 kg until 35 s, wind, ground effect",
)
"""Text of the pages of both environments; further arguments follow."""

REWARD_SCALES: dict[str, float] = {
    "alive": 1.0,
    "position": 2.0,
    "velocity": 0.5,
    "upright": 0.5,
    "effort": -0.05,
    "smoothness": -0.05,
}
"""The reward of a control period L is L times the sum of these scales times their terms."""
FALL_REASONS = ("ground", "inverted", "bounds")
WORDS: Words = {"site": (*(name for name, _, _ in robot.q450().sites), PAYLOAD), "joint": robot.ROTORS}

Number = TypeVar("Number", float, Array)
Vector3 = tuple[Number, Number, Number]


def reward_terms(
    error: Number, velocity_error: Number, up: Number, thrust: Number, change: Number, exp: Callable[[Number], Number]
) -> dict[str, Number]:
    """Return the reward's terms in the order of `REWARD_SCALES`, elementwise.

    Args:
        error, velocity_error: squared norms of the tracking errors (m^2, m^2/s^2).
        up: world z component of the body's z axis.
        thrust, change: squared norms of the rotors' thrusts and of their change in a control period (N^2).
        exp: the exponential function for this type of number.
    """
    return {
        "alive": 0.0 * error + 1.0,
        "position": exp(-100.0 * error),
        "velocity": exp(-20.0 * velocity_error),
        "upright": up,
        "effort": _THRUST_SCALE * thrust,
        "smoothness": _THRUST_SCALE * change,
    }


def falls(position: Vector3[Number], up: Number, spin: Number) -> tuple[Any, Any, Any]:
    """Return which of `FALL_REASONS` hold, elementwise; a state with NaN is out of bounds.

    `up` is as in `reward_terms`, `spin` the squared norm of the body rates (rad^2/s^2).
    """
    x, y, z = position
    inside = (abs(x) <= FLIGHT_BOUND) & (abs(y) <= FLIGHT_BOUND) & (z <= FLIGHT_BOUND) & (spin <= MAX_SPIN**2)
    return z < GROUND_HEIGHT, up < 0.0, inside ^ True


def plan(duration: float, period: float, lift: float = 0.0) -> Array:
    """Return the references of the path, raised by `lift` (m), one row per control period: (samples, 15)."""
    path = infinity_path(duration, period)
    phase = path.period * np.arange(len(path.yaw)) / duration
    columns = (path.yaw, path.yaw_rate, phase)
    return np.column_stack(
        [np.add(path.position, (0.0, 0.0, lift)), path.velocity, path.acceleration, path.jerk, *columns]
    )


def start(sampled: Mapping[str, Any], lift: float = 0.0) -> Vector:
    """Return the vehicle's position at the start (m) of a path that is raised by `lift` (m)."""
    x, y, z = map(operator.add, START, sampled.get("initial_position", {}).get("offset", (0.0, 0.0, 0.0)))
    return x, y, z + lift


def hover_thrusts(sampled: Mapping[str, Any], lift: float = 0.0) -> list[float]:
    """Return rotor thrusts (N) that balance the level vehicle and its payload at the start, within their limits."""
    mass = robot.MASS * sampled.get("mass_scale", {}).get("factor", 1.0)
    payload = sampled.get("payload")
    moment_x = moment_y = 0.0
    if payload is not None and payload["attach_time"] == 0.0 < payload["detach_time"]:
        x, y, _ = payload["position"]
        mass += payload["mass"]
        moment_x, moment_y = payload["mass"] * GRAVITY * y, -payload["mass"] * GRAVITY * x
    gain = 1.0
    if "ground_effect" in sampled:
        gain = thrust_gain(start(sampled, lift)[2], robot.ROTOR_RADIUS, sampled["ground_effect"]["strength"], max)
    balance = robot.thrusts(mass * GRAVITY, moment_x, moment_y, 0.0)
    return [min(max(thrust / gain, 0.0), robot.MAX_THRUST) for thrust in balance]


_THRUST_SCALE = 1.0 / (len(robot.ROTORS) * robot.MAX_THRUST**2)
