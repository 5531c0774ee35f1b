"""What the single and the batched quadrotor share: layouts, reward, end of an episode, documentation."""

from __future__ import annotations

import math

from artde_gym.layout import Field, Layout
from artde_gym.robots import q450 as robot

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
