"""Arms from files: exact against Pinocchio and MuJoCo where they are sound, named faults where they are not."""

import importlib.util
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from artde_gym.errors import RobotError
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.model_file import MAX_BYTES
from artde_gym.robots.arm.reader import read_arm

mj: Any = mujoco
TIGHT: Any = {"rtol": 0, "atol": 1e-9}

INERTIA = '<mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
BODY = f"<inertial>{INERTIA}</inertial>"
MESH = '<visual><geometry><mesh filename="{0}"/></geometry></visual>'
LIMIT = '<limit lower="-1" upper="1" effort="10" velocity="1"/>'


def link(name: str, inertial: str = BODY) -> str:
    return f'<link name="{name}">{inertial}</link>'


def joint(name: str, parent: str, child: str, kind: str = "revolute", axis: str = "0 1 0", more: str = LIMIT) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="0 0 0.3"/><axis xyz="{axis}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{more}</joint>'


def robot(*parts: str) -> str:
    return f'<?xml version="1.0"?><robot name="r">{"".join(parts)}</robot>'


TWO = robot(link("a"), link("b"), joint("j", "a", "b"))

MJCF = """
<mujoco model="written">
  <compiler angle="degree" autolimits="true"/>
  <default><joint armature="0.1" damping="2"/><default class="stiff"><joint frictionloss="0.3"/></default></default>
  <asset><mesh name="shell" file="not_there.stl"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="turret" pos="0 0 0.2" euler="10 20 30">
      <inertial pos="0.01 0.02 0.03" mass="2" fullinertia="0.02 0.03 0.025 0.001 -0.002 0.003"/>
      <joint name="yaw" axis="0 0 1" pos="0.05 0 0.02" range="-170 170" actuatorfrcrange="-50 50"/>
      <geom type="mesh" mesh="shell"/>
      <body name="boom" pos="0.1 0 0.3" quat="0.8 0.1 -0.3 0.2">
        <joint name="lift" class="stiff" axis="1 1 0" range="-90 90"/>
        <geom type="capsule" fromto="0 0 0 0.3 0 0.1" size="0.04" mass="1.5"/>
        <body name="plate" pos="0.3 0 0.1" euler="0 40 0">
          <geom type="box" size="0.05 0.02 0.01" mass="0.4"/>
          <body name="rail" pos="0 0 0.05">
            <joint name="reach" type="slide" axis="0 0 1" range="-0.1 0.3" armature="0.7"/>
            <geom type="sphere" size="0.05" mass="0.8"/>
            <body name="left" pos="0 0.02 0"><joint name="l" type="slide" axis="0 1 0" range="0 0.04"/>
              <geom type="box" size="0.01 0.01 0.02" mass="0.05"/></body>
            <body name="right" pos="0 -0.02 0"><joint name="r" type="slide" axis="0 -1 0" range="0 0.04"/>
              <geom type="box" size="0.01 0.01 0.02" mass="0.05"/></body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="l" joint2="r"/></equality>
  <actuator><position joint="lift" kp="100" forcerange="-20 20" gear="2"/>
    <motor joint="reach" forcerange="-90 90"/></actuator>
</mujoco>
"""


def written(folder: Path, text: str, name: str = "robot.xml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


# ------------------------------------------------------------------------------------------------------- sound files


@pytest.mark.bullet
@pytest.mark.pinocchio
@pytest.mark.parametrize("name", ["kuka_iiwa/model.urdf", "franka_panda/panda.urdf"])
def test_arms_that_pybullet_ships_agree_with_pinocchio(name):
    import pinocchio

    pin: Any = pinocchio
    found = importlib.util.find_spec("pybullet_data")
    assert found is not None
    assert found.origin is not None
    path = Path(found.origin).parent / name
    spec = read_arm(path)
    ours = RigidBodyTree(spec)
    whole = pin.buildModelFromUrdf(str(path))
    others = [whole.getJointId(joint) for joint in whole.names[1:] if joint not in spec.actuated]
    model = pin.buildReducedModel(whole, others, pin.neutral(whole))
    data, rng = model.createData(), np.random.default_rng(0)
    assert list(model.names[1:]) == list(spec.actuated)
    for _ in range(100):
        q, qd, qdd = rng.uniform(-2.0, 2.0, ours.n), *rng.normal(size=(2, ours.n))
        upper = np.triu(pin.crba(model, data, q))
        np.testing.assert_allclose(ours.joint_mass_matrix(q), upper + np.triu(upper, 1).T, **TIGHT)
        np.testing.assert_allclose(ours.joint_torques(q, qd, qdd), pin.rnea(model, data, q, qd, qdd), **TIGHT)


def test_a_written_mjcf_is_the_model_that_mujoco_compiles_of_it(tmp_path):
    spec = read_arm(written(tmp_path, MJCF))
    ours = RigidBodyTree(spec)
    assert spec.actuated == ours.joints == ("yaw", "lift", "reach")
    assert spec.torque_limits == (50.0, 40.0, 90.0)
    assert spec.armature == (0.1, 0.1, 0.7)
    assert [spec.by_name[name].damping for name in spec.actuated] == [2.0] * 3
    assert [spec.by_name[name].coulomb for name in spec.actuated] == [0.0, 0.3, 0.0]
    assert spec.by_name["yaw"].limits == pytest.approx((-math.radians(170), math.radians(170)))
    bare = MJCF.replace('<asset><mesh name="shell" file="not_there.stl"/></asset>', "")
    bare = bare.replace('<geom type="mesh" mesh="shell"/>', "").replace('damping="2"', "").replace("</equality>", "")
    bare = bare.replace('<equality><joint joint1="l" joint2="r"/>', "")
    model = mj.MjModel.from_xml_string(bare)
    model.dof_frictionloss[:] = 0.0
    data, dense, rng = mj.MjData(model), np.zeros((5, 5)), np.random.default_rng(0)
    for _ in range(100):
        q, qd = rng.uniform(-1.0, 1.0, 3), rng.normal(size=3)
        data.qpos[:], data.qvel[:] = [*q, 0.0, 0.0], [*qd, 0.0, 0.0]
        mj.mj_forward(model, data)
        mj.mj_fullM(model, data, dense)
        np.testing.assert_allclose(ours.joint_mass_matrix(q), dense[:3, :3], **TIGHT)
        np.testing.assert_allclose(ours.joint_torques(q, qd, 0 * qd), data.qfrc_bias[:3], **TIGHT)


def test_links_without_mass_take_that_of_links_fixed_to_them(tmp_path):
    text = robot(link("a"), link("b", ""), link("c"), joint("j", "a", "b"), joint("k", "b", "c", "fixed"))
    spec = read_arm(written(tmp_path, text))
    assert [body.name for body in spec.links] == ["base", "j"]
    assert spec.by_name["j"].com == (0.0, 0.0, 0.3)
    assert {name: point for name, _, point in spec.sites}["tool"] == (0.0, 0.0, 0.3)


def test_a_gripper_is_locked_where_it_may_be(tmp_path):
    half = LIMIT.replace('"-1"', '"0.5"')
    mimic = LIMIT + '<mimic joint="l"/>'
    text = robot(
        *map(link, "abcd"),
        joint("j", "a", "b"),
        joint("l", "b", "c", "prismatic", more=half),
        joint("r", "b", "d", "prismatic", axis="0 -1 0", more=mimic),
    )
    spec = read_arm(written(tmp_path, text))
    assert spec.actuated == ("j",)
    assert spec.by_name["j"].mass == 3.0
    assert {name: point for name, _, point in spec.sites}["c"] == (0.0, 0.5, 0.3)
    assert read_arm(tmp_path / "robot.xml", tip="c").actuated == ("j", "l")


def test_rotor_inertia_of_a_transmission_is_reflected_through_its_gear(tmp_path):
    """Drake's extension: rotor_inertia times the square of gear_ratio, the ratio 1 by default."""
    gear = '<transmission><joint name="{0}"/><actuator name="m">{1}</actuator></transmission>'
    rotor = '<drake:rotor_inertia value="{0}"/>'
    geared = gear.format("j", rotor.format(3e-5) + '<drake:gear_ratio value="100"/>')
    parts = (*map(link, "abcd"), joint("j", "a", "b"), joint("k", "b", "c"), joint("l", "c", "d"))
    text = robot(*parts, geared, gear.format("k", rotor.format(0.2)), gear.format("l", ""))
    text = text.replace("<robot ", '<robot xmlns:drake="http://drake.mit.edu" ')
    assert read_arm(written(tmp_path, text)).armature == pytest.approx((0.3, 0.2, 0.0))
    with pytest.raises(RobotError, match="value of transmission of joint 'j'"):
        read_arm(written(tmp_path, text.replace("3e-05", "-1")))


def test_points_and_rods_are_parts_of_bodies(tmp_path):
    point = "<inertial>" + INERTIA.replace('"0.01"', '"0"') + "</inertial>"
    parts = (link("a"), link("b"), link("c", point), joint("j", "a", "b"), joint("k", "b", "c", "fixed"))
    spec = read_arm(written(tmp_path, robot(*parts)))
    np.testing.assert_allclose(spec.by_name["j"].inertia, (0.01 + 0.3**2 / 2, 0.01 + 0.3**2 / 2, 0.01))
    lone = robot(link("a"), link("b", point), joint("j", "a", "b"))
    with pytest.raises(RobotError, match=r"inertia of link 'j' in robot\.xml"):
        read_arm(written(tmp_path, lone))


def test_links_that_never_move_need_no_possible_inertia(tmp_path):
    wrong = BODY.replace('izz="0.01"', 'izz="1"')
    parts = (link("a"), link("aside", wrong), link("b"), joint("i", "a", "aside"), joint("j", "a", "b"))
    assert read_arm(written(tmp_path, robot(*parts)), tip="b").mass == 1.0
    with pytest.raises(RobotError, match="inertia of link 'aside'"):
        read_arm(tmp_path / "robot.xml", tip="aside")


def test_a_base_that_branches_names_its_ends(tmp_path):
    text = robot(*map(link, "abcd"), joint("i", "a", "b"), joint("j", "a", "c"), joint("k", "c", "d"))
    with pytest.raises(RobotError, match="such as the ends 'd', 'b'"):
        read_arm(written(tmp_path, text))


@pytest.mark.parametrize(
    "file", ["nowhere.stl", "package://x_description/b.dae", "../../../../etc/passwd", "/dev/zero"]
)
def test_meshes_never_stop_a_model(tmp_path, file):
    text = robot(link("a"), link("b", BODY + MESH.format(file)), joint("j", "a", "b"))
    assert read_arm(written(tmp_path, text)).actuated == ("j",)


# ------------------------------------------------------------------------------------------------------ broken files

HEAVY = "".join(f'<!ENTITY {b} "{("&" + a + ";") * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True))
BROKEN = {
    "missing inertial": (robot(link("a"), link("b", ""), joint("j", "a", "b")), "mass moved by joint 'j'"),
    "zero mass": (TWO.replace('value="1"', 'value="0"'), "mass of link 'b'"),
    "negative mass": (TWO.replace('value="1"', 'value="-1"'), "mass in the inertial of link 'a'"),
    "a mass beyond any engine": (TWO.replace('value="1"', 'value="1e308"'), "mass and moments moved by joint 'j'"),
    "a mass below any engine": (TWO.replace('value="1"', 'value="1e-300"'), "mass and moments moved by joint 'j'"),
    "moments below any engine": (TWO.replace('"0.01"', '"1e-20"'), "mass and moments moved by joint 'j'"),
    "nan mass": (TWO.replace('value="1"', 'value="nan"'), "value of the mass"),
    "infinite moment": (TWO.replace('ixx="0.01"', 'ixx="inf"'), "ixx of the inertial"),
    "no triangle": (TWO.replace('izz="0.01"', 'izz="0.1"'), "inertia of link 'b'"),
    "no mass element": (TWO.replace('<mass value="1"/>', ""), "value of the mass"),
    "no moment": (TWO.replace('iyy="0.01"', ""), "iyy of the inertial"),
    "two parents": (robot(*map(link, "abc"), joint("j", "a", "b"), joint("k", "c", "b")), "joint of link 'b'"),
    "cycle": (
        robot(*map(link, "abc"), joint("j", "a", "b"), joint("k", "b", "c"), joint("m", "c", "b")),
        "joint of link 'b'",
    ),
    "pure cycle": (robot(*map(link, "ab"), joint("j", "a", "b"), joint("k", "b", "a")), "links without a parent"),
    "loop apart": (
        robot(*map(link, "abcd"), joint("j", "a", "b"), joint("k", "c", "d"), joint("m", "d", "c")),
        "links in a loop",
    ),
    "two roots": (robot(*map(link, "abc"), joint("j", "a", "b")), "links without a parent"),
    "unknown parent": (robot(link("b"), joint("j", "zzz", "b")), "parent of joint 'j'"),
    "no child": (robot(link("a"), '<joint name="j" type="fixed"><parent link="a"/></joint>'), "child of joint 'j'"),
    "duplicate link": (robot(link("a"), link("b"), link("b"), joint("j", "a", "b")), "name of a link"),
    "duplicate joint": (robot(*map(link, "abc"), joint("j", "a", "b"), joint("j", "b", "c")), "name of a joint"),
    "no name": (robot(link("a"), link(""), joint("j", "a", "b")), "name of a link"),
    "reserved name": (robot(link("a"), link("b"), joint("payload", "a", "b")), "name of a joint"),
    "floating": (robot(link("a"), link("b"), joint("j", "a", "b", "floating")), "type of joint 'j'"),
    "planar": (robot(link("a"), link("b"), joint("j", "a", "b", "planar")), "type of joint 'j'"),
    "no type": (TWO.replace('type="revolute"', ""), "type of joint 'j'"),
    "zero axis": (robot(link("a"), link("b"), joint("j", "a", "b", axis="0 0 0")), "axis of joint 'j'"),
    "short axis": (robot(link("a"), link("b"), joint("j", "a", "b", axis="0 1")), "axis of joint 'j'"),
    "word for a number": (TWO.replace("0 0 0.3", "0 0 up"), "origin of the joint 'j'"),
    "no limit": (TWO.replace(LIMIT, ""), "limit of joint 'j'"),
    "crossed limits": (TWO.replace('lower="-1"', 'lower="2"'), "limit of joint 'j'"),
    "no effort": (TWO.replace('effort="10"', 'effort="0"'), "effort of joint 'j'"),
    "negative damping": (TWO.replace(LIMIT, LIMIT + '<dynamics damping="-1"/>'), "damping of joint 'j'"),
    "no joints": (robot(link("a")), "joints from the base"),
    "entity bomb": (f'<!DOCTYPE r [<!ENTITY a "x">{HEAVY}]>' + robot(link("&i;")), "document type"),
    "external entity": ('<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>' + robot(link("&x;")), "document type"),
    "xacro": ('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="x"/></robot>', "element of"),
    "not xml": ("hello", "XML"),
    "empty": ("", "XML"),
    "truncated": (TWO[:80], "XML"),
    "another root": ("<sdf/>", "root element"),
    "deep": ("<robot>" + "<a>" * 100_000 + "</a>" * 100_000 + "</robot>", "depth of elements"),
    "many links": (robot(*(link(f"l{i}") for i in range(201))), "links of"),
    "utf-16": (TWO.encode("utf-16-le"), "robot is"),
    "latin": (TWO.replace("<robot ", "<!--\u00e9--><robot ").encode("latin-1"), "robot is"),
    "huge": (" " * (MAX_BYTES + 1), "size of"),
}
ARM = '<body name="b"><joint name="x" actuatorfrcrange="-9 9"/><geom size="1"/>{}</body>'


def arm(old: str, new: str) -> str:
    return f"<worldbody>{ARM.replace(old, new)}</worldbody>"


BROKEN_MJCF = {
    "include": ('<include file="/etc/passwd"/><worldbody/>', "<include>"),
    "plugin": ('<extension><plugin plugin="mujoco.pid"/></extension>', "<extension>"),
    "replicate": ('<worldbody><replicate count="1000000">{}</replicate></worldbody>', "<replicate>"),
    "no bodies": ("<worldbody/>", "links of"),
    "free": ('<worldbody><body name="b"><freejoint/><geom size="1"/></body></worldbody>', "type of joint"),
    "ball": ('<worldbody><body><joint name="x" type="ball"/><geom size="1"/></body></worldbody>', "type of joint 'x'"),
    "two joints": (
        '<worldbody><body name="b"><joint name="x"/><joint name="y" axis="1 0 0"/><geom size="1"/></body></worldbody>',
        "joints of body 'b'",
    ),
    "mesh inertia": (
        '<asset><mesh name="m" file="m.stl"/></asset><worldbody><body name="b"><joint name="x"/>'
        '<geom type="mesh" mesh="m"/></body></worldbody>',
        "inertia of body 'b'",
    ),
    "loop": (
        f"<worldbody>{ARM}<body name='c'><joint/><geom size='1'/></body></worldbody>"
        '<equality><connect body1="b" body2="c" anchor="0 0 0"/></equality>',
        "equality constraint",
    ),
    "no joints": ('<worldbody><body name="b"><geom size="1"/></body></worldbody>', "joints from the base"),
    "spring": (arm('name="x"', 'name="x" stiffness="3"'), "stiffness of joint 'x'"),
    "ref": (arm('name="x"', 'name="x" ref="30"'), "ref of joint 'x'"),
    "floats": (arm("<body", '<body gravcomp="1"'), "gravcomp of body 'b'"),
    "no effort": (arm('actuatorfrcrange="-9 9"', ""), "effort of joint 'x'"),
    "spatial tendon": (
        arm("<geom", '<site name="t"/><geom').replace("<body", '<site name="s"/><body')
        + '<tendon><spatial name="rope"><site site="s"/><site site="t"/></spatial></tendon>',
        "spatial tendon",
    ),
    "unknown element": (arm("<geom", "<thing/><geom"), "model"),
    "no mass": ('<worldbody><body name="b"><joint name="x"/></body></worldbody>', "links of|model"),
}
BROKEN |= {
    f"mjcf {name}": (f"<mujoco>{text.replace('{}', '')}</mujoco>", field) for name, (text, field) in BROKEN_MJCF.items()
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_refused_by_name(tmp_path, name):
    text, field = BROKEN[name]
    path = tmp_path / "broken.xml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(RobotError, match=field) as caught:
        read_arm(path)
    assert "broken.xml" in str(caught.value)
    assert caught.value.allowed


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    for path in (tmp_path / "none.urdf", tmp_path):
        with pytest.raises(RobotError, match="robot is"):
            read_arm(path)


@pytest.mark.parametrize("armature", [-1.0, math.nan, [0.1, 0.2], "much", 1e9])
def test_an_impossible_armature_is_refused(tmp_path, armature):
    with pytest.raises(RobotError, match="armature"):
        read_arm(written(tmp_path, TWO), armature=armature)


def test_an_unknown_tip_is_refused_with_a_suggestion(tmp_path):
    with pytest.raises(RobotError, match="a, b"):
        read_arm(written(tmp_path, TWO), tip="bb")
