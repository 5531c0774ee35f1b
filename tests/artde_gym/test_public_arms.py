"""Arms from packages of public models: dynamics of both engines against Pinocchio, tracking under designed gains.

Nothing of them is copied: these tests run where `example-robot-data` is installed.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np
import pandas as pd
import pytest
from arms import PUBLIC, PYBULLET, SCENARIOS, cell, installed, row

import controllers
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.mjcf import mjcf
from artde_gym.multibody.urdf import urdf
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reader import read_arm
from controllers.workspace_design import advice, workspace_design

pytestmark = pytest.mark.once

try:
    import pinocchio
except ImportError:
    pinocchio = None
pin: Any = pinocchio
mj: Any = mujoco
ID = "ArmTrack-Payload-v0"
TIGHT: Any = {"rtol": 0, "atol": 1e-9}


@pytest.fixture(params=PUBLIC)
def public_arm(request: pytest.FixtureRequest) -> tuple[Path, str | None]:
    """Return file and tip of an arm."""
    if request.param not in installed():
        pytest.skip("needs example-robot-data")
    return installed()[request.param]


@pytest.mark.bullet
def test_the_table_of_public_arms_has_those_of_pybullet() -> None:
    assert set(PYBULLET) <= set(installed())


def test_an_arm_that_cannot_be_simulated_has_its_error_for_a_row(tmp_path: Path) -> None:
    file = tmp_path / "empty.urdf"
    file.write_text("<robot name='empty'/>")
    cells = row({"robot": str(file), "engine": "mujoco"}, "tde", 1, 0)
    assert "empty.urdf" in cells
    assert cells.count("|") == len(SCENARIOS) - 1


def test_a_cell_has_the_mean_error_and_the_early_ends() -> None:
    rows = {"rmse_mm": [1.0, 3.0, 2.0], "fell": [False, True, True], "fall_reason": ["", "speed", "speed"]}
    assert cell(pd.DataFrame(rows)) == "2 (2 speed)"
    assert cell(pd.DataFrame(rows).iloc[:1]) == "1"


class Judge:
    """A robot file as Pinocchio reads it, with all joints but the given ones locked at zero or the closest limit."""

    def __init__(self, whole: Any, joints: tuple[str, ...]) -> None:
        others = [whole.getJointId(joint) for joint in whole.names[1:] if joint not in joints]
        rest = np.clip(pin.neutral(whole), whole.lowerPositionLimit, whole.upperPositionLimit)
        self.model = pin.buildReducedModel(whole, others, rest) if others else whole
        self.data = self.model.createData()
        self._order = [joints.index(name) for name in self.model.names[1:]]

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        upper = np.triu(pin.crba(self.model, self.data, self._place(q)))
        return self._back(upper + np.triu(upper, 1).T)

    def torques(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        order = self._order
        tau = pin.rnea(self.model, self.data, self._place(q), qd[order], qdd[order])
        return tau[np.argsort(order)]

    def _place(self, q: np.ndarray) -> np.ndarray:
        """Return Pinocchio's coordinates: of a joint without limits cosine and sine."""
        return pin.integrate(self.model, pin.neutral(self.model), q[self._order])

    def _back(self, matrix: np.ndarray) -> np.ndarray:
        back = np.argsort(self._order)
        return matrix[back][:, back]


def states(n: int) -> Iterator[np.ndarray]:
    """Yield random q, qd, qdd as rows (3, n)."""
    rng = np.random.default_rng(0)
    for _ in range(100):
        yield np.stack([rng.uniform(-2.0, 2.0, n), *rng.normal(size=(2, n))])


@pytest.mark.pinocchio
def test_dynamics_of_public_arms_agree_with_pinocchio(public_arm: tuple[Path, str | None]) -> None:
    spec = read_arm(public_arm[0], tip=public_arm[1])
    ours, judge = RigidBodyTree(spec), Judge(pin.buildModelFromUrdf(str(public_arm[0])), spec.actuated)
    model = mj.MjModel.from_xml_string(mjcf(spec))
    data, dense = mj.MjData(model), np.zeros((ours.n, ours.n))
    for q, qd, qdd in states(ours.n):
        inertia, torques = judge.mass_matrix(q), judge.torques(q, qd, qdd)
        np.testing.assert_allclose(ours.joint_mass_matrix(q), inertia, **TIGHT)
        np.testing.assert_allclose(ours.joint_torques(q, qd, qdd), torques, **TIGHT)
        data.qpos[:], data.qvel[:] = q, qd
        mj.mj_forward(model, data)
        mj.mj_fullM(model, data, dense)
        np.testing.assert_allclose(dense - np.diag(spec.armature), inertia, **TIGHT)
        np.testing.assert_allclose(dense @ qdd + data.qfrc_bias, torques + qdd * spec.armature, **TIGHT)


@pytest.mark.bullet
@pytest.mark.pinocchio
def test_public_arms_in_bullet_agree_with_pinocchio(public_arm: tuple[Path, str | None], tmp_path: Path) -> None:
    from artde_gym.sim.pybullet_module import bullet

    spec = read_arm(public_arm[0], tip=public_arm[1])
    judge = Judge(pin.buildModelFromUrdf(str(public_arm[0])), spec.actuated)
    (tmp_path / "arm.urdf").write_text(urdf(spec))
    client = bullet.connect(bullet.DIRECT)
    try:
        bullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        flags = bullet.URDF_USE_INERTIA_FROM_FILE
        body = bullet.loadURDF(str(tmp_path / "arm.urdf"), useFixedBase=True, flags=flags, physicsClientId=client)
        for state in states(len(spec.actuated)):
            q, qd, qdd = state.tolist()
            found = bullet.calculateInverseDynamics(body, q, qd, qdd, physicsClientId=client)
            np.testing.assert_allclose(found, judge.torques(*state), **TIGHT)
    finally:
        bullet.disconnect(client)


@pytest.mark.pinocchio
def test_the_written_mjcf_is_the_arm_in_pinocchios_parser(tmp_path: Path) -> None:
    """Its parser wants an inertia of each body, also of those that have none: the base and the place of a payload."""
    root = ET.fromstring(mjcf(panda()))
    for body in root.iter("body"):
        if body.find("inertial") is None:
            body.append(ET.Element("inertial", pos="0 0 0", mass="0", diaginertia="0 0 0"))
    (tmp_path / "arm.xml").write_text(ET.tostring(root, encoding="unicode"))
    ours, judge = RigidBodyTree(panda()), Judge(pin.buildModelFromMJCF(str(tmp_path / "arm.xml")), panda().actuated)
    for q, qd, qdd in states(ours.n):
        np.testing.assert_allclose(ours.joint_mass_matrix(q), judge.mass_matrix(q), **TIGHT)
        np.testing.assert_allclose(ours.joint_torques(q, qd, qdd), judge.torques(q, qd, qdd), **TIGHT)


def test_public_arms_follow_a_reference_at_designed_gains(public_arm: tuple[Path, str | None]) -> None:
    file, tip = public_arm
    design = workspace_design(read_arm(file, tip=tip, armature=0.1), 0.001, {})
    if (design.weight > 1).any():  # that of Talos cannot hold itself in all poses
        assert any("cannot hold the arm" in line for line in advice(design))
        return
    load = {"payload": {"mass": 0.5, "attach_time": 0.4}}
    env: Any = gym.make(ID, robot=file, tip=tip, armature=0.1, duration=0.8, disturbances=load, engine="mujoco")
    policy = controllers.make("tde", env)
    observation, _ = env.reset(seed=0)
    layout, state, over, worst = env.unwrapped.observation_layout, None, False, 0.0
    while not over:
        action, state = policy.predict(observation, state)
        observation, _, terminated, over, _ = env.step(action)
        assert not terminated
        fields = layout.split(observation)
        worst = max(worst, float(np.linalg.norm(fields["tool"] - fields["tool_ref"])))
    env.close()
    assert worst < 0.01
