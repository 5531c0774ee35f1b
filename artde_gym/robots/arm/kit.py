"""Plug-in of arms: environment, scenarios, frontiers and presentation.

Each scenario varies the joints' friction by 30 %, about as much as published identifications of one arm differ and as
warming up changes it. Payloads are .35 to .7 of the Panda's rated 3 kg, grasped at 4 s and released at 8 s. The push of
A3 is three times the rated weight and 10 N for .2 s.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from artde_gym.kit import Environment, FrontierTest, Motion, Push, Range, RobotKit, random_push
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reference import GRASP, MULTI_SINE, RELEASE
from artde_gym.scenarios import Scenario

_TRACK = "ArmTrack-Payload-v0"
RATED = 3.0  # kg
PUSH = 100.0  # N, about 3 x 3 kg x 9.81 m/s^2 + 10 N
_FRICTION: dict[str, Any] = {"joint_friction": {"uniform": [0.7, 1.3]}}
_LOADED = {
    **_FRICTION,
    "payload": {"mass": {"uniform": [0.35 * RATED, 0.7 * RATED]}, "attach_time": GRASP, "detach_time": RELEASE},
}
_PUSHED = {**_LOADED, "push": [{**random_push("tool", (5.0, 7.5)), "magnitude": PUSH}]}
_SLOW = {"control_period": 0.004}
_ENCODED = {**_LOADED, "encoder_bits": 20}
_PHASES = ((0.0, GRASP), (GRASP, RELEASE), (RELEASE, 12.0))

_SCENARIOS = (
    Scenario("A1", _TRACK, {}, _FRICTION, "pick and place without a load, friction +-30 %"),
    Scenario(
        "A2", _TRACK, {}, _LOADED, "pick and place with a payload of 1.05 to 2.1 kg from 4 s to 8 s", phases=_PHASES
    ),
    Scenario(
        "A3", _TRACK, {}, _PUSHED, "pick and place with a payload and a push of 100 N on the tool", phases=_PHASES
    ),
    Scenario("A4", _TRACK, {"reference": MULTI_SINE}, _ENCODED, "two sines per joint, payload, encoders of 20 bits"),
    Scenario("A5", _TRACK, _SLOW, _PUSHED, "pick and place with a payload and a push, L = 4 ms", phases=_PHASES),
)

_FRONTIER = FrontierTest(
    scenario="A2",
    duration=12.0,
    when=(5.0, 7.5),
    repeated={
        "push": [random_push("tool", (5.0, 7.5))],
        "actuator_effectiveness": [{"joint": "all"}],
        "initial_pose": [{"joint": "all"}],
        "payload": {"attach_time": GRASP, "detach_time": RELEASE},
    },
    time_step=0.001,
    ranges={
        "payload.mass": Range(0.5, 5.0, 0.25),
        "joint_friction.scale": Range(0.0, 10.0, 0.5),
        "push.magnitude": Range(0.0, 500.0, 20.0),
        "mass_scale.factor": Range(1.0, 2.0, 0.05),
        "control_period": Range(0.001, 0.02, 0.001),
        "encoder_bits.bits": Range(12.0, 24.0, 1.0, "smaller"),
        "action_delay.steps": Range(0.0, 10.0, 1.0),
        "motor_lag.time_constant": Range(0.0, 0.02, 0.001),
    },
)

KIT = RobotKit(
    name="arm",
    title="arm",
    model=panda,
    joints=panda().actuated,
    environments=(
        Environment(
            _TRACK,
            "artde_gym.envs.arm:ArmTrackEnv",
            "artde_gym.envs.arm_vector:ArmTrackVectorEnv",
            main=("A1", "A2", "A3"),
        ),
    ),
    capabilities=frozenset(
        {"actuators", "effects", "encoders", "friction", "joints", "mass", "payload", "sensors", "sites"}
    ),
    defaults={"push.body": "tool", "payload.position": (0.0, 0.0, 0.0)},
    scenarios=_SCENARIOS,
    frontier=_FRONTIER,
    motion=Motion("pick and place", 0.0, 12.0),
    push=Push("tool", 30.0),
    scene="artde_gym.robots.arm.scene:scene",
    multiverse=Path(__file__).parent / "assets/multiverse.yaml",
)
