"""`ArmTrack-Payload-v0`: references, friction, equilibrium, both engines, batches, designed gains on unknown files."""

import copy
import dataclasses
import math
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from scipy.spatial.transform import Rotation

import controllers
from artde_gym.errors import DisturbanceError, OptionError, RobotError
from artde_gym.motion.scene import scene_of
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reader import read_arm
from artde_gym.robots.arm.reference import FIGURE_EIGHT, KINDS, PICK, RISE, home, reference
from artde_gym.robots.arm.task import Tracking
from artde_gym.robots.arm.tool import Tool
from artde_gym.robots.arm.workspace import workspace_inertia
from controllers.arm_design import LEVEL, design_arm, designed, largest_bandwidth
from controllers.laws.errors import GainError
from controllers.laws.stability import tde_eigenvalues

ID = "ArmTrack-Payload-v0"
BUSY: dict[str, Any] = {
    "payload": {"mass": 1.5, "attach_time": 0.02, "detach_time": 0.05, "position": [0.0, 0.0, 0.1]},
    "push": [{"magnitude": 20.0, "start": 0.03, "duration": 0.02}],
    "joint_friction": {"uniform": [0.5, 2.0]},
    "mass_scale": {"uniform": [0.9, 1.1]},
    "motor_lag": 0.002,
    "action_delay": 1,
}
INERTIA = '<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/>'
LIMIT = '<limit lower="-2" upper="2" effort="80" velocity="3"/><dynamics damping="1" friction="0.5"/>'


def small_arm(folder: Path) -> Path:
    """A crane: it turns, lifts and telescopes."""
    body = '<inertial><origin xyz="0.1 0 0"/><mass value="2"/>' + INERTIA + "</inertial>"
    links = "".join(f'<link name="{name}">{body}</link>' for name in "abcd")
    joints = "".join(
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0.2 0 0.1"/><axis xyz="{axis}"/>{LIMIT}</joint>'
        for name, kind, parent, child, axis in (
            ("turn", "revolute", "a", "b", "0 0 1"),
            ("lift", "revolute", "b", "c", "0 1 0"),
            ("reach", "prismatic", "c", "d", "1 0 0"),
        )
    )
    path = folder / "crane.urdf"
    path.write_text(f"<robot>{links}{joints}</robot>")
    return path


def make(**arguments: Any) -> Any:
    return gym.make(ID, **{"duration": 0.1, "disturbances": BUSY, **arguments})


def run(env: Any, law: str = "tde", seed: int = 3) -> np.ndarray:
    policy = controllers.make(law, env)
    observation, _ = env.reset(seed=seed)
    state, seen, over, truncated = None, [observation], False, False
    while not over:
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, _ = env.step(action)
        seen.append(observation)
        over = terminated or truncated
    assert truncated
    return np.array(seen)


# ------------------------------------------------------------------------------------------------------- the robot


def test_the_built_in_arm_is_that_of_its_publications():
    spec = panda()
    assert spec.mass == pytest.approx(4.970684 + 0.646926 + 3.228604 + 3.587895 + 1.225946 + 1.666555 + 0.735522)
    assert spec.torque_limits == (87.0,) * 4 + (12.0,) * 3
    # with all angles at zero the flange is .088 m ahead and .333 + .316 + .384 - .107 m above the base
    tool = Tracking.of(
        "panda", None, None, None, {"times": [0, 1], "points": [[0, 0, 0, -0.1, 0, 0.1, 0]] * 2}, 0.001, 0.1
    )
    tree, q = RigidBodyTree(spec), np.zeros(7)
    found = tree.position("joint7", q) + tree.rotation("joint7", q) @ np.asarray(tool.tool_point)
    np.testing.assert_allclose(found, (0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107), atol=1e-12)


def test_the_built_in_arm_agrees_with_pinocchio(judge):
    tree, other = RigidBodyTree(panda()), judge(panda())
    rng = np.random.default_rng(0)
    for q, qd, qdd in zip(*rng.normal(size=(3, 20, 7)), strict=True):
        np.testing.assert_allclose(tree.mass_matrix(q), other.mass_matrix(q), rtol=0, atol=1e-9)
        forces = tree.inverse_dynamics(q, qd, qdd), other.inverse_dynamics(q, qd, qdd)
        np.testing.assert_allclose(*forces, rtol=0, atol=1e-9)


@pytest.mark.once
@pytest.mark.parametrize("kind", KINDS)
def test_references_are_smooth_and_begin_at_rest(kind):
    time = 1e-3 * np.arange(12_001)
    found = reference(panda(), kind, time)
    np.testing.assert_allclose(np.gradient(found.q, time, axis=0)[1:-1], found.qd[1:-1], atol=2e-5)
    np.testing.assert_allclose(np.gradient(found.qd, time, axis=0)[2:-2], found.qdd[2:-2], atol=3e-3)
    np.testing.assert_allclose(found.qd[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(found.qdd[0], 0.0, atol=1e-15)
    fastest = [panda().by_name[name].speed for name in panda().actuated]
    assert (np.abs(found.qd).max(axis=0) < fastest).all()


def test_the_tool_draws_a_figure_eight(tmp_path):
    """Eased in, at its place to a micrometer, the same in each round; also of an arm with a sliding joint."""
    crane, pose = read_arm(small_arm(tmp_path)), [0.2, -0.4, 0.3]
    time = 0.01 * np.arange(1001)
    for spec, given in ((panda(), FIGURE_EIGHT), (crane, {"size": [0.15, 0.08], "period": 4.0, "pose": pose})):
        found = reference(spec, given, time)
        np.testing.assert_allclose(found.q[0], home(spec) if spec == panda() else pose, atol=1e-12)
        place, phase = Tool(spec).position(found.q), 2 * np.pi / 4.0 * (time - RISE / 2)
        eight = np.stack([0 * time, 0.15 * np.sin(phase), 0.08 * np.sin(2 * phase)], axis=1)
        late = time >= RISE
        np.testing.assert_allclose((place - place[0])[late], eight[late], atol=1e-6)
        np.testing.assert_allclose(found.q[400], found.q[800], atol=1e-12)


def test_a_figure_eight_goes_through_a_home_of_zeros(tmp_path):
    """The search for a pose passes the home, where joints are zero but for rounding, and must not stop there."""
    crane, time = read_arm(small_arm(tmp_path)), 0.01 * np.arange(601)
    assert not home(crane).any()
    place = Tool(crane).position(reference(crane, {"size": [0.15, 0.08], "period": 4.0}, time).q)
    np.testing.assert_allclose(np.ptp(place[time >= RISE], axis=0), [0.0, 0.3, 0.16], atol=2e-4)


@pytest.mark.parametrize(
    "given",
    [
        "wave",
        {"times": [0, 1]},
        {"times": [0, 0], "points": [[0.0] * 7] * 2},
        {"times": [0, 1], "points": [[0.0] * 6] * 2},
        {"times": [0, 1], "points": [[9.0] * 7] * 2},
        {"times": [0, 1], "points": "here"},
        {"amplitude": -1.0, "frequency": 0.2},
        {"amplitude": 3.0, "frequency": 0.2},
        {"size": [0.1], "period": 4.0},
        {"size": [0.1, 0.1], "period": 0.0},
        {"size": [0.1, 0.1], "period": 4.0, "pose": [0.0]},
        {"size": [1.5, 1.5], "period": 4.0},
        {"size": [0.1, 0.1], "period": 4.0, "speed": 1.0},
        {"amplitude": math.nan, "frequency": 0.2},
    ],
)
def test_impossible_references_are_refused(given):
    with pytest.raises(OptionError, match="reference"):
        make(reference=given, duration=5.0)


# -------------------------------------------------------------------------------------------------- the environment


def test_the_environment_passes_gymnasiums_check(engine_name):
    env = make(engine=engine_name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()


@pytest.mark.once
def test_the_arm_starts_in_equilibrium(engine_name):
    load = {"payload": {"mass": 2.0, "position": [0.0, 0.05, 0.1]}, "mass_scale": 1.1}
    env = make(engine=engine_name, disturbances=load)
    start, _ = env.reset(seed=0)
    fields = env.unwrapped.observation_layout.split(start)
    observation = start
    for _ in range(50):
        observation, *_ = env.step(fields["tau_applied"])
    after = env.unwrapped.observation_layout.split(observation)
    tolerance = 1e-9 if engine_name == "mujoco" else 1e-6
    np.testing.assert_allclose(after["q"], fields["q"], atol=tolerance)
    env.close()


@pytest.mark.once
def test_friction_takes_energy_and_scales():
    task = Tracking.of("panda", None, None, None, PICK, 0.001, 1.0)
    qd = np.random.default_rng(0).normal(size=(20, 7))
    torque = task.friction(1.0, qd)
    assert (torque * qd < 0).all()
    np.testing.assert_allclose(task.friction(2.0, qd), 2 * torque)
    assert (np.abs(task.friction(1.0, 100 * qd)) <= task.coulomb).all()


@pytest.mark.once
@pytest.mark.bullet
def test_both_engines_walk_one_path():
    paths = []
    for engine in ("mujoco", "bullet"):
        env = make(engine=engine, duration=0.5)
        paths.append(run(env))
        env.close()
    columns = panda_layout()["tool"]
    assert np.abs(np.subtract(*paths)[:, columns]).max() < 5e-6


def panda_layout() -> Any:
    from artde_gym.robots.arm.task import observation_layout

    return observation_layout(panda())


@pytest.mark.once
def test_an_episode_repeats_bitwise(engine_name):
    env = make(engine=engine_name)
    first = run(env)
    np.testing.assert_array_equal(first, run(env))
    twin = copy.deepcopy(env)
    np.testing.assert_array_equal(first, run(twin))
    for one in (env, twin):
        one.close()


@pytest.mark.once
@pytest.mark.parametrize("period", [0.001, 0.004])
@pytest.mark.parametrize("law", ["tde", "artde"])
def test_a_batch_is_bitwise_a_loop(period, law):
    noisy = {**BUSY, "encoder_bits": 18}
    arguments = {"duration": 0.1, "control_period": period, "disturbances": noisy, "engine": "mujoco"}
    envs = gym.make_vec(ID, num_envs=3, vectorization_mode="vector_entry_point", **arguments)
    policy, state = controllers.make(law, envs), None
    observations, _ = envs.reset(seed=3)
    seen = [observations]
    for _ in range(round(0.1 / period)):
        actions, state = policy.predict(observations, state)
        observations, rewards, *_ = envs.step(actions)
        assert np.isfinite(rewards).all()
        seen.append(observations)
    for i in range(3):
        env = gym.make(ID, **arguments)
        np.testing.assert_array_equal(np.array(seen)[:, i], run(env, law, seed=3 + i))
        env.close()
    envs.close()


def test_limits_of_position_end_an_episode():
    env = make(engine="mujoco", disturbances={})
    _, info = env.reset(seed=0)
    terminated = False
    for _ in range(100):
        *_, terminated, _, info = env.step(np.full(7, 1e6))
        if terminated:
            break
    assert terminated
    assert info["fell_position"] or info["fell_speed"]
    env.close()


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ({"robot": "robot.sdf"}, RobotError),
        ({"robot": 3}, OptionError),
        ({"tip": "hand"}, OptionError),
        ({"armature": 0.1}, OptionError),
        ({"duration": 0.0}, OptionError),
        ({"control_period": 0.0015}, OptionError),
        ({"engine": "dart"}, OptionError),
        ({"disturbances": {"friction": 0.5}}, DisturbanceError),
        ({"disturbances": {"joint_friction": -1.0}}, DisturbanceError),
        ({"disturbances": {"sensor_noise": {"tilt": 0.1}}}, DisturbanceError),
        ({"disturbances": {"push": [{"body": "torso", "magnitude": 1.0, "start": 0.0}]}}, DisturbanceError),
    ],
)
def test_impossible_arguments_are_refused(arguments, error):
    with pytest.raises(error):
        make(**arguments)


def test_an_arm_with_the_names_of_the_built_in_one_has_its_own_home():
    links = (dataclasses.replace(link, limits=(0.5, 1.5)) if link.axis else link for link in panda().links)
    np.testing.assert_allclose(home(dataclasses.replace(panda(), links=tuple(links))), 1.0)


@pytest.mark.parametrize("chosen", [["turn", "lift"], ["reach", "lift"], ["lift"]])
def test_some_joints_move_and_the_others_are_locked(tmp_path, chosen):
    """The whole arm with its other joints at zero has the same dynamics and the same tool."""
    file = small_arm(tmp_path)
    spec, whole = read_arm(file, joints=chosen, tip="d", armature=0.2), RigidBodyTree(read_arm(file, armature=0.2))
    assert spec.actuated == tuple(name for name in ("turn", "lift", "reach") if name in chosen)
    moving = [whole.joints.index(name) for name in spec.actuated]
    ours, rng = RigidBodyTree(spec), np.random.default_rng(0)
    for _ in range(10):
        q, qd, qdd = np.zeros((3, 3))
        q[moving], qd[moving], qdd[moving] = rng.normal(size=(3, len(moving)))
        torques = whole.joint_torques(q, qd, qdd)[moving]
        np.testing.assert_allclose(ours.joint_torques(q[moving], qd[moving], qdd[moving]), torques, atol=1e-10)
    assert read_arm(file, joints=["turn"]).sites[0][:2] == ("tool", "turn")


def test_an_arm_with_locked_joints_is_tracked_alike_in_a_vector(tmp_path):
    arguments = {"robot": str(small_arm(tmp_path)), "joints": ["turn", "reach"], "armature": 0.2, "duration": 0.1}
    arguments |= {"engine": "mujoco", "disturbances": {}}
    env, envs = gym.make(ID, **arguments), gym.make_vec(ID, 2, "vector_entry_point", **arguments)
    assert env.action_space.shape == (2,)
    seen = run(env)
    policy, state, (observations, _) = controllers.make("tde", envs), None, envs.reset(seed=3)
    for row in seen[1:]:
        actions, state = policy.predict(observations, state)
        observations, *_ = envs.step(actions)
        np.testing.assert_array_equal(observations[0], row)
    env.close()
    envs.close()


@pytest.mark.parametrize("joints", [[], ["turn", "turn"], ["swing"], "turn", 3, [1], [["turn"]]])
def test_impossible_joints_are_refused(tmp_path, joints):
    with pytest.raises(RobotError, match="joint"):
        make(robot=small_arm(tmp_path), joints=joints)


def test_joints_have_to_lie_on_the_way_to_the_tip(tmp_path):
    with pytest.raises(RobotError, match="on the way"):
        make(robot=small_arm(tmp_path), joints=["turn", "reach"], tip="c")
    with pytest.raises(OptionError, match="joints"):
        make(joints=["joint1"])


# ----------------------------------------------------------------------------------------------------------- design


@pytest.mark.once
def test_designed_gains_are_valid_all_over_the_workspace():
    gains = design_arm(panda(), 0.001)
    eigenvalues = tde_eigenvalues(workspace_inertia(panda()), gains.m_bar)
    assert eigenvalues.min() > 0
    assert eigenvalues.max() == pytest.approx(LEVEL)
    assert gains.k_d == pytest.approx(2 * math.sqrt(gains.k_p))


@pytest.mark.once
@pytest.mark.parametrize("inertia", [(0.2, 1.0), (0.5, 1.4), (0.05, 0.9)])
@pytest.mark.parametrize("period", [0.001, 0.004])
def test_the_bandwidths_limit_is_where_a_mode_becomes_unstable(inertia, period):
    low, high = inertia
    limit = largest_bandwidth(low, high, period)

    def radius(omega: float) -> float:
        found = []
        for lam in np.linspace(low, high, 50):
            a = np.array([-lam * omega**2, -2 * lam * omega, 1 - lam])
            v = np.array([0.0, 1.0, 0.0]) + period * a
            q = np.array([1.0, 0.0, 0.0]) + period * v
            found.append(np.abs(np.linalg.eigvals(np.array([q, v, a]))).max())
        return max(found)

    assert radius(0.97 * limit) < 1.0
    assert radius(1.03 * limit) > 1.0


@pytest.mark.parametrize(("period", "level"), [(0.0, 1.0), (math.nan, 1.0), (0.001, 0.0), (0.001, 2.0)])
def test_impossible_designs_are_refused(period, level):
    with pytest.raises(GainError):
        designed(np.eye(2)[None], period, level)


def test_an_arm_without_rotors_is_designed_with_a_warning(tmp_path):
    env = make(robot=small_arm(tmp_path), disturbances={})
    with pytest.warns(UserWarning, match="no reflected rotor inertia"):
        controllers.make("tde", env)
    env.close()


@pytest.mark.once
@pytest.mark.parametrize("law", ["tde", "artde", "atde", "pid", "tde+c", "tde+kd", "artde-robust", "computed-torque"])
def test_a_file_that_no_law_has_seen_is_tracked(tmp_path, law, engine_name):
    load = {"payload": {"mass": 2.0, "attach_time": 0.2, "detach_time": 0.4}}
    env = make(robot=small_arm(tmp_path), armature=0.2, duration=0.5, disturbances=load, engine=engine_name)
    seen = run(env, law)
    fields = env.unwrapped.observation_layout.split(seen)
    worst = np.abs(fields["tool"] - fields["tool_ref"]).max()
    assert worst < (0.05 if law == "computed-torque" else 0.005)
    assert fields["q"].shape[1] == 3
    assert set(env.unwrapped.words["joint"]) == {"turn", "lift", "reach"}
    env.close()


def test_a_replay_shows_the_tool_where_it_is(tmp_path):
    """Forward kinematics of a scene, written down once more: a body turns or slides in its parent's frame."""
    path = tmp_path / "arm.urdf"
    path.write_text(small_arm(tmp_path).read_text().replace("<origin xyz", '<origin rpy="0.3 -0.2 0.5" xyz'))
    for arguments in ({}, {"robot": str(path), "armature": 0.2}):
        env = make(engine="mujoco", disturbances={"initial_pose": {"joint": "all", "offset": 0.05}}, **arguments)
        env.reset(seed=0)
        shown, q = scene_of("arm", arguments, ID), np.asarray(env.unwrapped.pose().q)
        places: list[tuple[np.ndarray, Rotation]] = []
        for body in shown.bodies:
            origin, turn = (np.zeros(3), Rotation.identity()) if body.parent is None else places[body.parent]
            origin = origin + turn.apply(body.origin)
            if body.axis is not None and body.joint is not None:
                move = q[body.joint] * np.asarray(body.axis)
                origin, turn = (
                    (origin + turn.apply(move), turn) if body.slides else (origin, turn * Rotation.from_rotvec(move))
                )
            places.append((origin, turn))
        number, point = shown.sites["tool"]
        origin, turn = places[number]
        np.testing.assert_allclose(origin + turn.apply(point), env.unwrapped.engine.site("tool"), atol=1e-9)
        env.close()


def test_reading_what_is_drawn(drawing_engine, tmp_path):
    env = make(robot=small_arm(tmp_path), engine=drawing_engine, render_mode="rgb_array", width=64, height=48)
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == (48, 64, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10
    env.close()
