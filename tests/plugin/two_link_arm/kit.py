"""The arm as artde-gym knows it."""

from artde_gym.kit import Environment, FrontierTest, Motion, Push, Range, RobotKit
from artde_gym.scenarios import Scenario
from two_link_arm.model import Arm

_SWING = "TwoLinkArm-Swing-v0"
_LOAD = {"payload": {"mass": {"uniform": [0.4, 0.6]}}}
_KICK = {"body": "tip", "magnitude": 5.0, "start": 0.8, "duration": 0.2}

KIT = RobotKit(
    name="two-link-arm",
    title="arm",
    model=Arm,
    joints=("shoulder", "elbow"),
    environments=(Environment(_SWING, "two_link_arm.env:TwoLinkArmEnv", main=("L1",)),),
    capabilities=frozenset({"payload", "sites"}),
    defaults={"push.body": "tip"},
    scenarios=(
        Scenario("L1", _SWING, {}, _LOAD, "swing with a payload of 0.5 kg"),
        Scenario("L2", _SWING, {}, {**_LOAD, "push": [_KICK]}, "L1 with a push on the tip"),
    ),
    frontier=FrontierTest(
        scenario="L1",
        duration=2.0,
        when=(0.5, 1.0),
        repeated={"push": [{"body": "tip", "magnitude": 0.0, "start": {"uniform": [0.5, 1.0]}, "duration": 0.2}]},
        time_step=0.001,
        ranges={"payload.mass": Range(0.1, 5.0, 0.5), "push.magnitude": Range(0.0, 200.0, 10.0)},
    ),
    motion=Motion("swing", 0.0, 2.0),
    push=Push("tip", 5.0),
    scene="two_link_arm.scene:scene",
)
