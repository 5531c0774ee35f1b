"""Policies: memory per environment, clipping, names and errors, and the protocol of Stable-Baselines3."""

import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import artde_gym
import controllers
from artde_gym import registration
from artde_gym.errors import OptionError, UnknownNameError
from artde_gym.robots.ojas.task import OBSERVATION
from controllers.laws.errors import GainError

LAWS = [
    "tde",
    "atde",
    "artde",
    "artde-robust",
    "pid",
    "tde+c",
    "tde+kd",
    "tde-switched",
    "atde-switched",
    "artde-switched",
]
POLICIES = [*LAWS, "computed-torque"]


def make_env(**kwargs: Any) -> gym.Env:
    return gym.make("BipedWalk-Payload-v0", **{"duration": 0.5, "actuator_inertia": "lumped", **kwargs})


@pytest.fixture(scope="module")
def env():
    with make_env() as env:
        yield env


def observations(*shape: int) -> np.ndarray:
    """Plausible readings: small errors about a bent pose, so that most commands stay within the limits."""
    rng = np.random.default_rng(8)
    rows = np.zeros((*shape, OBSERVATION.size))
    parts = OBSERVATION.split(rows)
    pose = np.tile([0.0, 0.0, -0.4, 0.8, -0.4, 0.0], 2)
    parts["q_ref"][:] = pose + rng.normal(scale=0.1, size=(*shape, 12))
    parts["q"][:] = parts["q_ref"] + rng.normal(scale=0.01, size=(*shape, 12))
    for name, scale in {"qd": 0.05, "qd_ref": 0.05, "qdd_ref": 1.0, "tau_applied": 5.0}.items():
        parts[name][:] = rng.normal(scale=scale, size=(*shape, 12))
    parts["load_left_ref"][:] = rng.uniform(size=(*shape, 1))
    return rows


def leaves(memory: Any) -> list[np.ndarray]:
    """The arrays of nested tuples."""
    return [leaf for part in memory for leaf in leaves(part)] if isinstance(memory, tuple) else [memory]


# --------------------------------------------------------------------------------------------------------------- memory


@pytest.mark.once
@pytest.mark.parametrize("name", POLICIES)
def test_environments_with_their_own_starts_equal_separate_runs(env, name):
    policy = controllers.make(name, env)
    rows = observations(12, 4)
    starts = np.random.default_rng(9).random((12, 4)) < 0.25
    starts[0] = True
    assert starts[1:].any(axis=0).any()
    state, together = None, []
    for row, start in zip(rows, starts, strict=True):
        action, state = policy.predict(row, state, start)
        together.append(action)
    for i in range(4):
        alone, memory = [], None
        for row, start in zip(rows[:, i], starts[:, i], strict=True):
            action, memory = policy.predict(row, None if start else memory)
            alone.append(action)
        np.testing.assert_array_equal(np.array(together)[:, i], alone)


@pytest.mark.once
@pytest.mark.parametrize("name", POLICIES)
def test_all_memory_is_in_the_state(env, name):
    policy = controllers.make(name, env)
    first, second, other = observations(3)
    _, state = policy.predict(first)
    expected, _ = policy.predict(second, state)
    policy.predict(other, policy.predict(other)[1])  # another episode in between leaves no trace
    np.testing.assert_array_equal(policy.predict(second, state)[0], expected)
    np.testing.assert_array_equal(policy.predict(second, state, np.array([True]))[0], policy.predict(second)[0])


@pytest.mark.once
@pytest.mark.parametrize("name", POLICIES)
def test_one_observation_equals_a_batch_of_one(env, name):
    policy = controllers.make(name, env)
    one, many = None, None
    for row in observations(3):
        single, one = policy.predict(row, one)
        batch, many = policy.predict(row[None], many)
        assert single.shape == (12,)
        np.testing.assert_array_equal(batch, single[None], strict=True)


@pytest.mark.once
@pytest.mark.parametrize("name", POLICIES)
def test_float32_observations_give_float32_actions(env, name):
    policy = controllers.make(name, env)
    narrow, wide = None, None
    for row in observations(3, 2):
        action, narrow = policy.predict(row.astype(np.float32), narrow)
        precise, wide = policy.predict(row, wide)
        assert action.dtype == np.float32
        assert {leaf.dtype for leaf in leaves(narrow)} <= {np.dtype(np.float32), np.dtype(bool)}
        np.testing.assert_allclose(action, precise, atol=1e-2)


@pytest.mark.parametrize("name", POLICIES)
def test_policies_survive_pickling(env, name):
    policy = controllers.make(name, env)
    copy = pickle.loads(pickle.dumps(policy))
    for row in observations(2):
        np.testing.assert_array_equal(copy.predict(row)[0], policy.predict(row)[0])


def test_diagnostics_name_what_the_memory_holds(env):
    rows = observations(2, 4)
    vector, scalar = (4, 12), (4,)
    expected: dict[str, dict[str, tuple[int, ...]]] = {
        "tde": {"sigma": vector},
        "atde": {"sigma": vector, "s": vector, "c": scalar},
        "artde": {"sigma": vector, "s": vector, "beta_0": scalar, "beta_1": scalar},
    }
    for name, shapes in expected.items():
        policy = controllers.make(name, env)
        known = policy.diagnostics(policy.predict(rows[1], policy.predict(rows[0])[1])[1])
        assert {key: known[key].shape for key in shapes} == shapes


# ----------------------------------------------------------------------------------------------------------- saturation


def tde_by_hand(before: np.ndarray, now: np.ndarray, period: float) -> np.ndarray:
    """TDE's command before saturation at the thesis' gains."""
    last, this = OBSERVATION.split(before), OBSERVATION.split(now)
    u = this["qdd_ref"] + 10.0 * (this["qd_ref"] - this["qd"]) + 25.0 * (this["q_ref"] - this["q"])
    return this["tau_applied"] + 0.042 * (u - (this["qd"] - last["qd"]) / period)


def test_actions_stay_in_the_action_space(env):
    rows = observations(2)
    OBSERVATION.split(rows)["q_ref"][:, ::2] += 1e3  # a command of kNm
    for name in LAWS:
        policy = controllers.make(name, env)
        _, state = policy.predict(rows[0])
        action, _ = policy.predict(rows[1], state)
        assert env.action_space.contains(action)
        np.testing.assert_array_equal(action[::2], 40.0)


def test_saturation_stores_the_applied_torque():
    with make_env(actuator_inertia="rotor") as env:
        policy = controllers.make("tde", env)
        before, _ = env.reset(seed=0)
        _, state = policy.predict(before)
        command = np.where(np.arange(12) % 2, 1.0, -1.0) * np.linspace(35.0, 90.0, 12)
        now, *_ = env.step(command)
        applied = OBSERVATION.split(now)["tau_applied"]
        np.testing.assert_array_equal(applied, np.clip(command, -40.0, 40.0))
        assert np.sum(np.abs(applied) == 40.0) == 11
        # the next command builds on what was applied, and leaves saturation at once
        expected = tde_by_hand(before, now, 0.001)
        action, _ = policy.predict(now, state)
        np.testing.assert_allclose(action, np.clip(expected, -40.0, 40.0), rtol=1e-10, atol=1e-10)
        assert np.sum(np.abs(expected) < 40.0) >= 6


# ------------------------------------------------------------------------------------------------------------ the names


@pytest.mark.parametrize(
    ("name", "overrides", "error", "words"),
    [
        ("artd", {}, UnknownNameError, "'artd'.*did you mean 'artde'"),
        ("artde", {"preset": "thesi"}, UnknownNameError, "'thesi'.*'thesis', 'robust'"),
        ("artde", {"gama_0": 1.0}, GainError, "'gama_0'.*did you mean 'gamma_0'"),
        ("tde", {"alpha": 1.0}, GainError, "'alpha'.*k_d, k_p, m_bar"),
        ("tde", {"k_p": -1.0}, GainError, "k_p is -1.0"),
        ("tde+ppo", {"k_p": 1.0}, OptionError, "gains of 'tde\\+ppo'.*'k_p'"),
        ("tde+ppo", {"policies": {"BipedWalk-Payload-v0": "/outside"}}, OptionError, "policies.*/outside.*biped-walk"),
        ("tde+ppo", {"policies": 3}, OptionError, "'policies': 3.*biped-walk"),
        ("tde+kd", {"alpha": [1.0] * 12}, GainError, "alpha is"),
        ("artde", {"alpha": [1.0] * 12}, GainError, "alpha is"),
        ("atde", {"eps": [1.0] * 12}, GainError, "eps is"),
        ("pid", {"m_bar": (0.04 * np.eye(12)).tolist()}, GainError, "m_bar.*couples"),
        ("computed-torque", {"k_x": 1.0}, GainError, "'k_x'"),
        ("computed-torque", {"preset": "robust"}, UnknownNameError, "'robust'.*'thesis'"),
    ],
)
def test_wrong_names_and_values_say_what_was_meant(env, name, overrides, error, words):
    with pytest.raises(error, match=words):
        controllers.make(name, env, **overrides)


@pytest.mark.parametrize("name", ["tde", "pid", "computed-torque"])
@pytest.mark.parametrize("gains", [{"k_p": (25.0, 25.0)}, {"k_d": (10.0,) * 11}, {"k_p": [[25.0]]}])
def test_gains_for_another_number_of_joints_are_refused(env, name, gains):
    with pytest.raises(GainError, match=r"k_[pd] is"):
        controllers.make(name, env, **gains)


def test_overrides_replace_the_preset(env):
    assert controllers.make("artde", env, gamma_0=7.0).gains.gamma_0 == 7.0
    assert controllers.make("artde", env, preset="robust").gains == controllers.make("artde-robust", env).gains


@pytest.mark.parametrize("length", [OBSERVATION.size - 1, OBSERVATION.size + 1, 0])
def test_observations_of_another_length_are_refused(env, length):
    with pytest.raises(OptionError, match=rf"observation.*{length}.*{OBSERVATION.size}"):
        controllers.make("tde", env).predict(np.zeros((3, length)))


def test_a_controller_of_the_users_own(env, tmp_path, monkeypatch):
    (tmp_path / "own_controllers.py").write_text(
        "class Constant:\n"
        "    def __init__(self, env, torque):\n"
        "        self.action = torque * env.action_space.high\n"
        "    def predict(self, observation, state=None, episode_start=None, deterministic=True):\n"
        "        return self.action, None\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", registration.registered_controllers())
    artde_gym.register_controller("constant", "own_controllers:Constant", torque=0.5)
    assert controllers.make("constant", env).predict(None)[0].tolist() == [20.0] * 12
    artde_gym.register_controller("any-constant", "own_controllers:Constant")
    assert controllers.make("any-constant", env, torque=0.25).predict(None)[0].tolist() == [10.0] * 12
    with pytest.raises(UnknownNameError, match="own_controllers"):
        artde_gym.register_controller("broken", "own_controllers")


# ---------------------------------------------------------------------------------------------------------- in the loop


@pytest.mark.torch
@pytest.mark.parametrize("name", ["tde", "artde", "computed-torque"])
@pytest.mark.parametrize("count", [1, 2])
def test_evaluate_policy_of_stable_baselines(name, count):
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import DummyVecEnv

    def build() -> Monitor:
        return Monitor(make_env(duration=0.1))

    env = build() if count == 1 else DummyVecEnv([build, build])
    policy = controllers.make(name, env)
    rewards, lengths = evaluate_policy(policy, env, n_eval_episodes=2, return_episode_rewards=True)
    env.close()
    assert lengths == [100, 100]
    # alive, tracking and upright together earn at most 3.5 a second
    np.testing.assert_allclose(rewards, 0.34, atol=0.01)


def test_vector_environments_of_gymnasium(env):
    vector = gym.make_vec("BipedWalk-Payload-v0", 2, "sync", duration=0.1, actuator_inertia="lumped")
    policy, single = controllers.make("artde", vector), controllers.make("artde", env)
    rows, _ = vector.reset(seed=1)
    actions, _ = policy.predict(rows)
    np.testing.assert_array_equal(actions[1], single.predict(rows[1])[0])
    vector.close()


def rollout(env: gym.Env, policy: Any, **options: Any) -> dict[str, np.ndarray]:
    observation, _ = env.reset(seed=0, **options)
    rows, state, truncated = [observation], None, False
    while not truncated:
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        assert not terminated, info
        rows.append(observation)
    return OBSERVATION.split(np.array(rows))


@pytest.mark.once
def test_computed_torque_walks_with_a_small_error():
    env = make_env(duration=6.0, disturbances={}, control_period=0.005)
    walk = rollout(env, controllers.make("computed-torque", env))
    env.close()
    error = np.degrees(walk["q_ref"] - walk["q"])
    assert np.sqrt(np.mean(error**2)) < 0.1
    assert np.abs(error).max() < 1.0
    assert walk["phase"].max() > 0.95
