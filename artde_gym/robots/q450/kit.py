"""What a plug-in says of the Q450: its environments, scenarios and frontiers, and how it is shown.

Each scenario varies by the air, by a payload within 5 % of its mass and 5 mm of its place (as it is weighed and
gripped), and by a start within 5 mm of the path (as a vehicle hovers there).
"""

from __future__ import annotations

from typing import Any

from artde_gym.kit import Environment, FrontierTest, Motion, Push, Range, RobotKit, random_push
from artde_gym.robots.q450.model import ROTORS, q450
from artde_gym.robots.q450.thesis import REPORTED
from artde_gym.scenarios import Scenario

_INFINITY = "QuadInfinity-Payload-v0"
_LOAD: dict[str, Any] = {
    "mass": {"uniform": [0.95 * 0.35, 1.05 * 0.35]},
    "position": [{"uniform": [0.005, 0.015]}, {"uniform": [-0.005, 0.005]}, {"uniform": [-0.105, -0.095]}],
    "drop": 35.0,
}
_FLIGHT: dict[str, Any] = {
    "payload": _LOAD,
    "ground_effect": 1.0,
    "initial_position": {"offset": [{"uniform": [-0.005, 0.005]}] * 3},
}

_SCENARIOS = (
    Scenario("Q1", _INFINITY, {}, {**_FLIGHT, "wind": 1.0}, "infinity loops with a payload of 0.35 kg, wind", "Q1"),
    Scenario("Q1-calm", _INFINITY, {}, _FLIGHT, "Q1 without wind"),
    Scenario("Q1-gale", _INFINITY, {}, {**_FLIGHT, "wind": 2.0}, "Q1 in wind of twice the strength", "Q1"),
)

_LOOP = (6.0, 16.0)  # s, half a loop at full speed
_FRONTIER = FrontierTest(
    scenario="Q1",
    duration=20.0,
    when=_LOOP,
    repeated={
        "push": [random_push("body", _LOOP)],
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
)

KIT = RobotKit(
    name="q450",
    title="quadrotor",
    model=q450,
    joints=ROTORS,
    environments=(
        Environment(
            _INFINITY,
            "artde_gym.envs.quadrotor:QuadInfinityPayloadEnv",
            "artde_gym.envs.quadrotor_batch:QuadInfinityPayloadVectorEnv",
            main=("Q1", "Q1-calm", "Q1-gale"),
        ),
    ),
    capabilities=frozenset(
        {"actuators", "cable", "effects", "flight", "mass", "payload", "rotors", "sensors", "sites"}
    ),
    defaults={"payload.position": (0.01, 0.0, -0.1), "push.body": "body"},
    scenarios=_SCENARIOS,
    reproduced=(
        ("Q1", "Q1-calm", "Q1-gale"),
        ("tde", "atde", "artde", "asmc", "pid", "geometric", "indi"),
    ),
    reported=REPORTED,
    frontier=_FRONTIER,
    motion=Motion("flight", 4.0, 29.0),
    push=Push("body", 3.0),
    report="artde_gym.robots.q450.report",
)
