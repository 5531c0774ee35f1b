"""What MuJoCo makes of a `RobotSpec`: mass, inertia and bias against Pinocchio, free flight, the pair's friction."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artde_gym.multibody.dynamics import GRAVITY, RigidBodyTree
from artde_gym.multibody.mjcf import PAYLOAD, mjcf
from artde_gym.multibody.spec import RobotSpec, box_link
from artde_gym.robots.ojas.model import ojas
from artde_gym.sim.mujoco import MujocoEngine, mj

pytestmark = pytest.mark.once

SPECS = {
    f"{kind}-{arms}": ojas(kind, arms=arms) for kind in ("rotor", "lumped", "none") for arms in ("fixed", "revolute")
}
every_spec = pytest.mark.parametrize("name", SPECS)
DT = 0.001


class Coordinates:
    """Between MuJoCo's generalized velocities and ours: the base's spin in world axes, joints in the tree's order."""

    def __init__(self, engine: MujocoEngine) -> None:
        self.engine, self.model, self.data = engine, engine._model, engine._data
        joints = RigidBodyTree(engine.spec).joints
        self._dofs = [int(self.model.joint(name).dofadr[0]) for name in joints]
        self.n = len(joints)

    def map(self, rot: np.ndarray) -> np.ndarray:
        """Our velocities to MuJoCo's."""
        out = np.zeros((self.model.nv, 6 + self.n))
        out[:3, :3], out[3:6, 3:6] = np.eye(3), rot.T
        out[self._dofs, 6 + np.arange(self.n)] = 1.0
        return out

    def set(self, q: np.ndarray, v: np.ndarray, rot: np.ndarray) -> None:
        self.data.qpos[:7] = (0.0, 0.0, 5.0, *np.roll(Rotation.from_matrix(rot).as_quat(), 1))
        self.data.qpos[1 + np.array(self._dofs, dtype=int)] = q
        self.data.qvel[:] = self.map(rot) @ v
        mj.mj_forward(self.model, self.data)

    def mass_matrix(self, rot: np.ndarray) -> np.ndarray:
        full = np.zeros((self.model.nv, self.model.nv))
        columns = np.eye(self.model.nv)
        for column, unit in enumerate(columns):
            mj.mj_mulM(self.model, self.data, full[column], unit)
        return self.map(rot).T @ full @ self.map(rot)

    def bias(self, rot: np.ndarray) -> np.ndarray:
        return self.map(rot).T @ self.data.qfrc_bias


def states(n: int, seed: int = 20) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.5, 1.5, n), rng.normal(size=6 + n), Rotation.random(None, rng).as_matrix()


@every_spec
@pytest.mark.parametrize("seed", range(5))
def test_mass_matrix_and_bias_agree_with_pinocchio(name: str, seed: int, judge: Callable[[RobotSpec], Any]) -> None:
    engine, other = MujocoEngine(SPECS[name]), judge(SPECS[name])
    here = Coordinates(engine)
    q, v, rot = states(here.n, seed)
    here.set(q, v, rot)
    np.testing.assert_allclose(here.mass_matrix(rot), other.mass_matrix(q, rot), rtol=0, atol=1e-10)
    expected = other.inverse_dynamics(q, v[6:], np.zeros(here.n), v[:6], np.zeros(6), rot)
    np.testing.assert_allclose(here.bias(rot), expected, rtol=0, atol=1e-10)


@every_spec
def test_mass_and_height(name: str) -> None:
    assert abs(MujocoEngine(SPECS[name])._model.body_mass.sum() - 8.986) < 1e-12
    model = mj.MjModel.from_xml_string(mjcf(SPECS[name]))
    data = mj.MjData(model)
    mj.mj_kinematics(model, data)
    seen = [i for i in range(model.ngeom) if model.geom_bodyid[i] > 0 and model.geom_group[i] == 0]
    tops = [data.geom_xpos[i, 2] + model.geom_size[i, 2] for i in seen]
    bottoms = [data.geom_xpos[i, 2] - model.geom_size[i, 2] for i in seen]
    assert abs(max(tops) - min(bottoms) - 0.94) < 1e-12


@every_spec
def test_shapes_that_touch_nothing_change_no_bit_of_a_step(name: str) -> None:
    engine = MujocoEngine(SPECS[name], DT)
    engine.reset((0.0, 0.0, 0.5), np.linspace(-0.1, 0.1, 12))
    model = mj.MjModel.from_xml_string(mjcf(SPECS[name]))
    model.opt.timestep, data = DT, mj.MjData(model)
    data.qpos[:] = engine._data.qpos
    assert model.ngeom > engine._model.ngeom
    landed = False
    for _ in range(200):
        mj.mj_step(model, data)
        engine.step(np.zeros(12))
        landed |= any(engine.foot_loads())
    assert landed
    assert np.array_equal(data.qpos, engine._data.qpos)


def test_free_fall_is_exact() -> None:
    """A semi-implicit step at a constant acceleration: v_n = -g n dt, z_n = z_0 - g dt^2 n (n + 1) / 2."""
    engine, n = MujocoEngine(SPECS["rotor-fixed"], DT), 400
    engine.reset((0.0, 0.0, 5.0), np.linspace(-0.3, 0.4, 12))
    for _ in range(n):
        engine.step(np.zeros(12))
    state = engine.state()
    np.testing.assert_allclose(state.velocity, (0.0, 0.0, -GRAVITY * n * DT), atol=1e-10)
    np.testing.assert_allclose(state.position, (0.0, 0.0, 5.0 - GRAVITY * DT**2 * n * (n + 1) / 2), atol=1e-10)
    np.testing.assert_allclose(state.angular_velocity, 0.0, atol=1e-10)
    np.testing.assert_allclose(state.qd, 0.0, atol=1e-10)


def drift(dt: float) -> tuple[float, float, float]:
    """Relative change of linear and angular momentum and of energy in 0.2 s of tumbling flight, joints swinging."""
    spec = SPECS["none-fixed"]
    engine, tree = MujocoEngine(spec, dt), RigidBodyTree(spec)
    engine.set_gravity((0.0, 0.0, 0.0))
    q, v, rot = states(12, 3)
    Coordinates(engine).set(0.3 * q, v, rot)

    def conserved() -> tuple[np.ndarray, np.ndarray, float]:
        state = engine.state()
        velocity = np.concatenate([state.velocity, state.angular_velocity, state.qd])
        matrix = tree.mass_matrix(state.q, Rotation.from_quat(state.quat_xyzw).as_matrix())
        linear, angular = (matrix[:6] @ velocity).reshape(2, 3)
        return linear, angular + np.cross(state.position, linear), float(velocity @ matrix @ velocity / 2)

    before = conserved()
    for _ in range(round(0.2 / dt)):
        engine.step(np.zeros(12))
    changes = [np.linalg.norm(np.subtract(b, a)) / np.linalg.norm(a) for a, b in zip(before, conserved(), strict=True)]
    return float(changes[0]), float(changes[1]), float(changes[2])


def test_flight_conserves_momentum_and_energy_to_the_order_of_the_integrator() -> None:
    coarse, fine = drift(2e-4), drift(1e-4)
    for one, other in zip(coarse, fine, strict=True):
        assert one < 5e-5
        assert one / other == pytest.approx(2.0, rel=0.15)


def test_a_payload_is_part_of_the_base_until_it_goes(judge: Callable[[RobotSpec], Any]) -> None:
    """The mass matrix is that of a robot with one more link, and afterwards bit for bit the former one."""
    spec, (mass, place) = SPECS["rotor-fixed"], (1.3, (0.01, -0.02, 0.17))
    moment = 0.4 * mass * 0.08**2
    ball = dataclasses.replace(
        box_link("ball", mass, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0), "torso", place), inertia=(moment,) * 3
    )
    heavier = judge(dataclasses.replace(spec, links=(*spec.links, ball)))
    engine = MujocoEngine(spec)
    here, (q, v, rot) = Coordinates(engine), states(12)
    here.set(q, v, rot)
    bare, constants = here.mass_matrix(rot), engine._model.dof_invweight0.copy()
    engine.attach_payload(mass, place)
    here.set(q, v, rot)
    np.testing.assert_allclose(here.mass_matrix(rot), heavier.mass_matrix(q, rot), atol=1e-12)
    assert (engine._model.dof_invweight0 != constants).any()
    engine.release_payload()
    here.set(q, v, rot)
    np.testing.assert_array_equal(here.mass_matrix(rot), bare)
    np.testing.assert_array_equal(engine._model.dof_invweight0, constants)


def test_friction_is_that_of_the_pair_alone() -> None:
    """No shape has a friction of its own that the solver could combine with another's: contacts are pairs only."""
    engine = MujocoEngine(SPECS["rotor-fixed"])
    engine.set_friction(0.37)
    engine.reset((0.0, 0.0, 0.449), np.zeros(12))
    engine.step(np.zeros(12))
    model, data = engine._model, engine._data
    assert not model.geom_contype.any()
    assert data.ncon == 8
    np.testing.assert_array_equal(data.contact.friction[:, :2], 0.37)
    np.testing.assert_array_equal(data.contact.dim, 3)


def test_a_robot_that_diverges_does_not_jump_to_its_start(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)  # for MuJoCo's own log of it
    engine = MujocoEngine(SPECS["none-fixed"])
    engine.reset((0.0, 0.0, 0.45), np.zeros(12))
    engine._data.qvel[2] = -np.inf
    engine.step(np.zeros(12))
    assert not np.isfinite(engine.state().position).all()


@every_spec
def test_mjcf_is_the_spec(name: str) -> None:
    """Every number arrives with all its digits, and nothing is added but the payload without mass."""
    spec = SPECS[name]
    root = ET.fromstring(mjcf(spec))
    bodies = {body.get("name"): body for body in root.iter("body")}
    assert bodies.keys() == {*spec.by_name, PAYLOAD}
    assert len(bodies[PAYLOAD]) == 0
    armature = dict(zip(spec.actuated, spec.armature, strict=True))
    for link in spec.links:
        body = bodies[link.name]
        inertial, joint = body.find("inertial"), body.find("joint")
        assert inertial is not None
        assert (float(str(inertial.get("mass"))), numbers(inertial, "pos")) == (link.mass, link.com)
        assert numbers(inertial, "diaginertia") == link.inertia
        assert numbers(body, "pos") == link.origin
        assert (joint is None) == (link.axis is None)
        if joint is not None:
            assert numbers(joint, "axis") == link.axis
            assert float(str(joint.get("armature"))) == armature.get(link.name, 0.0)
    held = {str(joint.get("joint1")) for joint in root.iterfind("equality/joint")}
    assert held == {link.name for link in spec.joints} - set(spec.actuated)


def numbers(element: ET.Element, attribute: str) -> tuple[float, ...]:
    return tuple(float(word) for word in str(element.get(attribute)).split())


def test_held_arms_stay_at_zero() -> None:
    engine = MujocoEngine(SPECS["rotor-revolute"])
    engine.reset((0.0, 0.0, 3.0), np.zeros(12))
    for _ in range(300):
        engine.apply_force("torso", (0.0, 0.0, 8.986 * GRAVITY))  # in a hover, so that gravity pulls at the arms
        engine.step(np.zeros(12))
    arms = [
        engine._data.joint(link.name).qpos[0] for link in engine.spec.joints if link.name not in engine.spec.actuated
    ]
    assert len(arms) == 8
    np.testing.assert_allclose(arms, 0.0, atol=2e-3)
