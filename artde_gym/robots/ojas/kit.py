"""Plug-in of Ojas: its environments, scenarios, frontiers and presentation.

Each scenario varies a push on the torso (0.5 to 5 N for 0.2 s at 1 s, from any side), the friction (0.7 to 0.9) and the
payload's position (by up to 1 cm).

The thesis applies a ground reaction force in all of its scenarios; S1 to S3 omit it. S1-GRF33 to S3-GRF50 add it, a
double hump of 1 s from each landing, of 33, 45 or 50 % of the robot's nominal weight. 45 % is fitted to the thesis'
pattern of falls in MuJoCo. 33 and 50 % bracket it.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from artde_gym.kit import Environment, FrontierTest, Motion, Push, Range, RobotKit, random_push
from artde_gym.robots.ojas.model import ojas
from artde_gym.robots.ojas.pushes import ARM_PUSH, CHEST_PUSH
from artde_gym.robots.ojas.thesis import REPORTED
from artde_gym.scenarios import Scenario

_WALK, _PUSH = "BipedWalk-Payload-v0", "BipedPush-v0"
_KICK = {
    "body": "torso",
    "magnitude": {"uniform": [0.5, 5.0]},
    "direction": [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0],
    "start": 1.0,
    "duration": 0.2,
}
_VARIATION: dict[str, Any] = {"push": [_KICK], "friction": {"uniform": [0.7, 0.9]}}
_PAYLOAD: dict[str, Any] = {
    "mass": 1.3,
    "position": [{"uniform": [-0.01, 0.01]}, {"uniform": [-0.01, 0.01]}, {"uniform": [0.15, 0.17]}],
}
_SLOW = {"control_period": 0.004}
_S2 = {"payload": _PAYLOAD, **_VARIATION}
_S3 = {**_S2, "push": [_KICK, CHEST_PUSH, ARM_PUSH]}
_PHASES = ((0.0, 28.0), (28.0, 37.0), (37.0, math.inf))
_LEFT_OUT = "omits the thesis' ground force"
_PUSHES = f"walk with a payload, pushes of 10 N at 28 s (chest) and 37 s (left arm); {_LEFT_OUT}"
FITTED = "fitted to the thesis' falls in MuJoCo"
"""Remark on the size of 45 % of the weight, in the texts of scenarios and claims."""


def _with_ground_force(name: str, percent: int) -> Scenario:
    """Return S1, S2 or S3 with the thesis' ground force, in percent of the weight."""
    env_id, disturbances, phases = {"S1": (_WALK, _VARIATION, ()), "S2": (_WALK, _S2, ()), "S3": (_PUSH, _S3, _PHASES)}[
        name
    ]
    pulse = {"shape": "double_hump", "share": percent / 100, "duration": 1.0, "trigger": "contact"}
    text = f"{name} with the thesis' ground force, {percent} % of the weight" + (
        f" ({FITTED})" if percent == 45 else ""
    )
    return Scenario(f"{name}-GRF{percent}", env_id, {}, {**disturbances, "grf_pulse": pulse}, text, name, phases)


_SCENARIOS = (
    Scenario("S1", _WALK, {}, _VARIATION, f"walk without payload, L = 1 ms; {_LEFT_OUT}", "S1"),
    Scenario("S2", _WALK, {}, _S2, f"walk with a payload of 1.3 kg, L = 1 ms; {_LEFT_OUT}", "S2"),
    Scenario("S3", _PUSH, {}, _S3, _PUSHES, "S3", _PHASES),
    Scenario(
        "S1-L4", _WALK, _SLOW, _VARIATION, "walk without payload, L = 4 ms: a quarter of the joint stiffness", "S1"
    ),
    Scenario("S2-L4", _WALK, _SLOW, _S2, "walk with a payload of 1.3 kg, L = 4 ms", "S2"),
    Scenario("S3-L4", _PUSH, _SLOW, _S3, "walk with a payload and the pushes of S3, L = 4 ms", "S3", _PHASES),
    *(_with_ground_force(name, percent) for name in ("S1", "S2", "S3") for percent in (33, 45, 50)),
)

_STRIDE = (5.0, 7.0)  # s, two steps of 1 s in steady walking
_FRONTIER = FrontierTest(
    scenario="S2",
    duration=12.0,
    when=_STRIDE,
    repeated={
        "push": [random_push("chest", _STRIDE)],
        "actuator_effectiveness": [{"joint": "all"}],
        "initial_pose": [{"joint": "all"}],
        "grf_pulse": {"shape": "double_hump", "duration": 1.0, "trigger": "contact"},
    },
    time_step=0.001,
    ranges={
        "push.magnitude": Range(0.0, 60.0, 2.0),
        "payload.mass": Range(0.5, 5.0, 0.25),
        "grf_pulse.magnitude": Range(20.0, 60.0, 2.0, duration=20.0),
        "grf_pulse.share": Range(0.2, 0.7, 0.02, duration=20.0),
        "friction.coefficient": Range(0.05, 0.8, 0.05, "smaller"),
        "slope.pitch_deg": Range(0.0, 10.0, 0.5),
        "slope.roll_deg": Range(0.0, 10.0, 0.5),
        "sensor_noise.position": Range(0.0, 0.01, 0.00025),
        "sensor_noise.velocity": Range(0.0, 1.0, 0.025),
        "encoder_bits.bits": Range(8.0, 20.0, 1.0, "smaller"),
        "action_delay.steps": Range(0.0, 10.0, 1.0),
        "motor_lag.time_constant": Range(0.0, 0.02, 0.001),
        "actuator_effectiveness.factor": Range(0.0, 1.0, 0.05, "smaller"),
        "mass_scale.factor": Range(1.0, 2.0, 0.05),
        "control_period": Range(0.001, 0.02, 0.001),
        "speed": Range(0.0, 0.25, 0.01),
        "gains.m_bar": Range(0.03, 0.09, 0.006, "smaller"),
    },
)

KIT = RobotKit(
    name="ojas",
    title="biped",
    model=ojas,
    joints=ojas().actuated,
    environments=(
        Environment(
            _WALK,
            "artde_gym.envs.biped_walk:BipedWalkPayloadEnv",
            "artde_gym.envs.biped_walk:BipedWalkPayloadVectorEnv",
            main=("S1", "S2", "S1-L4", "S2-L4"),
        ),
        Environment(
            _PUSH,
            "artde_gym.envs.biped_push:BipedPushEnv",
            "artde_gym.envs.biped_push:BipedPushVectorEnv",
        ),
    ),
    capabilities=frozenset(
        {
            "actuators",
            "armature",
            "contact",
            "effects",
            "encoders",
            "feet",
            "joints",
            "legs",
            "mass",
            "payload",
            "sensors",
            "sites",
            "torque_limit",
        }
    ),
    scenarios=_SCENARIOS,
    reproduced=(
        (
            *("S1", "S2", "S3", "S1-L4", "S2-L4", "S3-L4"),
            *(f"{name}-GRF{percent}" for name in ("S1", "S2", "S3") for percent in (33, 45, 50)),
        ),
        ("tde", "atde", "artde", "tde-stiff"),
    ),
    reported=REPORTED,
    frontier=_FRONTIER,
    motion=Motion("walk", 6.0, 2.0),
    push=Push("chest", 20.0),
    report="artde_gym.robots.ojas.report",
    scene="artde_gym.robots.ojas.scene:scene",
    multiverse=Path(__file__).parent / "assets/multiverse.yaml",
)
