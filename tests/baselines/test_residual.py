"""What a residual is: nothing when it is zero, an acceleration in the slot of du, mirrored, gated, held."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.errors import ActionError, OptionError
from artde_gym.registration import registered_controllers
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas.leg_ik import leg_angles
from artde_gym.robots.ojas.task import OBSERVATION
from artde_gym.robots.q450.task import ACTION
from baselines import legs, ojas
from baselines.network import Network
from baselines.residual import Residual, ResidualPolicy
from baselines.residual_config import ResidualConfig
from baselines.residual_env import ResidualEnv
from controllers.laws.tde import tde
from controllers.policies import ControlInterface

BIPED = {
    "duration": 3.0,
    "disturbances": {"push": [{"body": "chest", "magnitude": 25.0, "direction": [1, 1, 0], "start": 0.1}]},
}
ENVIRONMENTS = {
    "BipedWalk-Payload-v0": ("ojas", BIPED),
    "BipedPush-v0": ("ojas", BIPED),
    "QuadInfinity-Payload-v0": ("q450", {"duration": 3.0}),
    "QuadSling-Payload-v0": ("q450", {"duration": 3.0}),
}
SLOW = {"computed-torque"}
LAWS = list(registered_controllers())
SLUNG = {"geometric-load", "tde+swing", "atde+swing", "artde+swing"}
QUADROTOR_ONLY = {"asmc", "indi", "geometric", "tde-tight", *SLUNG}
SWITCHED = {"tde-switched", "atde-switched", "artde-switched"}
BIPED_ONLY = {"computed-torque", "tde+balance", "tde-stiff", "atde-stiff", "artde-stiff", *SWITCHED}
CASES = [
    (env_id, base)
    for env_id, (name, _) in ENVIRONMENTS.items()
    for base in LAWS
    if base not in (QUADROTOR_ONLY if name == "ojas" else BIPED_ONLY)
    if "Sling" in env_id or base not in SLUNG
]


def periods_since(state: Any) -> list[int]:
    return state.since.tolist()


def make(env_id: str, **more: Any) -> Any:
    _, kwargs = ENVIRONMENTS[env_id]
    return gym.make(env_id, disable_env_checker=True, **{**kwargs, **more})


def recipe(env_id: str, **more) -> ResidualConfig:
    return ResidualConfig(ENVIRONMENTS[env_id][0], **more)


@pytest.mark.once
@pytest.mark.parametrize(("env_id", "base"), CASES)
def test_zero_action_is_the_base_controller_bit_for_bit(env_id, base):
    decisions = 5 if base in SLOW else 12  # the push begins with the sixth
    agent = ResidualEnv(make(env_id), recipe(env_id, base=base))
    agent.reset(seed=5)
    alone = make(env_id)
    policy, state = controllers.make(base, alone), None
    observation, _ = alone.reset(seed=5)
    for _ in range(decisions):
        agent.step(np.zeros(len(agent.actions)))
        for _ in range(agent.residual.periods):
            action, state = policy.predict(observation, state)
            observation, *_ = alone.step(action)
        assert agent._observation.tobytes() == observation.tobytes()
    agent.close()
    alone.close()


def test_a_residual_is_du_of_the_law():
    rng = np.random.default_rng(0)
    env = make("BipedWalk-Payload-v0")
    policy = controllers.make("tde", env)
    observation = OBSERVATION.box().sample() * 1e-3
    signals = policy.read(observation)
    memory, du = policy.start(signals), rng.normal(size=12)
    expected, _ = tde(policy.gains, memory, signals, policy._period, du)
    found, _ = policy.step(memory, policy.with_residual(signals, du), observation)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    env.close()


def test_two_residuals_add_up():
    """A policy with a residual is a base like any other."""
    env = make("BipedWalk-Payload-v0")
    observation, _ = env.reset(seed=0)
    residual = Residual.of(env, ResidualConfig("ojas", action_mode="joints", gated=False))
    size = residual.features.size
    own = np.linspace(-0.5, 0.5, 12)
    constant = Network(np.zeros(size, "f4"), np.ones(size, "f4"), ((np.zeros((size, 12), "f4"), own.astype("f4")),))
    policy = ResidualPolicy("x", ControlInterface.of(env), residual, constant)
    base = controllers.make("tde", env)
    more = np.linspace(3.0, -1.0, 12)
    found, _ = policy.predict(observation, residual=more)
    expected, _ = base.predict(observation, residual=25.0 * own.astype("f4") + more)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7)
    env.close()


def test_ankles_and_inverse_kinematics_agree():
    rng = np.random.default_rng(1)
    ankles = np.array([0.0, 0.0, -0.36]) + rng.uniform(-0.03, 0.03, (50, 3))
    joints = leg_angles(ankles, robot.THIGH, robot.SHANK)
    np.testing.assert_allclose(legs.ankle(joints), ankles, rtol=0, atol=1e-12)


def test_moved_ankles_arrive_within_reach_and_stay_where_nothing_moves():
    ankles = np.tile([0.02, 0.0, -0.37], (2, 1))
    assert not legs.joint_offsets(ankles, np.zeros((2, 3))).any()
    before = leg_angles(ankles, robot.THIGH, robot.SHANK)
    offset = np.array([[0.05, 0.03, 0.02], [0.3, 0.0, 0.0]])
    after = legs.ankle(before + legs.joint_offsets(ankles, offset))
    np.testing.assert_allclose(after[0], ankles[0] + offset[0], atol=1e-12)
    assert np.linalg.norm(after[1]) == pytest.approx(legs.REACH[1])  # as far as the leg reaches


def walking_observation(rng, load_left: float) -> np.ndarray:
    observation = np.zeros(OBSERVATION.size)
    at = OBSERVATION.slices
    q = np.tile(leg_angles(np.array([0.01, 0.0, -0.36]), robot.THIGH, robot.SHANK), 2)
    observation[at["q_ref"]] = q + rng.normal(0, 0.01, 12)
    observation[at["q"]] = q + rng.normal(0, 0.02, 12)
    for name in ("qd", "qd_ref"):
        observation[at[name]] = rng.normal(0, 0.3, 12)
    observation[at["tilt"]] = rng.normal(0, 0.1, 2)
    observation[at["base_velocity"]] = rng.normal(0, 0.4, 3)
    observation[at["base_angular_velocity"]] = rng.normal(0, 0.4, 3)
    observation[at["load_left_ref"]] = load_left
    observation[at["contact"]] = (1.0, 0.0)
    observation[at["phase"]] = 0.3
    return observation


@pytest.mark.parametrize("action_mode", ["synergies", "wide-synergies", "joints"])
def test_the_mirrored_robot_gets_the_mirrored_residual(action_mode):
    rng = np.random.default_rng(2)
    env = make("BipedWalk-Payload-v0")
    residual = Residual.of(env, ResidualConfig("ojas", action_mode=action_mode))
    mirror = legs.Mirror(OBSERVATION)
    observation = walking_observation(rng, 1.0)
    np.testing.assert_array_equal(mirror(mirror(observation)), observation)
    action = rng.uniform(-1, 1, len(residual.actions))
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for seen in (observation, mirror(observation)):
        memory = residual.start(seen)
        features, memory = residual.observe(seen, memory)
        adapter = residual.set_action(memory, action).adapter
        for _ in range(6):
            _, adapter = residual.adapter.next_residual(adapter)
        du, _ = residual.adapter.next_residual(adapter)
        found.append((features, du))
    (features, du), (features_mirrored, du_mirrored) = found
    np.testing.assert_allclose(features_mirrored, features, rtol=0, atol=1e-12)
    assert np.abs(du).max() > 1.0
    np.testing.assert_allclose(legs.mirrored_joints(du_mirrored), du, rtol=0, atol=1e-9)
    env.close()


@pytest.mark.parametrize(
    ("tilt", "speed", "expected"),
    [(0.0, 0.0, 0.0), (0.029, 0.079, 0.0), (0.081, 0.0, 1.0), (0.0, 0.161, 1.0), (0.055, 0.0, 0.5)],
)
def test_the_gate_opens_by_tilt_or_by_velocity_error(tilt, speed, expected):
    observation = walking_observation(np.random.default_rng(3), 1.0)
    at = OBSERVATION.slices
    observation[at["qd_ref"]] = 0.0  # the reference stands still
    observation[at["tilt"]] = 0.6 * tilt, 0.8 * tilt
    observation[at["base_velocity"]] = 0.6 * speed, -0.8 * speed, 0.3
    env = make("BipedWalk-Payload-v0")
    residual = Residual.of(env, ResidualConfig("ojas"))
    features, memory = residual.observe(observation, residual.start(observation))
    gate = residual.features.split(features)["gate"][0]
    assert gate == pytest.approx(expected, abs=1e-9)
    du, _ = residual.adapter.next_residual(residual.set_action(memory, np.ones(11)).adapter)
    assert du.any() == (expected > 0)
    # and it closes slowly
    observation[at["tilt"]] = observation[at["base_velocity"]] = 0.0
    _, memory = residual.observe(observation, memory)
    assert memory.adapter.gate == pytest.approx(expected * np.exp(-0.02 / ojas.CLOSING))
    env.close()


@pytest.mark.once
def test_a_walk_without_pushes_keeps_the_gate_shut():
    env = ResidualEnv(make("BipedWalk-Payload-v0", disturbances={"payload": 1.3}, duration=4.0), ResidualConfig("ojas"))
    features, _ = env.reset(seed=0)
    for _ in range(190):
        features, *_ = env.step(np.ones(11))
        assert env.agent_layout.split(features)["gate"] == 0.0
    env.close()


def test_a_foot_on_the_ground_keeps_its_offset_until_it_swings_again():
    env = make("BipedWalk-Payload-v0")
    residual = Residual.of(env, ResidualConfig("ojas", gated=False))
    rng = np.random.default_rng(4)
    left, both, right = (walking_observation(rng, load) for load in (1.0, 0.7, 0.0))
    step = np.zeros(11)
    step[0], step[1] = 0.5, 0.5  # forward and outward
    _, memory = residual.observe(left, residual.start(left))
    memory = residual.set_action(memory, step)
    np.testing.assert_allclose(memory.adapter.offsets, [0, 0, 0.05, -0.03])
    _, memory = residual.observe(both, memory)
    memory = residual.set_action(memory, np.zeros(11))
    np.testing.assert_allclose(memory.adapter.offsets, [0, 0, 0.05, -0.03])
    _, memory = residual.observe(right, memory)  # now it stands, and the picture is mirrored
    np.testing.assert_allclose(memory.adapter.offsets, [0.05, 0.03, 0, 0])
    memory = residual.set_action(memory, np.zeros(11))
    np.testing.assert_allclose(memory.adapter.offsets, [0.05, 0.03, 0, 0])
    _, memory = residual.observe(left, memory)
    memory = residual.set_action(memory, np.zeros(11))
    assert not memory.adapter.offsets.any()
    env.close()


def test_du_is_bounded_and_held_for_whole_control_periods():
    env = make("BipedWalk-Payload-v0")
    residual = Residual.of(env, ResidualConfig("ojas", action_mode="joints", action_scale=7.0, gated=False))
    observation, _ = env.reset(seed=0)
    memory = residual.set_action(residual.observe(observation, residual.start(observation))[1], np.full(12, 9.0))
    adapter = memory.adapter
    for _ in range(residual.periods):
        du, adapter = residual.adapter.next_residual(adapter)
        np.testing.assert_array_equal(np.abs(du), 7.0)
    assert residual.periods == 20
    with pytest.raises(
        OptionError, match=r"decision_period is 0\.0205; allowed: whole multiples of the control period 0\.001 s"
    ):
        Residual.of(env, ResidualConfig("ojas", decision_period=0.0205))
    env.close()


def test_the_actor_is_asked_once_a_decision_and_each_environment_by_its_own_clock():
    env = make("QuadInfinity-Payload-v0", control_period=0.005)
    residual = Residual.of(env, ResidualConfig("q450"))
    asked = []

    def actor(features):
        asked.append(len(features))
        return np.zeros((*features.shape[:-1], 3))

    policy = ResidualPolicy("x", ControlInterface.of(env), residual, actor)
    observation, _ = env.reset(seed=0)
    pair = np.stack([observation] * 2)
    _, state = policy.predict(pair)
    counts = [periods_since(state)]
    for start in ([False, False], [False, True], [False, False], [False, False]):
        _, state = policy.predict(pair, state, start)
        counts.append(periods_since(state))
    assert counts == [[1, 1], [2, 2], [0, 1], [1, 2], [2, 0]]
    assert len(asked) == 3  # at the start; for the one that began anew; for the one that was due
    env.close()


def test_many_at_once_are_each_what_one_is_alone():
    rng = np.random.default_rng(5)
    env = make("BipedWalk-Payload-v0")
    residual = Residual.of(env, ResidualConfig("ojas"))
    size = residual.features.size
    weights = rng.normal(0, 0.3, (size, 11)).astype("f4")
    network = Network(np.zeros(size, "f4"), np.ones(size, "f4"), ((weights, np.zeros(11, "f4")),))
    policy = ResidualPolicy("x", ControlInterface.of(env), residual, network)
    runs = np.array([[walking_observation(rng, load) for load in (1.0, 0.0, 0.7)] for _ in range(25)])
    state, together = None, []
    for seen in runs:
        action, state = policy.predict(seen, state)
        together.append(action)
    for i in range(3):
        state = None
        for k, seen in enumerate(runs[:, i]):
            action, state = policy.predict(seen, state)
            np.testing.assert_array_equal(action, together[k][i])
    env.close()


def test_no_base_gives_the_force_itself():
    env = ResidualEnv(make("QuadInfinity-Payload-v0"), ResidualConfig("q450", "none"))
    observation, _ = env.env.reset(seed=0)
    memory = env.residual.set_action(env.residual.start(observation), np.array([1.0, 0.0, 0.0, -1.0]))
    force, _ = env.residual.control(observation, memory)
    box = ACTION.box()
    np.testing.assert_allclose(force, [box.high[0], 0.0, 0.0, box.low[3]])
    env.close()


def test_actions_are_checked():
    env = ResidualEnv(make("QuadInfinity-Payload-v0"), ResidualConfig("q450"))
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(3))
    env.reset(seed=0)
    with pytest.raises(ActionError, match="shape of the action"):
        env.step(np.zeros(5))
    with pytest.raises(ActionError, match="finite"):
        env.step(np.full(3, np.nan))
    env.close()
