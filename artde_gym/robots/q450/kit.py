"""Plug-in of the Q450: its environments, scenarios, frontiers and presentation.

Each scenario varies the wind, the payload's mass (by 5 %) and position (by 5 mm), as weighing and gripping do, and the
start (within 5 mm of the path), as hovering does.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from artde_gym.kit import PAYLOAD, Environment, FrontierTest, Motion, Push, Range, RobotKit, random_push
from artde_gym.robots.q450.infinity import LIFTED_FAN
from artde_gym.robots.q450.model import ROTORS, q450
from artde_gym.robots.q450.thesis import REPORTED
from artde_gym.scenarios import Scenario

_INFINITY, _SLING = "QuadInfinity-Payload-v0", "QuadSling-Payload-v0"
KICK = 0.8  # m/s, that a kick gives a load which hangs free


def kick(mass: float) -> dict[str, Any]:
    """Return a push for 0.2 s at 20 s, from any side, that gives a load of `mass` (kg) the speed `KICK`."""
    return {**random_push(PAYLOAD, (20.0, 20.0)), "magnitude": round(KICK * mass / 0.2, 6)}


_LOAD: dict[str, Any] = {
    "mass": {"uniform": [0.95 * 0.35, 1.05 * 0.35]},
    "position": [{"uniform": [0.005, 0.015]}, {"uniform": [-0.005, 0.005]}, {"uniform": [-0.105, -0.095]}],
    "detach_time": 35.0,
}
_FLIGHT: dict[str, Any] = {
    "payload": _LOAD,
    "ground_effect": 1.0,
    "initial_position": {"offset": [{"uniform": [-0.005, 0.005]}] * 3},
}

_SLUNG: dict[str, Any] = {
    "payload": {
        "mass": {"uniform": [0.95 * 0.35, 1.05 * 0.35]},
        "cable": 0.5,
        "position": [{"uniform": [-0.005, 0.005]}] * 2 + [{"uniform": [-0.055, -0.045]}],
        "detach_time": 35.0,
    },
    "push": [kick(0.35)],
    "initial_position": _FLIGHT["initial_position"],
}


_SCENARIOS = (
    Scenario("Q1", _INFINITY, {}, {**_FLIGHT, "wind": 1.0}, "infinity loops with a payload of 0.35 kg, wind", "Q1"),
    Scenario("Q1-calm", _INFINITY, {}, _FLIGHT, "infinity loops with a payload of 0.35 kg, no wind"),
    Scenario(
        "Q1-gale",
        _INFINITY,
        {},
        {**_FLIGHT, "wind": 2.0},
        "infinity loops with a payload of 0.35 kg, wind twice as strong",
        "Q1",
    ),
    Scenario(
        "Q-sling",
        _SLING,
        {"duration": 45.0},
        {**_SLUNG, "wind": {"scale": 1.0, "fan_position": LIFTED_FAN}},
        "infinity loop with 0.35 kg on a cable of 0.5 m, wind; the load is kicked at 20 s and released at 35 s",
    ),
    Scenario(
        "Q-sling-calm", _SLING, {"duration": 45.0}, _SLUNG, "infinity loop with a kicked load on a cable, no wind"
    ),
    Scenario(
        "Q-sling-gale",
        _SLING,
        {"duration": 45.0},
        {**_SLUNG, "wind": {"scale": 2.0, "fan_position": LIFTED_FAN}},
        "infinity loop with a kicked load on a cable, wind twice as strong",
    ),
    Scenario(
        "Q-sling-late",
        _SLING,
        {"duration": 45.0},
        {**_SLUNG, "wind": {"scale": 1.0, "fan_position": LIFTED_FAN}, "cable_delay": {"steps": 4}},
        "infinity loop with a kicked load on a cable, measured 60 ms late",
    ),
)

_LOOP = (6.0, 16.0)  # s, half a loop at full speed
_FRONTIER = FrontierTest(
    scenario="Q1",
    duration=20.0,
    when=_LOOP,
    repeated={
        "push": [random_push("body", _LOOP)],
        "actuator_effectiveness": [{"joint": "front_left", "start": {"uniform": list(_LOOP)}}],
    },
    time_step=0.005,
    ranges={
        "wind.scale": Range(0.0, 10.0, 0.25),
        "payload.mass": Range(0.1, 2.0, 0.05),
        "push.magnitude": Range(0.0, 60.0, 2.0),
        "action_delay.steps": Range(0.0, 10.0, 1.0),
        "motor_lag.time_constant": Range(0.0, 0.2, 0.005),
        "actuator_effectiveness.factor": Range(0.0, 1.0, 0.05, "smaller"),
        "mass_scale.factor": Range(0.5, 2.0, 0.05),
        "ground_effect.strength": Range(0.0, 10.0, 0.5),
        "sensor_noise.position": Range(0.0, 0.1, 0.0025),
        "sensor_noise.velocity": Range(0.0, 1.0, 0.025),
        "control_period": Range(0.005, 0.05, 0.005),
    },
)

_SLING_FRONTIER = dataclasses.replace(
    _FRONTIER,
    scenario="Q-sling",
    repeated={**_FRONTIER.repeated, "push": [random_push("payload", _LOOP)]},
    ranges={
        **_FRONTIER.ranges,
        "payload.mass": Range(0.05, 1.5, 0.05),
        "payload.cable": Range(0.1, 1.3, 0.05),
        "push.magnitude": Range(0.0, 20.0, 0.5),
        "cable_delay.steps": Range(0.0, 20.0, 1.0),
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
            "artde_gym.envs.quadrotor_vector:QuadInfinityPayloadVectorEnv",
            main=("Q1", "Q1-calm", "Q1-gale"),
        ),
        Environment(
            _SLING,
            "artde_gym.envs.quadrotor_sling:QuadSlingPayloadEnv",
            "artde_gym.envs.quadrotor_sling_vector:QuadSlingPayloadVectorEnv",
            main=("Q-sling", "Q-sling-calm", "Q-sling-gale"),
            frontier=_SLING_FRONTIER,
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
    scene="artde_gym.robots.q450.scene:scene",
    multiverse=Path(__file__).parent / "assets/multiverse.yaml",
)
