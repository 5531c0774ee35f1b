"""Limits of an arm's file hold in both directions, and a reference that the arm cannot follow is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artde_gym.disturbances.schedule import force_of
from artde_gym.disturbances.wind import air
from artde_gym.errors import OptionError, RobotError
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reader import read_arm
from artde_gym.robots.arm.reference import home, reference

BODY = '<mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
MJCF = """<mujoco><worldbody><body name="b"><joint name="turn" {joint}/><geom size="0.1"/></body></worldbody>
<actuator>{actuator}</actuator></mujoco>"""
URDF = f"""<robot name="r"><link name="a"/><link name="b"><inertial>{BODY}</inertial></link>
<joint name="turn" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>{{limit}}</joint></robot>"""


def mjcf(folder: Path, joint: str = "", actuator: str = "") -> Path:
    return written(folder, MJCF.format(joint=joint, actuator=actuator))


def written(folder: Path, text: str) -> Path:
    path = folder / "arm.xml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("joint", "actuator", "effort"),
    [
        ('actuatorfrcrange="-5 50"', "", 5.0),
        ('actuatorfrcrange="-50 5"', "", 5.0),
        ('actuatorfrcrange="-50 50"', "", 50.0),
        ("", '<position joint="turn" kp="9" forcerange="-20 30" gear="2"/>', 40.0),
        ("", '<position joint="turn" kp="9" forcerange="-20 30" gear="-2"/>', 40.0),
        ("", '<motor joint="turn" ctrlrange="-1 2" gear="30"/>', 30.0),
        ("", '<motor joint="turn" ctrlrange="-1 2" gear="30" forcerange="-0.5 9"/>', 15.0),
        ("", '<position joint="turn" kp="9" ctrlrange="-1 1" forcerange="-20 20"/>', 20.0),  # of positions
    ],
)
def test_the_smaller_bound_holds_in_both_directions(joint: str, actuator: str, effort: float, tmp_path: Path) -> None:
    assert read_arm(mjcf(tmp_path, joint, actuator)).by_name["turn"].effort == effort


@pytest.mark.parametrize(
    ("joint", "said"),
    [
        ('actuatorfrcrange="-9 9" damping="-1"', "damping of joint 'turn' in arm.xml is -1.0; allowed: a number >= 0"),
        ('actuatorfrcrange="5 9"', "effort of joint 'turn' in arm.xml is -5.0"),
        ('actuatorfrcrange="0 9"', "effort of joint 'turn' in arm.xml is"),
    ],
)
def test_mjcf_of_no_motor_is_refused(joint: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=said):
        read_arm(mjcf(tmp_path, joint))


@pytest.mark.parametrize(("limit", "value"), [('<limit effort="0" velocity="1"/>', "0.0"), ("", "inf")])
def test_an_effort_is_told_as_it_was_written(limit: str, value: str, tmp_path: Path) -> None:
    with pytest.raises(RobotError, match=f"effort of joint 'turn' in arm.xml is {value}; allowed: a finite number"):
        read_arm(written(tmp_path, URDF.format(limit=limit)))


TIME = 0.001 * np.arange(1001)
SPEED = '<limit effort="80" velocity="3"/>'


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"times": [0, 1], "points": [[0], [9]]},
            r"speed of the reference of turn is 16.8\d+; allowed: at most 3 rad/s",
        ),
        ({"amplitude": 9.0, "frequency": 1.0}, "speed of the reference of turn"),
        ({"amplitude": 1e-9, "frequency": 1e6}, "frequency of the reference is 1000000.0; allowed: below 294"),
    ],
)
def test_a_reference_that_the_arm_cannot_follow_is_refused(given: object, said: str, tmp_path: Path) -> None:
    arm = read_arm(written(tmp_path, URDF.format(limit=SPEED)))
    reference(arm, {"times": [0, 1], "points": [[0], [1.5]]}, TIME)
    with pytest.raises(OptionError, match=said):
        reference(arm, given, TIME)


def test_a_limit_of_position_holds_for_an_arm_of_a_file_and_for_the_built_in_one(tmp_path: Path) -> None:
    text = URDF.format(limit='<limit lower="-2" upper="2" effort="80" velocity="30"/>')
    arm = read_arm(written(tmp_path, text.replace("continuous", "revolute")))
    with pytest.raises(OptionError, match="above -2, below 2"):
        reference(arm, {"times": [0, 1], "points": [[0], [9]]}, TIME)
    far = [home(panda()).tolist(), (home(panda()) + 9.0).tolist()]
    with pytest.raises(OptionError, match="reference of"):
        reference(panda(), {"times": [0, 1], "points": far}, TIME)


def test_an_axis_of_infinite_length_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="of a finite length"):
        read_arm(written(tmp_path, URDF.format(limit=SPEED).replace("0 1 0", "1e300 0 0")))


@pytest.mark.parametrize("size", [5e-324, 1e-300, 1.0, 1e3])
def test_a_direction_has_any_length(size: float) -> None:
    assert force_of({"direction": [size, 0.0, 0.0], "magnitude": 20.0}) == (20.0, 0.0, 0.0)
    wind = {"steady": [0.0] * 3, "scale": 1.0, "fan_speed": 3.0, "fan_position": [0.0] * 3, "fan_radius": 1.0}
    blown = air({**wind, "fan_direction": [0.0, size, 0.0]})
    assert (blown.axis_x, blown.axis_y, blown.axis_z) == (0.0, 1.0, 0.0)


def test_a_direction_is_normalized_as_before() -> None:
    drawn = np.random.default_rng(0).normal(size=(100, 3))
    for direction in drawn:
        expected = 20.0 * direction / np.linalg.norm(direction)
        assert force_of({"direction": direction.tolist(), "magnitude": 20.0}) == tuple(expected.tolist())
