"""What the single and the batched quadrotor share: layouts, reward, end of an episode, documentation."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.ground_effect import thrust_gain
from artde_gym.layout import Field, Layout
from artde_gym.references.infinity import START, infinity_path
from artde_gym.robots import q450 as robot
from artde_gym.robots.dynamics import GRAVITY
from artde_gym.robots.spec import Vector
from artde_gym.tracking import Effort, Fields, Tracked, Tracking

DEFAULT_DISTURBANCES: dict[str, Any] = {"payload": {"mass": 0.35, "drop": 35.0}, "wind": 1.0, "ground_effect": 1.0}

VOLUME = 3.0  # m, of flight: to either side of the start, and above the ground
TUMBLING = 30.0  # rad/s, rate of turning that is out of bounds too
GROUND_HEIGHT = 0.1  # m, of the vehicle's origin when the skids touch the ground
MAX_RATE = 1000.0  # rad/s, bound of observed body rates
MAX_SPEED = 100.0  # m/s, likewise

OBSERVATION = Layout(
    (
        Field("position", 3, "m", -10.0, 10.0, "vehicle's centre of mass without payload, world axes"),
        Field("velocity", 3, "m/s", -MAX_SPEED, MAX_SPEED, "of that point, world axes"),
        Field("rot_body_to_world", 9, "1", -1.01, 1.01, "rotation matrix R, row by row"),
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
            "mean [u1, u2, u3, u4] that the rotors really gave over the last control period",
        ),
        Field("rotor_thrust", 4, "N", 0.0, robot.MAX_THRUST, "thrust of each rotor at this instant"),
        Field("phase", 1, "1", 0.0, 1.0, "time over duration"),
    )
)
MEASURED = slice(0, OBSERVATION["body_rates"].stop)  # what sensors give
REFERENCE = slice(MEASURED.stop, OBSERVATION["yaw_rate_ref"].stop)
APPLIED = slice(REFERENCE.stop, OBSERVATION["rotor_thrust"].stop)
PHASE = OBSERVATION["phase"].start
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
    """All that the observation tells of (phi, theta, psi): the other two references are the policy's own."""
    rot = fields["rot_body_to_world"]
    error = fields["yaw_ref"][..., 0] - np.arctan2(rot[..., 3], rot[..., 0])
    unknown = np.full_like(error, np.nan)
    return np.stack([unknown, unknown, (error + math.pi) % (2.0 * math.pi) - math.pi], axis=-1)


def _induced_power(fields: Fields) -> Array:
    """Sum of T^1.5 / sqrt(2 rho A), what ideal rotors need to hover (W)."""
    disc = math.pi * robot.ROTOR_RADIUS**2
    return (np.maximum(fields["rotor_thrust"], 0.0) ** 1.5).sum(axis=-1) / math.sqrt(2.0 * AIR_DENSITY * disc)


TRACKING = Tracking(
    errors=(
        Tracked("m", 1.0, {"x": 0, "y": 1, "z": 2}, lambda fields: fields["position_ref"] - fields["position"]),
        Tracked("deg", 180.0 / math.pi, {"phi": 0, "theta": 1, "psi": 2}, _heading_error, diagnostic="attitude_error"),
    ),
    norm=True,
    band=0.02,
    efforts=(
        Effort("thrust", "n", "wrench_applied", slice(0, 1), {"u1": 0}),
        Effort("torque", "nm", "wrench_applied", slice(1, 4), {"u2": 0, "u3": 1, "u4": 2}),
    ),
    power=_induced_power,
    limited="rotor_thrust",
    near=0.01,
    tde_errors={"tde_error_rms_p": "sigma_p", "tde_error_rms_q": "sigma_q"},
    means={"robust_gain_mean_p": "c_p", "robust_gain_mean_q": "c_q"},
)
"""Position and attitude, as in table 3.1 of the thesis; an error of 2 cm counts as recovered."""

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

Number = TypeVar("Number", float, Array)
Vector3 = tuple[Number, Number, Number]
Vector4 = tuple[Number, Number, Number, Number]


def reward_terms(
    error: Vector3[Number],
    velocity_error: Vector3[Number],
    up: Number,
    thrust: Vector4[Number],
    thrust_before: Vector4[Number],
    exp: Callable[[Number], Number],
) -> dict[str, Number]:
    """The reward's terms in the order of `REWARD_SCALES`, elementwise.

    Args:
        error, velocity_error: of tracking (m, m/s).
        up: world z component of the body's z axis.
        thrust, thrust_before: of the rotors now and one control period ago (N).
        exp: the exponential function for this kind of number.
    """
    x, y, z = error
    vx, vy, vz = velocity_error
    a, b, c, d = thrust
    da, db, dc, dd = a - thrust_before[0], b - thrust_before[1], c - thrust_before[2], d - thrust_before[3]
    return {
        "alive": 0.0 * x + 1.0,
        "position": exp(-100.0 * (x * x + y * y + z * z)),
        "velocity": exp(-20.0 * (vx * vx + vy * vy + vz * vz)),
        "upright": up,
        "effort": _THRUST_SCALE * (a * a + b * b + c * c + d * d),
        "smoothness": _THRUST_SCALE * (da * da + db * db + dc * dc + dd * dd),
    }


def falls(position: Vector3[Number], up: Number, rates: Vector3[Number]) -> tuple[Any, Any, Any]:
    """Whether each of `FALL_REASONS` holds, elementwise; a state that is no number any more is out of bounds."""
    x, y, z = position
    p, q, r = rates
    volume = (abs(x) <= VOLUME) & (abs(y) <= VOLUME) & (z <= VOLUME)
    spin = p * p + q * q + r * r <= TUMBLING**2
    return z < GROUND_HEIGHT, up < 0.0, (volume & spin) ^ True


def parse(disturbances: Mapping[str, Any]) -> Disturbances:
    """Read disturbances of the Q450."""
    sites = [name for name, _, _ in robot.q450().sites]
    return Disturbances.parse(disturbances, sites, robot.ROTORS, robot.q450().name)


def plan(duration: float, period: float) -> Array:
    """What the observation takes from the path, one row a control period: (samples, 15)."""
    path = infinity_path(duration, period)
    phase = path.period * np.arange(len(path.yaw)) / duration
    columns = (path.yaw, path.yaw_rate, phase)
    return np.column_stack([path.position, path.velocity, path.acceleration, path.jerk, *columns])


def start(realised: Mapping[str, Any]) -> Vector:
    """Where the vehicle is at the start (m)."""
    x, y, z = map(operator.add, START, realised.get("initial_position", {}).get("offset", (0.0, 0.0, 0.0)))
    return x, y, z


def hover_thrusts(realised: Mapping[str, Any]) -> list[float]:
    """Rotor thrusts (N) that balance the level vehicle at the start, with whatever it carries, as far as they can."""
    mass = robot.MASS * realised.get("mass_error", {}).get("factor", 1.0)
    payload = realised.get("payload")
    moment_x = moment_y = 0.0
    if payload is not None and payload["attach"] == 0.0 < payload["drop"]:
        x, y, _ = payload["position"]
        mass += payload["mass"]
        moment_x, moment_y = payload["mass"] * GRAVITY * y, -payload["mass"] * GRAVITY * x
    gain = 1.0
    if "ground_effect" in realised:
        gain = thrust_gain(start(realised)[2], robot.ROTOR_RADIUS, realised["ground_effect"]["strength"], max)
    balance = robot.thrusts(mass * GRAVITY, moment_x, moment_y, 0.0)
    return [min(max(thrust / gain, 0.0), robot.MAX_THRUST) for thrust in balance]


_THRUST_SCALE = 1.0 / (len(robot.ROTORS) * robot.MAX_THRUST**2)
