"""What the single and the batched quadrotor share: layouts, reward, end of an episode, documentation."""

from __future__ import annotations

import math

import numpy as np

from artde_gym.arrays import Array
from artde_gym.layout import Field, Layout
from artde_gym.robots import q450 as robot
from artde_gym.tracking import Effort, Fields, Tracked, Tracking

GRID = 0.005  # s: control periods are whole multiples of it; the air is sampled on it
DURATION = 70.0  # s
DROP = 35.0  # s

VOLUME = 3.0  # m, of flight: to either side of the start, and above the ground
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
)
"""Position and attitude, as in table 3.1 of the thesis; an error of 2 cm counts as recovered."""
