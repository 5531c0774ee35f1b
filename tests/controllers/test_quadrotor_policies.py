"""The quadrotor's policies: memory per environment, names and errors, and flights along the path."""

import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import controllers
from artde_gym.errors import UnknownNameError
from artde_gym.info import fall_reason
from artde_gym.robots.q450.task import OBSERVATION
from controllers.laws.errors import GainError

pytestmark = pytest.mark.once

ID = "QuadInfinity-Payload-v0"
LAWS = ["tde", "atde", "artde", "artde-robust", "tde+c", "tde+kd", "pid", "asmc", "geometric", "indi"]


@pytest.fixture(scope="module")
def env():
    with gym.make(ID) as env:
        yield env


def observations(*shape: int, seed: int = 8) -> np.ndarray:
    """Plausible readings near hover."""
    rng = np.random.default_rng(seed)
    rows = np.zeros((*shape, OBSERVATION.size))
    parts = OBSERVATION.split(rows)
    count = int(np.prod(shape))
    turned = Rotation.from_rotvec(rng.normal(scale=0.1, size=(count, 3))).as_matrix()
    parts["rot_body_to_world"][:] = turned.reshape(*shape, 9)
    scales = {"position": 0.02, "velocity": 0.05, "body_rates": 0.1, "position_ref": 0.02, "velocity_ref": 0.05}
    scales |= {"acceleration_ref": 0.3, "jerk_ref": 0.3, "yaw_ref": 0.5, "yaw_rate_ref": 0.2, "wrench_applied": 0.05}
    for name, scale in scales.items():
        parts[name][:] = rng.normal(scale=scale, size=parts[name].shape)
    parts["wrench_applied"][..., 0] += 16.0
    return rows


def leaves(memory: Any) -> list[np.ndarray]:
    """The arrays of nested tuples."""
    return [leaf for part in memory for leaf in leaves(part)] if isinstance(memory, tuple) else [memory]


def run(policy: Any, rows: np.ndarray, starts: Any = None) -> list[list[np.ndarray]]:
    """Actions and all arrays of the memory after each row."""
    state, results = None, []
    for k, row in enumerate(rows):
        action, state = policy.predict(row, state, None if starts is None else starts[k])
        results.append([action, *leaves(state)])
    return results


# --------------------------------------------------------------------------------------------------------------- memory


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("name", LAWS)
def test_batch_equals_loop_bit_for_bit_in_any_order_of_memory(env, name, dtype):
    policy = controllers.make(name, env)
    rows = observations(5, 37).astype(dtype)
    together = run(policy, rows)
    transposed = run(policy, np.array([np.asfortranarray(row) for row in rows]))
    columns = [policy.predict(np.asfortranarray(row))[0] for row in rows]
    np.testing.assert_array_equal(columns, [policy.predict(row)[0] for row in rows])
    for i in range(37):
        alone = run(policy, rows[:, i])
        for many, same, one in zip(together, transposed, alone, strict=True):
            for a, b, c in zip(many, same, one, strict=True):
                np.testing.assert_array_equal(a[i], c, strict=True)
                np.testing.assert_array_equal(a, b, strict=True)
    block = run(policy, rows.reshape(5, 37, 1, -1))
    np.testing.assert_array_equal(block[-1][0][:, 0], together[-1][0])


@pytest.mark.parametrize("name", LAWS)
def test_environments_with_their_own_starts_equal_separate_runs(env, name):
    policy = controllers.make(name, env)
    rows = observations(12, 4)
    starts = np.random.default_rng(9).random((12, 4)) < 0.25
    starts[0] = True
    assert starts[1:].any(axis=0).any()
    together = np.array([sample[0] for sample in run(policy, rows, starts)])
    for i in range(4):
        memory = None
        for k in range(12):
            action, memory = policy.predict(rows[k, i], None if starts[k, i] else memory)
            np.testing.assert_array_equal(together[k, i], action)


@pytest.mark.parametrize("name", LAWS)
def test_all_memory_is_in_the_state(env, name):
    policy = controllers.make(name, env)
    first, second, other = observations(3)
    _, state = policy.predict(first)
    expected, _ = policy.predict(second, state)
    policy.predict(other, policy.predict(other)[1])  # another episode in between leaves no trace
    np.testing.assert_array_equal(policy.predict(second, state)[0], expected)
    np.testing.assert_array_equal(policy.predict(second, state, np.array([True]))[0], policy.predict(second)[0])


@pytest.mark.parametrize("name", LAWS)
def test_float32_means_the_same(env, name):
    policy = controllers.make(name, env)
    rows = observations(3, 2)
    for narrow, wide in zip(run(policy, rows.astype(np.float32)), run(policy, rows), strict=True):
        assert {leaf.dtype for leaf in narrow} == {np.dtype(np.float32)}
        np.testing.assert_allclose(narrow[0], wide[0], atol=5e-3)


@pytest.mark.parametrize("name", LAWS)
def test_policies_survive_pickling(env, name):
    policy = controllers.make(name, env)
    copy = pickle.loads(pickle.dumps(policy))
    for row in observations(2):
        np.testing.assert_array_equal(copy.predict(row)[0], policy.predict(row)[0])


def test_diagnostics_name_the_loops(env):
    rows = observations(2, 4)
    vector, scalar = (4, 3), (4,)
    expected: dict[str, dict[str, tuple[int, ...]]] = {
        "tde": {"sigma_p": vector, "sigma_q": vector, "attitude_error": vector, "force_command": vector},
        "atde": {"s_p": vector, "s_q": vector, "c_p": scalar, "c_q": scalar},
        "artde": {"sigma_p": vector, "beta_0_p": scalar, "beta_1_p": scalar, "beta_0_q": scalar, "beta_1_q": scalar},
        "geometric": {"integral_p": vector, "attitude_error": vector},
    }
    for name, shapes in expected.items():
        policy = controllers.make(name, env)
        known = policy.diagnostics(policy.predict(rows[1], policy.predict(rows[0])[1])[1])
        assert {key: known[key].shape for key in shapes} == shapes


def test_attitude_error_is_in_euler_angles_desired_minus_actual(env):
    policy = controllers.make("tde", env)
    row = observations(1)[0]
    parts = OBSERVATION.split(row)
    angles = np.array([0.1, -0.2, 3.1])  # roll, pitch, yaw
    parts["rot_body_to_world"][:] = Rotation.from_euler("ZYX", angles[::-1]).as_matrix().ravel()
    parts["yaw_ref"][:] = -3.1
    _, state = policy.predict(row)
    desired = Rotation.from_matrix(np.array(state.axes_ref).T).as_euler("ZYX")[::-1]
    expected = desired - angles + [0.0, 0.0, 2 * np.pi]  # yaw goes the short way round
    np.testing.assert_allclose(policy.diagnostics(state)["attitude_error"], expected, atol=1e-12)


# ------------------------------------------------------------------------------------------------------------ the names


@pytest.mark.parametrize(
    ("name", "overrides", "error", "words"),
    [
        ("computed-torque", {}, UnknownNameError, "'q450' is 'computed-torque'.*artde.*tde"),
        ("artde", {"preset": "tuned!"}, UnknownNameError, "'tuned!'.*'thesis', 'robust', 'tuned'"),
        ("tde", {"k_p": 1.0}, GainError, "'k_p'.*k_p_p, k_p_q"),
        ("artde", {"gama_0_q": 1.0}, GainError, "'gama_0_q'.*did you mean 'gamma_0_q'"),
        ("tde", {"k_p_q": -1.0}, GainError, "k_p_q is -1.0"),
        ("tde", {"k_p_p": (1.0, 2.0)}, GainError, "k_p_p is .*3 joints"),
        ("tde", {"lift_min": 0.0}, GainError, "lift_min is 0.0"),
        ("pid", {"k_i_p": -1.0}, GainError, "k_i_p is -1.0"),
    ],
)
def test_wrong_names_and_values_say_what_was_meant(env, name, overrides, error, words):
    with pytest.raises(error, match=words):
        controllers.make(name, env, **overrides)


@pytest.mark.parametrize("name", ["asmc", "indi", "geometric"])
def test_the_biped_says_what_it_has_instead(name):
    words = f"'ojas' is '{name}'.*artde.*pid.*tde"
    biped = gym.make("BipedWalk-Payload-v0", duration=0.1, actuator_inertia="lumped")
    with biped, pytest.raises(UnknownNameError, match=words):
        controllers.make(name, biped)


def test_overrides_replace_the_preset_of_one_loop(env):
    gains = controllers.make("artde", env, gamma_0_q=7.0, command_rate=25.0, m_bar_p=1.48).gains
    assert (gains.attitude.gamma_0, gains.position.gamma_0) == (7.0, 1.0)
    assert (gains.command_rate, gains.position.m_bar, gains.attitude.m_bar) == (25.0, 1.48, 0.015)
    assert controllers.make("artde", env, preset="robust").gains == controllers.make("artde-robust", env).gains


def test_the_thesis_gains_are_those_of_the_thesis(env):
    gains = controllers.make("artde", env).gains
    for loop, m_bar in ((gains.position, 1.0), (gains.attitude, 0.015)):
        assert (loop.m_bar, loop.k_p, loop.k_d) == (m_bar, 10.0, 5.0)
        assert (loop.gamma_0, loop.gamma_1, loop.beta_floor, loop.beta_start, loop.eps) == (1.0, 1.0, 0.01, 0.01, 5e-5)


# ---------------------------------------------------------------------------------------------------------- in the loop


def flown(
    env: gym.Env, policy: Any, duration: float = np.inf, **options: Any
) -> tuple[dict[str, np.ndarray], Any, Any]:
    """Fields over time until the end, a crash or `duration`; the last info; the last state."""
    observation, info = env.reset(seed=0, **options)
    rows, state, ended = [observation], None, False
    while not ended and info["time_s"] < duration:
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        rows.append(observation)
        ended = terminated or truncated
    return OBSERVATION.split(np.array(rows)), info, state


def rms(fields: dict[str, np.ndarray]) -> np.ndarray:
    return np.sqrt(np.mean((fields["position_ref"] - fields["position"]) ** 2, axis=0))


@pytest.mark.parametrize("name", LAWS)
def test_every_controller_flies_the_path(env, name):
    limit = 0.03 if name in ("tde", "atde", "artde", "artde-robust") else 0.06
    fields, info, _ = flown(env, controllers.make(name, env))
    assert not fall_reason(info)
    assert info["time_s"] == pytest.approx(70.0, abs=0.02)
    assert rms(fields).max() < limit


@pytest.mark.parametrize("name", ["tde", "atde", "artde", "pid", "asmc", "geometric", "indi"])
def test_tuned_gains_fly_the_first_loop_better_than_the_default(env, name):
    errors = []
    for options in ({}, {"preset": "tuned"}):
        fields, info, _ = flown(env, controllers.make(name, env, **options), 20.0)
        assert not fall_reason(info)
        errors.append(np.linalg.norm(rms(fields)))
    assert errors[1] < errors[0]


@pytest.mark.parametrize("name", ["tde", "artde"])
@pytest.mark.parametrize("options", [{"remembered_force": "commanded"}, {"attitude_error": "printed"}])
def test_two_readings_of_the_thesis_crash(env, name, options):
    _, info, _ = flown(env, controllers.make(name, env, **options))
    assert fall_reason(info) in ("ground", "inverted", "bounds")
    assert info["time_s"] < (3.0 if "attitude_error" in options else 33.0)


def test_gains_as_printed_drift_in_the_wind_and_bounded_ones_do_not():
    grown = {}
    with gym.make(ID, disturbances={"wind": 2.0}, duration=60.0) as env:
        for name in ("artde", "artde-robust"):
            policy = controllers.make(name, env)
            _, info, state = flown(env, policy)
            assert not fall_reason(info)
            grown[name] = policy.diagnostics(state)["beta_0_q"]
    assert grown["artde-robust"] < 0.02 < 0.05 < grown["artde"]


@pytest.mark.torch
@pytest.mark.parametrize("count", [1, 2])
def test_evaluate_policy_of_stable_baselines(count):
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import DummyVecEnv

    def build() -> Monitor:
        return Monitor(gym.make(ID, duration=0.3))

    env = build() if count == 1 else DummyVecEnv([build, build])
    _, lengths = evaluate_policy(controllers.make("artde", env), env, n_eval_episodes=2, return_episode_rewards=True)
    env.close()
    assert lengths == [20, 20]


def test_vector_environments_of_gymnasium(env):
    vector = gym.make_vec(ID, 2, "sync", duration=0.3)
    policy, single = controllers.make("artde", vector), controllers.make("artde", env)
    rows, _ = vector.reset(seed=1)
    actions, _ = policy.predict(rows)
    np.testing.assert_array_equal(actions[1], single.predict(rows[1])[0])
    vector.close()
