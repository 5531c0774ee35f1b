"""Fixed bases in both engines: equations of motion, payloads on a link, copies, batches."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest

from artde_gym.multibody.dynamics import GRAVITY, RigidBodyTree
from artde_gym.multibody.manipulator import manipulator
from artde_gym.multibody.model_file import parsed
from artde_gym.multibody.spec import Link, RobotSpec
from artde_gym.multibody.urdf_reader import read_urdf
from artde_gym.sim.engine import PAYLOAD_RADIUS
from artde_gym.sim.factory import make_batch, make_engine

pytestmark = pytest.mark.once

INERTIA = '<inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.002" ixz="-0.001" iyz="0.003"/>'
LIMIT = '<limit lower="-2" upper="2" effort="50" velocity="3"/>'


def link(name: str) -> str:
    return f'<link name="{name}"><inertial><origin xyz="0.01 0.02 0.1"/><mass value="2"/>{INERTIA}</inertial></link>'


def joint(name: str, parent: str, child: str, axis: str, kind: str = "revolute") -> str:
    place = f'<origin xyz="0.05 0 0.3" rpy="0.3 -0.2 0.5"/><axis xyz="{axis}"/>'
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{place}{LIMIT}</joint>'


URDF = (
    "<robot>"
    + "".join(map(link, "abcde"))
    + joint("yaw", "a", "b", "0 0 1")
    + joint("lift", "b", "c", "0 1 1")
    + joint("reach", "c", "d", "1 0 0", "prismatic")
    + joint("turn", "d", "e", "1 0 0")
    + "</robot>"
)


def arm(armature: float = 0.0) -> RobotSpec:
    return manipulator(read_urdf(parsed(URDF, "arm.urdf"), "arm.urdf"), armature=armature)


def loaded(spec: RobotSpec, mass: float, place: tuple[float, float, float]) -> RobotSpec:
    """The arm with a ball as a part of its last link."""
    moment = 0.4 * mass * PAYLOAD_RADIUS**2
    ball = Link("ball", mass, (0.0, 0.0, 0.0), (moment, moment, moment), spec.payload_link, place)
    return dataclasses.replace(spec, links=(*spec.links, ball)).merged()


START = np.array([0.3, -0.5, 0.1, 0.8])
TORQUE = np.array([3.0, -20.0, 15.0, 2.0])


def acceleration(spec: RobotSpec, tau: np.ndarray) -> np.ndarray:
    tree, rest = RigidBodyTree(spec), np.zeros(4)
    return np.linalg.solve(tree.joint_mass_matrix(START), tau - tree.joint_torques(START, rest, rest))


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.1, -0.05, 0.2)])
def test_one_step_is_that_of_the_equations_of_motion(engine_name, place):
    spec = arm()
    engine = make_engine(engine_name, spec, 1e-5)
    for mass in (0.0, 1.7):
        engine.reset((0.0, 0.0, 0.0), START)
        if mass:
            engine.attach_payload(mass, place)
        engine.step(TORQUE)
        expected = acceleration(loaded(spec, mass, place) if mass else spec, TORQUE)
        np.testing.assert_allclose(engine.state().qd / 1e-5, expected, rtol=1e-5, atol=2e-4)
    engine.close()


def test_armature_acts_in_both_engines(engine_name):
    spec = arm(armature=0.5)
    engine = make_engine(engine_name, spec, 1e-4)
    engine.reset((0.0, 0.0, 0.0), START)
    engine.step(TORQUE)
    # in Bullet rotors are links, which the links that carry them spin too
    tolerance = 1e-6 if engine_name == "mujoco" else 0.03
    np.testing.assert_allclose(engine.state().qd / 1e-4, acceleration(spec, TORQUE), rtol=tolerance, atol=tolerance)
    engine.close()


def test_a_scaled_arm_with_a_payload(engine_name):
    spec = arm()
    engine = make_engine(engine_name, spec, 1e-5)
    engine.reset((0.0, 0.0, 0.0), START)
    engine.scale_masses(1.3)
    engine.attach_payload(1.0, (0.0, 0.1, 0.0))
    engine.step(TORQUE)
    links = (
        dataclasses.replace(
            link,
            mass=1.3 * link.mass,
            inertia=tuple(1.3 * moment for moment in link.inertia),
            products=tuple(1.3 * product for product in link.products),
        )
        for link in spec.links
    )
    heavy = loaded(dataclasses.replace(spec, links=tuple(links)), 1.0, (0.0, 0.1, 0.0))
    np.testing.assert_allclose(engine.state().qd / 1e-5, acceleration(heavy, TORQUE), rtol=1e-5, atol=2e-4)
    engine.close()


def test_a_push_at_a_site_is_its_jacobian(engine_name):
    spec, force = arm(), np.array([10.0, -5.0, 7.0])
    tree = RigidBodyTree(spec)
    engine = make_engine(engine_name, spec, 1e-5)
    engine.reset((0.0, 0.0, 0.0), START)
    np.testing.assert_allclose(engine.site("tool"), tree.position("turn", START), atol=1e-9)
    engine.apply_force("d", tuple(force.tolist()))
    engine.step(TORQUE)
    pushed = TORQUE + tree.jacobian("reach", START)[:3, 6:].T @ force
    np.testing.assert_allclose(engine.state().qd / 1e-5, acceleration(spec, pushed), rtol=1e-5, atol=2e-4)
    engine.close()


def test_a_released_payload_falls_with_the_velocity_of_its_link(engine_name):
    engine = make_engine(engine_name, arm(), 1e-3)
    engine.reset((0.0, 0.0, 0.0), START)
    assert engine.payload_position() is None
    engine.attach_payload(0.5, (0.0, 0.1, 0.05))
    places = []
    for _ in range(3):
        engine.step(5 * TORQUE)
        places.append(engine.payload_position())
    engine.release_payload()
    velocity = np.subtract(places[2], places[1]) / 1e-3
    for _ in range(100):
        engine.step(TORQUE)
    fallen = np.subtract(engine.payload_position() or (), places[2])
    np.testing.assert_allclose(fallen, velocity * 0.1 + (0.0, 0.0, -GRAVITY * 0.005), atol=2e-3)
    engine.reset((0.0, 0.0, 0.0), START)
    assert engine.payload_position() is None
    engine.close()


@pytest.mark.parametrize("armature", [0.0, 0.2])
def test_a_copy_steps_bitwise_like_the_original(engine_name, armature):
    engine = make_engine(engine_name, arm(armature), 1e-3)
    engine.reset((0.0, 0.0, 0.0), START)
    engine.scale_masses(1.1)
    engine.attach_payload(0.5, (0.0, 0.1, 0.05))
    for _ in range(5):
        engine.step(TORQUE)
    twins = [copy.deepcopy(engine), pickle.loads(pickle.dumps(engine))]
    for _ in range(20):
        engine.step(TORQUE)
        for twin in twins:
            twin.step(TORQUE)
    for twin in twins:
        np.testing.assert_array_equal(twin.state().q, engine.state().q)
        assert twin.payload_position() == engine.payload_position()
        twin.close()
    engine.close()


def test_an_engine_repeats_itself_after_a_reset(engine_name):
    engine = make_engine(engine_name, arm(0.2), 1e-3)
    found = []
    for _ in range(2):
        engine.reset((0.0, 0.0, 0.0), START)
        engine.attach_payload(0.5, (0.0, 0.1, 0.05))
        for _ in range(50):
            engine.step(TORQUE)
        found.append(engine.state().q)
    np.testing.assert_array_equal(*found)
    engine.close()


def test_a_batch_is_bitwise_many_engines():
    spec = arm(0.2)
    batch = make_batch("mujoco", spec, 3, 1e-3, 1)
    engines = [make_engine("mujoco", spec, 1e-3) for _ in range(3)]
    for i, engine in enumerate(engines):
        for world in (engine, batch.worlds[i]):
            world.set_gravity((0.0, 0.0, -9.81))
        engine.reset((0.0, 0.0, 0.0), START + 0.1 * i)
        batch.reset(i, (0.0, 0.0, 0.0), START + 0.1 * i)
        for world in (engine, batch.worlds[i]):
            world.attach_payload(0.5 + i, (0.0, 0.1, 0.05))
    for _ in range(30):
        for i, engine in enumerate(engines):
            engine.apply_force("tool", (3.0, 0.0, 1.0))
            batch.worlds[i].apply_force("tool", (3.0, 0.0, 1.0))
            engine.step(TORQUE)
        batch.step(np.tile(TORQUE, (3, 1)))
    state = batch.state()
    for i, engine in enumerate(engines):
        np.testing.assert_array_equal(state.q[i], engine.state().q)
        np.testing.assert_array_equal(state.qd[i], engine.state().qd)
        assert batch.worlds[i].site("tool") == engine.site("tool")
        engine.close()
