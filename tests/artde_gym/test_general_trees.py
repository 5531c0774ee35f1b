"""Trees of any shape against Pinocchio, MuJoCo and Bullet: rotated frames, products of inertia, prismatic joints."""

import dataclasses
import math
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artde_gym.errors import RobotError
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.mjcf import mjcf
from artde_gym.multibody.spec import Link, RobotSpec
from artde_gym.multibody.urdf import urdf

pytestmark = pytest.mark.once

mj: Any = mujoco
SEEDS = range(6)
TIGHT: Any = {"rtol": 0, "atol": 1e-9}


def rotation(rng: np.random.Generator) -> Any:
    return tuple(map(tuple, Rotation.random(rng=rng).as_matrix().tolist()))


def link(rng: np.random.Generator, name: str, parent: str | None, **more: Any) -> Link:
    """A random body: its inertia is that of three point masses and a ball, so that it is possible."""
    mass, points = rng.uniform(0.3, 2.0), rng.normal(scale=0.1, size=(3, 3))
    points -= points.mean(axis=0)
    tensor = 1e-3 * np.eye(3) + sum(mass / 3 * (p @ p * np.eye(3) - np.outer(p, p)) for p in points)
    return Link(
        name,
        mass,
        tuple(rng.normal(scale=0.1, size=3).tolist()),
        tuple(np.diag(tensor).tolist()),
        parent,
        (0.0, 0.0, 0.0) if parent is None else tuple(rng.normal(scale=0.3, size=3).tolist()),
        products=tuple(tensor[[0, 0, 1], [1, 2, 2]].tolist()),
        rotation=None if parent is None else rotation(rng),
        **more,
    )


def tree(seed: int, *, fixed: bool) -> RobotSpec:
    """A base, four joints of which two slide, a branch, and two links on fixed joints."""
    rng = np.random.default_rng(seed)

    def axis() -> Any:
        direction = rng.normal(size=3)
        return tuple((direction / np.linalg.norm(direction)).tolist())

    links = (
        link(rng, "base", None),
        link(rng, "shoulder", "base", axis=axis()),
        link(rng, "plate", "shoulder"),
        link(rng, "slider", "plate", axis=axis(), prismatic=True),
        link(rng, "elbow", "slider", axis=axis()),
        link(rng, "branch", "plate", axis=axis(), prismatic=True),
        link(rng, "tool", "elbow"),
    )
    joints = ("shoulder", "slider", "elbow", "branch")
    armature = tuple(rng.uniform(0.01, 0.2, 4).tolist())
    sites = (("tip", "tool", (0.1, -0.2, 0.3)),)
    return RobotSpec("tree", links, joints, 100.0, armature=armature, sites=sites, fixed=fixed, carrier="tool")


def states(spec: RobotSpec, n: int = 5) -> Any:
    rng = np.random.default_rng(1)
    return rng.uniform(-2.0, 2.0, (n, 4)), *rng.normal(size=(2, n, 4))


@pytest.mark.parametrize("seed", SEEDS)
def test_floating_tree_agrees_with_pinocchio(seed, judge):
    spec = tree(seed, fixed=False)
    rng = np.random.default_rng(seed)
    ours, whole, other = RigidBodyTree(spec), RigidBodyTree(spec.merged()), judge(spec)
    for q, qd, qdd in zip(*states(spec), strict=True):
        rot, (velocity, acceleration) = Rotation.random(rng=rng).as_matrix(), rng.normal(size=(2, 6))
        for model in (ours, whole):
            np.testing.assert_allclose(model.mass_matrix(q, rot), other.mass_matrix(q, rot), **TIGHT)
            arguments = (q, qd, qdd, velocity, acceleration, rot)
            np.testing.assert_allclose(model.inverse_dynamics(*arguments), other.inverse_dynamics(*arguments), **TIGHT)


@pytest.mark.parametrize("seed", SEEDS)
def test_jacobian_and_its_rate_are_derivatives(seed):
    model = RigidBodyTree(tree(seed, fixed=True))
    q, qd, _ = (values[0] for values in states(tree(seed, fixed=True)))
    step = 1e-6

    def place(time: float) -> np.ndarray:
        return model.position("elbow", q + time * qd)

    velocity = (place(step) - place(-step)) / (2 * step)
    np.testing.assert_allclose(model.jacobian("elbow", q)[:3, 6:] @ qd, velocity, atol=1e-7)

    def speed(time: float) -> np.ndarray:
        return model.jacobian("elbow", q + time * qd)[:, 6:] @ qd

    rate = (speed(step) - speed(-step)) / (2 * step)
    np.testing.assert_allclose(model.bias_acceleration("elbow", q, qd, np.zeros(6)), rate, atol=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_fixed_tree_agrees_with_mujoco(seed):
    spec = tree(seed, fixed=True).merged()
    ours = RigidBodyTree(spec)
    model = mj.MjModel.from_xml_string(mjcf(spec))
    data, dense = mj.MjData(model), np.zeros((4, 4))
    assert [model.joint(i).name for i in range(4)] == list(ours.joints)
    for q, qd, _ in zip(*states(spec), strict=True):
        data.qpos[:], data.qvel[:] = q, qd
        mj.mj_forward(model, data)
        mj.mj_fullM(model, data, dense)
        np.testing.assert_allclose(ours.joint_mass_matrix(q), dense, **TIGHT)
        np.testing.assert_allclose(ours.joint_torques(q, qd, 0 * qd), data.qfrc_bias, **TIGHT)
        name, place, offset = next((link, site, point) for site, link, point in spec.sites)
        found = ours.position(name, q) + ours.rotation(name, q) @ np.asarray(offset)
        np.testing.assert_allclose(data.site(place).xpos, found, atol=1e-12)


@pytest.mark.bullet
@pytest.mark.parametrize("seed", SEEDS)
def test_fixed_tree_agrees_with_bullet(seed, tmp_path):
    from artde_gym.sim.pybullet_module import bullet

    spec = dataclasses.replace(tree(seed, fixed=True).merged(), armature=(0.0,) * 4)
    ours = RigidBodyTree(spec)
    (tmp_path / "tree.urdf").write_text(urdf(spec))
    client = bullet.connect(bullet.DIRECT)
    try:
        bullet.setGravity(0.0, 0.0, -9.81, physicsClientId=client)
        body = bullet.loadURDF(
            str(tmp_path / "tree.urdf"),
            useFixedBase=True,
            flags=bullet.URDF_USE_INERTIA_FROM_FILE,
            physicsClientId=client,
        )
        for q, qd, qdd in zip(*states(spec), strict=True):
            mass = bullet.calculateMassMatrix(body, q.tolist(), physicsClientId=client)
            np.testing.assert_allclose(ours.joint_mass_matrix(q), mass, **TIGHT)
            lists = (q.tolist(), qd.tolist(), qdd.tolist())
            torque = bullet.calculateInverseDynamics(body, *lists, physicsClientId=client)
            np.testing.assert_allclose(ours.joint_torques(q, qd, qdd), torque, **TIGHT)
    finally:
        bullet.disconnect(physicsClientId=client)


def test_rotor_links_reflect_the_armature_about_any_axis():
    spec = dataclasses.replace(tree(0, fixed=True), gear_ratio=1000.0)
    armature, links = RigidBodyTree(spec), RigidBodyTree(spec.with_rotor_links())
    for q in states(spec)[0]:
        assert armature.joints == links.joints
        np.testing.assert_allclose(links.joint_mass_matrix(q), armature.joint_mass_matrix(q), atol=1e-3)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"mass": 0.0}, "mass of link 'shoulder'"),
        ({"mass": math.nan}, "mass of link 'shoulder'"),
        ({"inertia": (0.1, 0.1, 0.3)}, "inertia of link 'shoulder'"),
        ({"products": (0.0, 0.0, 1.0)}, "inertia of link 'shoulder'"),
        ({"products": (0.0, math.inf, 0.0)}, "inertia of link 'shoulder'"),
    ],
)
def test_impossible_bodies_are_refused(change, field):
    body = tree(0, fixed=True).by_name["shoulder"]
    with pytest.raises(RobotError, match=field):
        dataclasses.replace(body, **change)


def test_only_a_fixed_base_may_be_massless():
    spec = tree(0, fixed=True)
    base = Link("base", 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    links = (base, *spec.links[1:])
    assert dataclasses.replace(spec, links=links).mass == pytest.approx(spec.mass - spec.base.mass)
    with pytest.raises(RobotError, match="it floats"):
        dataclasses.replace(spec, links=links, fixed=False)
