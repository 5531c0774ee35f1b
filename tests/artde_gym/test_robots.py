"""Ojas against Pinocchio and the engines, and against itself: symmetry, statics, finite differences."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from artde_gym.errors import OptionError, RobotError
from artde_gym.multibody.dynamics import GRAVITY, RigidBodyTree, joint_space_inertia
from artde_gym.multibody.spec import RobotSpec, box_link
from artde_gym.multibody.support import Supported
from artde_gym.robots.ojas import model as constants
from artde_gym.robots.ojas.leg_ik import leg_angles
from artde_gym.robots.ojas.model import ojas
from artde_gym.robots.ojas.walking import walking_pattern
from artde_gym.sim.factory import make_engine
from controllers.laws.stability import tde_eigenvalues, tde_is_valid

pytestmark = pytest.mark.once

SPECS = {
    f"{kind}-{arms}": ojas(kind, arms=arms) for kind in ("rotor", "lumped", "none") for arms in ("fixed", "revolute")
}
SPECS |= {f"{name}-links": SPECS[name].with_rotor_links() for name in ("rotor-fixed", "rotor-revolute")}
every_spec = pytest.mark.parametrize("name", SPECS)
M_BAR = 0.042
LEG = dict(zip(constants.LEG_JOINTS, range(6), strict=True))


def states(n: int, *shape: int, seed: int = 10) -> tuple[np.ndarray, ...]:
    """q, qd, qdd, base velocity, base acceleration, base rotation; far from any symmetry."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.5, 1.5, (*shape, n))
    qd, qdd = rng.normal(size=(2, *shape, n))
    velocity, acceleration = rng.normal(size=(2, *shape, 6))
    rot = Rotation.random(math.prod(shape), rng).as_matrix().reshape(*shape, 3, 3)
    return q, qd, qdd, velocity, acceleration, rot


# ---------------------------------------------------------------------------------------------- mass, inertia, dynamics


@every_spec
def test_mass_and_height(name):
    spec = SPECS[name]
    assert abs(spec.mass - 8.986) < 1e-9
    assert abs(spec.height - 0.94) < 1e-9
    assert abs(RigidBodyTree(spec).mass - 8.986) < 1e-9
    assert len(spec.actuated) == 12
    assert RigidBodyTree(spec).n == (12 if "fixed" in name else 20)


@every_spec
def test_mass_matrix_and_inverse_dynamics_agree_with_pinocchio(name, judge):
    tree, other = RigidBodyTree(SPECS[name]), judge(SPECS[name])
    assert tree.joints == other.joints
    for q, qd, qdd, velocity, acceleration, rot in zip(*states(tree.n, 5), strict=True):
        np.testing.assert_allclose(tree.mass_matrix(q, rot), other.mass_matrix(q, rot), rtol=0, atol=1e-9)
        np.testing.assert_allclose(
            tree.inverse_dynamics(q, qd, qdd, velocity, acceleration, rot),
            other.inverse_dynamics(q, qd, qdd, velocity, acceleration, rot),
            rtol=0,
            atol=1e-9,
        )
        np.testing.assert_allclose(
            tree.inverse_dynamics(q, qd, qdd), other.inverse_dynamics(q, qd, qdd), rtol=0, atol=1e-9
        )


@every_spec
def test_kinetic_energy_is_the_sum_over_the_bodies(name, judge):
    spec = SPECS[name]
    tree, other = RigidBodyTree(spec), judge(spec)
    armature = np.zeros(tree.n)
    armature[[tree.joints.index(joint) for joint in spec.actuated]] = spec.armature
    for q, qd, _, velocity, _, rot in zip(*states(tree.n, 3), strict=True):
        v = np.concatenate([velocity, qd])
        bodies = other.kinetic_energy(q, v, rot)
        np.testing.assert_allclose(0.5 * v @ tree.mass_matrix(q, rot) @ v, bodies + 0.5 * armature @ qd**2, rtol=1e-10)


@every_spec
def test_equations_of_motion_are_consistent(name):
    tree = RigidBodyTree(SPECS[name])
    q, qd, qdd, velocity, acceleration, rot = states(tree.n)
    mass_matrix = tree.mass_matrix(q, rot)
    np.testing.assert_array_equal(np.linalg.eigvalsh(mass_matrix) > 0, True)
    np.testing.assert_allclose(mass_matrix, mass_matrix.T, atol=1e-12)
    forces = tree.inverse_dynamics(q, qd, qdd, velocity, acceleration, rot)
    bias = tree.inverse_dynamics(q, qd, 0 * qdd, velocity, None, rot)
    np.testing.assert_allclose(forces - bias, mass_matrix @ np.concatenate([acceleration, qdd]), atol=1e-10)
    # at rest the base carries the weight
    np.testing.assert_allclose(
        tree.inverse_dynamics(q, 0 * qd, 0 * qdd, None, None, rot)[2], 8.986 * GRAVITY, rtol=1e-12
    )


@every_spec
def test_batch_equals_loop(name):
    tree = RigidBodyTree(SPECS[name])
    q, qd, qdd, velocity, acceleration, rot = states(tree.n, 2, 3)
    foot = "right_ankle_roll"
    functions: list[tuple[Any, tuple[np.ndarray, ...]]] = [
        (tree.mass_matrix, (q, rot)),
        (tree.center_of_mass, (q, rot)),
        (tree.inverse_dynamics, (q, qd, qdd, velocity, acceleration, rot)),
        (lambda *arguments: tree.jacobian(foot, *arguments), (q, rot)),
        (lambda *arguments: tree.bias_acceleration(foot, *arguments), (q, qd, velocity, rot)),
        (lambda *arguments: tree.position(foot, *arguments), (q, rot)),
        (lambda *arguments: tree.rotation(foot, *arguments), (q,)),
        (lambda *arguments: joint_space_inertia(tree.mass_matrix(*arguments)), (q, rot)),
    ]
    for function, arguments in functions:
        together = function(*arguments)
        for index in np.ndindex(2, 3):
            alone = function(*(argument[index] for argument in arguments))
            np.testing.assert_allclose(together[index], alone, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", ["rotor", "lumped", "none"])
def test_fixed_arms_are_revolute_arms_at_zero(kind):
    fixed, revolute = (RigidBodyTree(ojas(kind, arms=arms)) for arms in ("fixed", "revolute"))
    legs = [revolute.joints.index(joint) for joint in fixed.joints]
    q, qd, qdd, velocity, acceleration, rot = states(12)

    def spread(values: np.ndarray) -> np.ndarray:
        out = np.zeros(20)
        out[legs] = values
        return out

    kept = [*range(6), *(6 + leg for leg in legs)]
    whole = revolute.mass_matrix(spread(q), rot)
    np.testing.assert_allclose(fixed.mass_matrix(q, rot), whole[np.ix_(kept, kept)], atol=1e-12)
    forces = revolute.inverse_dynamics(spread(q), spread(qd), spread(qdd), velocity, acceleration, rot)
    np.testing.assert_allclose(
        fixed.inverse_dynamics(q, qd, qdd, velocity, acceleration, rot), forces[kept], atol=1e-10
    )


def test_armature_and_rotor_links_are_one_robot_but_for_small_couplings():
    armature, links = (RigidBodyTree(SPECS[name]) for name in ("rotor-fixed", "rotor-fixed-links"))
    none = RigidBodyTree(SPECS["none-fixed"])
    q = states(12)[0]
    reflected = armature.mass_matrix(q) - none.mass_matrix(q)
    np.testing.assert_allclose(reflected, np.diag([0.0] * 6 + [0.045] * 12), atol=1e-12)
    # rotors are spun by the link that carries them too: r a / r^2, a tenth of the armature, off the diagonal
    difference = links.mass_matrix(q) - armature.mass_matrix(q)
    assert np.abs(difference).max() < 0.2 * 0.045
    assert np.abs(np.diag(difference)[6:]).max() < 0.05 * 0.045


def test_joint_space_inertia_is_the_inverse_of_the_joint_block_of_the_inverse():
    tree = RigidBodyTree(SPECS["rotor-fixed"])
    mass_matrix = tree.mass_matrix(states(12, 4)[0])
    expected = np.linalg.inv(np.linalg.inv(mass_matrix)[..., 6:, 6:])
    np.testing.assert_allclose(joint_space_inertia(mass_matrix), expected, rtol=1e-9, atol=1e-12)


# ----------------------------------------------------------------------------------------------------------- kinematics


@pytest.mark.parametrize("name", ["rotor-fixed", "rotor-revolute", "rotor-fixed-links"])
@pytest.mark.parametrize("link", ["left_ankle_roll", "right_knee", "left_elbow"])
def test_jacobian_and_its_drift_against_finite_differences(name, link, judge):
    tree = RigidBodyTree(SPECS[name])
    if "fixed" in name and link == "left_elbow":
        with pytest.raises(RobotError, match="left_elbow"):
            tree.jacobian(link, np.zeros(12))
        return
    other, step = judge(SPECS[name]), 1e-5
    q, qd, _, velocity, _, rot = states(tree.n, seed=11)
    v = np.concatenate([velocity, qd])

    def after(time: float) -> tuple[np.ndarray, np.ndarray]:
        """Angles and base rotation after moving with constant joint and base velocities."""
        return q + time * qd, Rotation.from_rotvec(time * velocity[3:]).as_matrix() @ rot

    def placement(time: float) -> tuple[np.ndarray, np.ndarray]:
        position, rotation = other.placement(link, *after(time))
        return position + time * velocity[:3], rotation

    (ahead, rot_ahead), (behind, rot_behind) = placement(step), placement(-step)
    linear = (ahead - behind) / (2 * step)
    angular = Rotation.from_matrix(rot_ahead @ rot_behind.T).as_rotvec() / (2 * step)
    np.testing.assert_allclose(tree.jacobian(link, q, rot) @ v, np.concatenate([linear, angular]), atol=1e-7)

    drift = (tree.jacobian(link, *after(step)) - tree.jacobian(link, *after(-step))) @ v / (2 * step)
    np.testing.assert_allclose(tree.bias_acceleration(link, q, qd, velocity, rot), drift, atol=1e-6)

    position, rotation = other.placement(link, q, rot)
    np.testing.assert_allclose(tree.position(link, q, rot), position, atol=1e-12)
    np.testing.assert_allclose(rot @ tree.rotation(link, q), rotation, atol=1e-12)


def test_center_of_mass_against_gravity():
    tree = RigidBodyTree(SPECS["rotor-revolute"])
    q, *_, rot = states(20)
    x, y, _ = tree.center_of_mass(q, rot)
    wrench = tree.inverse_dynamics(q, 0 * q, 0 * q, None, None, rot)[:6]
    np.testing.assert_allclose(wrench[3:], 8.986 * GRAVITY * np.array([y, -x, 0.0]), atol=1e-10)


angle = st.floats(-0.6, 0.6)


@given(
    x=st.floats(-0.12, 0.12), y=st.floats(-0.08, 0.08), z=st.floats(-0.36, -0.28), roll=angle, pitch=angle, yaw=angle
)
@pytest.mark.parametrize("side", [0, 1])
def test_leg_angles_put_the_foot_where_it_was_asked_for(side, x, y, z, roll, pitch, yaw):
    rot = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    target = np.array([x, y, z])
    q = np.zeros(12)
    q[6 * side : 6 * side + 6] = leg_angles(target, constants.THIGH, constants.SHANK, rot)
    tree, foot = RigidBodyTree(SPECS["none-fixed"]), ("left_ankle_roll", "right_ankle_roll")[side]
    hip = np.array([0.0, (1 - 2 * side) * constants.HIP_OFFSET, 0.0])
    np.testing.assert_allclose(tree.position(foot, q) - hip, target, atol=1e-9)
    np.testing.assert_allclose(tree.rotation(foot, q), rot, atol=1e-9)
    assert q[6 * side + LEG["knee"]] > 0


def test_leg_angles_batch_equals_loop():
    rng = np.random.default_rng(12)
    targets = np.array([0.0, 0.0, -0.32]) + rng.uniform(-0.05, 0.05, (2, 5, 3))
    rots = Rotation.from_rotvec(rng.normal(scale=0.3, size=(10, 3))).as_matrix().reshape(2, 5, 3, 3)
    together = leg_angles(targets, 0.2, 0.2, rots)
    for index in np.ndindex(2, 5):
        np.testing.assert_allclose(together[index], leg_angles(targets[index], 0.2, 0.2, rots[index]), atol=1e-13)


@pytest.mark.parametrize(
    ("ankle", "thigh", "shank"),
    [((0.0, 0.0, -0.4001), 0.2, 0.2), ((0.0, 0.0, -0.04), 0.25, 0.2), ((math.nan,) * 3, 0.2, 0.2)],
)
def test_feet_out_of_reach_are_refused(ankle, thigh, shank):
    reachable = (0.0, 0.0, -0.3)
    with pytest.raises(RobotError, match="hip and ankle"):
        leg_angles(np.array([reachable, ankle]), thigh, shank)


# --------------------------------------------------------------------------------------------------------- in an engine


@pytest.mark.bullet
@pytest.mark.parametrize("name", ["rotor-fixed-links", "rotor-revolute-links", "lumped-fixed", "none-revolute"])
def test_bullet_has_exactly_the_inertias_of_the_spec(name):
    from artde_gym.sim.pybullet_module import bullet

    spec = SPECS[name]
    engine: Any = make_engine("bullet", spec, 0.001)
    robot, client = engine._robot, engine._client
    links = {bullet.getJointInfo(robot, i, physicsClientId=client)[12].decode(): i for i in range(len(spec.links) - 1)}
    links[spec.base.name] = -1
    assert links.keys() == spec.by_name.keys()
    for link in spec.links:
        mass, _, inertia, center, frame, *_ = bullet.getDynamicsInfo(robot, links[link.name], physicsClientId=client)
        assert mass == link.mass
        np.testing.assert_allclose(inertia, link.inertia, rtol=1e-14)
        np.testing.assert_array_equal(frame, (0.0, 0.0, 0.0, 1.0))
        if link is not spec.base:
            np.testing.assert_allclose(center, link.com, atol=1e-15)
    engine.close()


@pytest.mark.parametrize("name", ["rotor-fixed", "lumped-fixed", "none-fixed"])
def test_momentum_of_a_fall(engine_name, name):
    """Nothing but the weight acts on the robot as a whole, whatever its joints do: no damping."""
    engine, tau = make_engine(engine_name, SPECS[name], 1e-3), np.zeros(12)
    tree = RigidBodyTree(engine.spec)
    tau[[0, 9]] = 0.5, -0.5
    engine.reset((0.0, 0.0, 3.0), standing())
    for _ in range(100):
        engine.step(tau)
    state = engine.state()
    engine.close()
    rot = Rotation.from_quat(state.quat_xyzw).as_matrix()
    velocity = np.concatenate([state.velocity, state.angular_velocity, state.qd])
    momentum = tree.mass_matrix(state.q, rot)[:3] @ velocity
    np.testing.assert_allclose(momentum, [0.0, 0.0, -8.986 * GRAVITY * 0.1], atol=2e-3 * 8.8)


@pytest.mark.parametrize("name", ["rotor-fixed", "lumped-fixed", "none-fixed"])
def test_first_step_of_a_fall(engine_name, name):
    spec = SPECS[name]
    q = walking_pattern(0.1, 1.0, 4.5, 0.001).q[0]
    tau = np.random.default_rng(13).normal(size=12)
    engine = make_engine(engine_name, spec, 1e-3)
    engine.reset((0.0, 0.0, 3.0), q)
    engine.step(tau)
    measured = engine.state()
    engine.close()

    def predicted(tree: RigidBodyTree) -> np.ndarray:
        force = np.concatenate([np.zeros(6), tau]) - tree.inverse_dynamics(q, 0 * q, 0 * q)
        return np.linalg.solve(tree.mass_matrix(q), force)

    expected = predicted(RigidBodyTree(engine.spec))
    np.testing.assert_allclose(measured.qd / 1e-3, expected[6:], rtol=1e-3, atol=1e-3 * np.abs(expected[6:]).max())
    base = np.concatenate([measured.velocity, measured.angular_velocity]) / 1e-3
    np.testing.assert_allclose(base, expected[:6], rtol=1e-3, atol=1e-3 * np.abs(expected[:6]).max())
    nominal = predicted(RigidBodyTree(spec))[6:]  # with the armature on the diagonal alone
    assert np.linalg.norm(measured.qd / 1e-3 - nominal) < 0.1 * np.linalg.norm(nominal)


# ---------------------------------------------------------------------------------------------------------- on its feet

MIRROR = np.array([-1, -1, 1, 1, 1, -1])  # of q1..q6: yaw and roll change their sign


def standing() -> np.ndarray:
    """A symmetric pose with bent knees and the center of mass over the middle of the feet."""
    return walking_pattern(0.1, 1.0, 4.5, 0.001).q[0]


def contact_wrenches(tree: RigidBodyTree, q: np.ndarray, forces: np.ndarray, rot: np.ndarray) -> np.ndarray:
    """Force and moment at each ankle that explain `forces` of inverse dynamics less joint torques, (2, 6)."""
    jacobian = np.concatenate([tree.jacobian(foot, q, rot) for foot in ("left_ankle_roll", "right_ankle_roll")])
    wrenches, *_ = np.linalg.lstsq(jacobian.T, forces, rcond=None)
    np.testing.assert_allclose(jacobian.T @ wrenches, forces, atol=1e-9)
    return wrenches.reshape(2, 6)


@pytest.mark.parametrize("load_left", [0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("kind", ["rotor", "lumped"])
def test_statics_on_two_feet(kind, load_left):
    spec, q = ojas(kind), standing()
    tree, zero = RigidBodyTree(spec), np.zeros(12)
    tau = Supported(spec).torque(load_left, q, zero, zero)
    needed = tree.inverse_dynamics(q, zero, zero) - np.concatenate([np.zeros(6), tau])
    wrenches = contact_wrenches(tree, q, needed, np.eye(3))
    weight = 8.986 * GRAVITY
    np.testing.assert_allclose(wrenches[:, 2], [load_left * weight, (1 - load_left) * weight], atol=1e-9)
    np.testing.assert_allclose(wrenches[:, :2], 0.0, atol=1e-9)  # the feet do not pull at each other
    if load_left == 0.5:
        np.testing.assert_allclose(tau[:6], MIRROR * tau[6:], atol=1e-9)
        # in balance over the soles' middles, no moment is left about them
        arm = np.array(spec.sole("left_ankle_roll"))
        np.testing.assert_allclose(wrenches[:, 3:], np.cross(arm, wrenches[:, :3]), atol=0.02)


def test_mirrored_motions_have_mirrored_torques():
    q, qd, qdd = states(12)[:3]
    q = standing() + 0.1 * q
    model = Supported(ojas("rotor"))

    def mirrored(values: np.ndarray) -> np.ndarray:
        return np.concatenate([MIRROR * values[6:], MIRROR * values[:6]])

    for load in (0.0, 0.45, 1.0):
        tau = model.torque(load, q, qd, qdd)
        other = model.torque(1.0 - load, mirrored(q), mirrored(qd), mirrored(qdd))
        np.testing.assert_allclose(other, mirrored(tau), atol=1e-9)


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("kind", ["rotor", "lumped"])
def test_single_support_against_pinocchio(kind, side, judge):
    spec = ojas(kind)
    tree, other, foot = RigidBodyTree(spec), judge(spec), spec.feet[side]
    q, qd, qdd = states(12)[:3]
    q = standing() + 0.3 * q
    rot = other.placement(foot, q)[1].T  # the supporting foot stands level
    # the base moves so that this foot does not, in velocity and in acceleration
    jacobian = tree.jacobian(foot, q, rot)
    velocity = -np.linalg.solve(jacobian[:, :6], jacobian[:, 6:] @ qd)
    drift = tree.bias_acceleration(foot, q, qd, velocity, rot) + jacobian[:, 6:] @ qdd
    acceleration = -np.linalg.solve(jacobian[:, :6], drift)
    needed = other.inverse_dynamics(q, qd, qdd, velocity, acceleration, rot)
    wrench = np.linalg.solve(jacobian[:, :6].T, needed[:6])  # of the ground: nothing pushes at the base
    expected = needed[6:] - jacobian[:, 6:].T @ wrench
    tau = Supported(spec).torque(1.0 - side, q, qd, qdd)
    np.testing.assert_allclose(tau, expected, rtol=1e-9, atol=1e-9)


def test_supported_batch_equals_loop():
    q, qd, qdd = states(12, 2, 3)[:3]
    q = standing() + 0.1 * q
    load = np.random.default_rng(14).uniform(size=(2, 3))
    model = Supported(ojas("rotor"))
    together = model.torque(load, q, qd, qdd)
    for index in np.ndindex(2, 3):
        alone = model.torque(load[index], q[index], qd[index], qdd[index])
        np.testing.assert_allclose(together[index], alone, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("speed", [0.1, 0.2])
@pytest.mark.parametrize("name", ["rotor-fixed", "rotor-fixed-links", "lumped-fixed", "none-fixed"])
def test_validity_of_time_delay_estimation_along_the_gait(name, speed):
    tree = RigidBodyTree(SPECS[name])
    q = walking_pattern(speed, 1.0, 58.0, 0.001).q[::20]
    inertia = joint_space_inertia(tree.mass_matrix(q))
    valid, eigenvalues = tde_is_valid(inertia, M_BAR), tde_eigenvalues(inertia, M_BAR)
    assert eigenvalues.min() > 0
    if name == "none-fixed":
        assert not valid.any()
        assert eigenvalues.max() > 50
    else:
        assert valid.all()
        assert eigenvalues.max() < 1.5


# --------------------------------------------------------------------------------------------------------- wrong robots


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"mass": 0.0}, "mass of link 'box' is 0.0"),
        ({"mass": -1.0}, "mass.*-1.0"),
        ({"mass": math.nan}, "mass.*nan"),
        ({"inertia": (1.0, 1.0, 2.1)}, "inertia.*2.1"),
        ({"inertia": (0.0, 1.0, 1.0)}, "inertia.*0.0"),
        ({"inertia": (math.nan, 1.0, 1.0)}, "inertia.*nan"),
        ({"inertia": (math.inf, math.inf, math.inf)}, "inertia.*inf"),
    ],
)
def test_links_that_cannot_exist_are_refused(changes, words):
    link = box_link("box", 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0))
    with pytest.raises(RobotError, match=words):
        dataclasses.replace(link, **changes)


@pytest.mark.parametrize("arguments", [("gears", {}), ("rotor", {"arms": "long"})])
def test_unknown_variants_are_refused(arguments):
    kind, options = arguments
    with pytest.raises(OptionError, match=kind if not options else "long"):
        ojas(kind, **options)


def test_links_are_merged_by_the_parallel_axis_theorem():
    """Two half cubes on a fixed joint are the whole one."""
    half = (0.1, 0.1, 0.05)
    lower = box_link("lower", 1.0, half, (0.0, 0.0, -0.025))
    upper = box_link("upper", 1.0, half, (0.0, 0.0, 0.0), "lower", (0.0, 0.0, 0.025))
    merged = RobotSpec("cube", (lower, upper), (), 1.0, sites=(("top", "upper", (0.0, 0.0, 0.025)),)).merged()
    whole = box_link("lower", 2.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0))
    (link,) = merged.links
    np.testing.assert_allclose(
        [link.mass, *link.com, *link.inertia], [whole.mass, *whole.com, *whole.inertia], atol=1e-15
    )
    assert merged.sites == (("top", "lower", (0.0, 0.0, 0.05)),)


def test_a_merged_link_keeps_its_products_of_inertia():
    base = box_link("base", 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0))
    aside = box_link("aside", 1.0, (0.1, 0.1, 0.1), (0.0, 0.0, 0.0), "base", (0.1, 0.1, 0.0))
    (merged,) = RobotSpec("crooked", (base, aside), (), 1.0).merged().links
    np.testing.assert_allclose(merged.products, (-0.5 * 0.1 * 0.1, 0.0, 0.0), atol=1e-15)


def test_a_rotor_needs_a_joint():
    with pytest.raises(RobotError, match="'torso'"):
        dataclasses.replace(ojas("none"), actuated=("torso",), armature=(0.1,)).with_rotor_links()


def test_unknown_links_are_refused():
    with pytest.raises(RobotError, match=r"'tail'.*torso"):
        RigidBodyTree(ojas()).position("tail", np.zeros(12))
