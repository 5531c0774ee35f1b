"""`BipedWalk-Payload-v0` from outside: Gymnasium's contract, determinism, physics and refusals."""

from __future__ import annotations

import multiprocessing
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import artde_gym
import controllers
from artde_gym.errors import ActionError, ArtdeGymError, DisturbanceError, OptionError, UnknownNameError
from artde_gym.info import fall_reason
from artde_gym.sim.factory import EngineName, installed_engines

ID = "BipedWalk-Payload-v0"


def make(**kwargs: Any) -> Any:
    kwargs.setdefault("duration", 6.0)
    return gym.make(ID, disable_env_checker=True, **kwargs)


def sampled(env: Any, **kwargs: Any) -> Any:
    """Reset, and tell what was sampled."""
    env.reset(**kwargs)
    return env.unwrapped.sampled_disturbances


def trajectory(env: Any, seed: int, steps: int, options: dict[str, Any] | None = None) -> np.ndarray:
    """Observations under TDE from a seeded reset."""
    policy = controllers.make("tde", env)
    observation, _ = env.reset(seed=seed, options=options)
    observations, state = [observation], None
    for _ in range(steps):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        observations.append(observation)
    return np.array(observations)


VARIED: dict[str, Any] = {
    "payload": {"mass": {"uniform": [0.5, 1.5]}},
    "friction": {"uniform": [0.7, 0.9]},
    "push": [{"magnitude": {"uniform": [1, 5]}, "start": 0.05, "duration": 0.1}],
}


@pytest.mark.parametrize("kwargs", [{}, {"control_period": 0.004, "actuator_inertia": "lumped", "arms": "revolute"}])
def test_gymnasium_checker_passes(drawing_engine: EngineName, kwargs: dict[str, Any]) -> None:
    env = gym.make(ID, duration=6.0, render_mode="rgb_array", engine=drawing_engine, **kwargs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".* can never happen")
        # torques are in Nm by design; RescaleAction gives [-1, 1]
        warnings.filterwarnings("ignore", message=".*recommend using a symmetric and normalized space")
        check_env(env.unwrapped)
    env.close()


def test_spec_survives_json() -> None:
    env = make(disturbances=VARIED, control_period=0.002)
    again: Any = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.control_period == 0.002
    first, second = (sampled(each, seed=3) for each in (env, again))
    assert first == second


@pytest.mark.once
def test_same_seed_same_bits_in_one_process(engine_name: EngineName) -> None:
    env, other = make(disturbances=VARIED, engine=engine_name), make(disturbances=VARIED, engine=engine_name)
    first = trajectory(env, seed=1, steps=300)
    trajectory(env, seed=2, steps=50)
    trajectory(env, seed=3, steps=50, options={"disturbances": {}})
    again = trajectory(env, seed=1, steps=300, options={"disturbances": VARIED})
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() == trajectory(other, seed=1, steps=300).tobytes()
    assert first.tobytes() != trajectory(env, seed=2, steps=300).tobytes()


def _trajectory_elsewhere(engine_name: EngineName) -> bytes:
    return trajectory(make(disturbances=VARIED, engine=engine_name), seed=1, steps=300).tobytes()


def test_same_seed_same_bits_in_another_process() -> None:
    names: list[EngineName] = [*installed_engines()]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.map(_trajectory_elsewhere, names)
    assert [_trajectory_elsewhere(name) for name in names] == there


@pytest.mark.once
def test_two_environments_in_one_process_do_not_touch_each_other(engine_name: EngineName) -> None:
    alone = trajectory(make(disturbances=VARIED, engine=engine_name), seed=5, steps=100)
    env, disturber = (
        make(disturbances=VARIED, engine=engine_name),
        make(disturbances={"payload": 3.0}, control_period=0.002, engine=engine_name),
    )
    policy, rng = controllers.make("tde", env), np.random.default_rng(0)
    observation, _ = env.reset(seed=5)
    disturber.reset(seed=6)
    together, state = [observation], None
    for step in range(100):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        together.append(observation)
        terminated = disturber.step(rng.uniform(-40, 40, 12))[2]
        if terminated or step == 50:
            disturber.reset()
    disturber.close()
    assert alone.tobytes() == np.array(together).tobytes()


def test_async_vector_env_with_spawn(engine_name: EngineName) -> None:
    envs: Any = gym.make_vec(
        ID,
        num_envs=2,
        vectorization_mode="async",
        vector_kwargs={"context": "spawn"},
        engine=engine_name,
        duration=4.5,
        disturbances=VARIED,
    )
    observations, _ = envs.reset(seed=[1, 2])
    policy = controllers.make("artde", envs)
    state = None
    for _ in range(20):
        actions, state = policy.predict(observations, state)
        observations, *_ = envs.step(actions)
    envs.close()
    single = make(duration=4.5, disturbances=VARIED, engine=engine_name)
    policy, state = controllers.make("artde", single), None
    observation, _ = single.reset(seed=2)
    for _ in range(20):
        action, state = policy.predict(observation, state)
        observation, *_ = single.step(action)
    assert observations[1].tobytes() == observation.tobytes()


@pytest.mark.once
def test_start_is_at_rest_in_balance_and_without_antagonistic_torques(engine_name: EngineName) -> None:
    env = make(disturbances={}, engine=engine_name)
    observation, _ = env.reset(seed=0)
    assert env.unwrapped.sampled_disturbances == {}
    fields = env.unwrapped.observation_layout.split(observation)
    assert np.abs(fields["qd"]).max() < 0.02
    assert np.degrees(np.abs(fields["q"] - fields["q_ref"])).max() < 0.05
    left, right = fields["tau_applied"][:6], fields["tau_applied"][6:]
    np.testing.assert_allclose(left * [1, -1, 1, 1, 1, -1], right * [1, -1, 1, 1, 1, -1], atol=0.02)
    assert np.abs(fields["tau_applied"][[0, 1, 5]]).max() < 0.02  # nothing presses the feet apart
    assert fields["contact"].tolist() == [1, 1]


@pytest.mark.once
@pytest.mark.parametrize("mass", [0.0, 1.3, 3.0])
def test_ground_carries_robot_and_payload(engine_name: EngineName, mass: float) -> None:
    env = make(disturbances={"payload": mass} if mass else {}, engine=engine_name)
    observation, _ = env.reset(seed=0)
    env.step(observation[env.unwrapped.observation_layout["tau_applied"]])
    load = sum(env.unwrapped._engine.foot_loads())
    assert load == pytest.approx((8.986 + mass) * 9.81, rel=0.01)


def test_saturation_is_what_the_observation_reports() -> None:
    env = make(disturbances={})
    env.reset(seed=0)
    action = env.unwrapped._tau.copy()
    action[3], action[9] = -500.0, 41.0
    observation, *_ = env.step(action)
    applied = observation[env.unwrapped.observation_layout["tau_applied"]]
    assert applied[3] == -40.0
    assert applied[9] == 40.0
    assert np.array_equal(np.delete(applied, [3, 9]), np.delete(action, [3, 9]))


def test_reward_is_the_scaled_sum_of_its_terms() -> None:
    from artde_gym.robots.ojas.task import REWARD_SCALES

    env = make(control_period=0.004)
    env.reset(seed=0)
    _, reward, _, _, info = env.step(env.unwrapped._tau * 1.1)
    terms = {name.removeprefix("reward_"): value for name, value in info.items() if name.startswith("reward_")}
    assert set(terms) == set(REWARD_SCALES)
    assert reward == pytest.approx(0.004 * sum(REWARD_SCALES[name] * value for name, value in terms.items()))
    assert all(np.isfinite(value) and 0 <= value <= 1 for value in terms.values())


@pytest.mark.once
def test_a_limp_robot_falls_and_says_why(engine_name: EngineName) -> None:
    env = make(control_period=0.01, engine=engine_name)
    env.reset(seed=0)
    terminated = truncated = False
    info: dict[str, Any] = {}
    while not (terminated or truncated):
        _, _, terminated, truncated, info = env.step(np.zeros(12))
    assert terminated
    assert fall_reason(info) in ("tilt", "height")
    assert info["time_s"] < 2.0


def test_the_walk_ends_with_truncation_and_then_needs_a_reset() -> None:
    env = make(duration=0.5, control_period=0.01)
    with pytest.raises(gym.error.ResetNeeded):
        env.unwrapped.step(np.zeros(12))
    trajectory(env, seed=0, steps=49)
    _, _, terminated, truncated, info = env.step(env.unwrapped._tau)
    assert (terminated, truncated) == (False, True)
    assert info["time_s"] == pytest.approx(0.5)
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(12))


def test_observations_share_no_memory_and_stay_in_bounds(engine_name: EngineName) -> None:
    env = make(engine=engine_name)
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second, *_ = env.step(env.unwrapped._tau)
    assert not np.shares_memory(first, second)
    assert np.array_equal(first, kept)
    path = trajectory(env, seed=0, steps=500)
    assert np.all((path >= env.observation_space.low) & (path <= env.observation_space.high))


@pytest.mark.once
@pytest.mark.parametrize("kwargs", [{"speed": 0.2}, {"actuator_inertia": "lumped"}, {"arms": "revolute"}])
def test_variants_walk(engine_name: EngineName, kwargs: dict[str, Any]) -> None:
    env = make(**kwargs, engine=engine_name)
    path = trajectory(env, seed=0, steps=5999)
    fields = env.unwrapped.observation_layout.split(path)
    assert np.degrees(np.sqrt(((fields["q"] - fields["q_ref"]) ** 2).mean())) < 1.0
    assert np.abs(fields["tilt"]).max() < np.radians(5)
    distance = fields["base_velocity"][:, 0].sum() * 0.001
    assert distance == pytest.approx(kwargs.get("speed", 0.1) * 1.0, abs=0.03)  # two steps, the last one closes


@pytest.mark.once
def test_without_rotor_inertia_tde_diverges(engine_name: EngineName) -> None:
    env = make(actuator_inertia="none", engine=engine_name)
    policy, state = controllers.make("tde", env), None
    observation, _ = env.reset(seed=0)
    terminated = truncated = False
    info: dict[str, Any] = {}
    while not (terminated or truncated):
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        assert np.isfinite(observation).all()
    assert terminated
    assert info["time_s"] < 2.0


def test_render_shows_the_robot(drawing_engine: EngineName) -> None:
    """Dark feet on the ground, a blue torso above them with an orange payload in it, a white sky."""
    env = make(duration=1.0, render_mode="rgb_array", engine=drawing_engine)
    env.reset(seed=0)
    picture = env.render()
    assert picture.shape == (480, 640, 3)
    assert picture.dtype == np.uint8
    red, blue = picture[..., 0].astype(int), picture[..., 2].astype(int)
    torso, payload = (blue > red + 50) & (blue < 180), red > blue + 80
    feet = (picture.max(axis=-1) < 80) & (abs(np.arange(480)[:, None] - 370) < 40)  # text is below
    (top, middle, bottom), columns = (np.nonzero(part)[0].mean() for part in (torso, payload, feet)), []
    assert abs(top - middle) < 30
    assert bottom > top + 150
    for part, least in ((torso, 4000), (payload, 500), (feet, 1000)):
        assert part.sum() > least
        columns.append(np.nonzero(part)[1].mean())
    assert max(columns) - min(columns) < 40
    assert picture[:50].min() > 240
    env.step(env.unwrapped._tau)
    assert env.render().tobytes() == env.render().tobytes()  # drawing changes nothing
    env.close()
    assert make(duration=1.0, engine=drawing_engine).unwrapped.render() is None


def test_reset_options_replace_disturbances() -> None:
    env = make()
    assert sampled(env, seed=0)["payload"]["mass"] == 1.3
    assert sampled(env, seed=0, options={"disturbances": {"friction": 0.5}}) == {"friction": {"coefficient": 0.5}}
    drawn = sampled(env, seed=0, options={"scenario": "S2"})
    assert drawn["payload"]["mass"] == 1.3
    assert 0.7 <= drawn["friction"]["coefficient"] <= 0.9


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"control_period": 0.0015}, ["control_period", "0.0015", "multiples"]),
        ({"control_period": 0.0}, ["control_period", "0.0"]),
        ({"control_period": float("nan")}, ["control_period", "nan"]),
        ({"control_period": "fast"}, ["control_period", "fast"]),
        ({"actuator_inertia": "heavy"}, ["actuator_inertia", "heavy", "rotor"]),
        ({"arms": "none"}, ["arms", "none", "fixed"]),
        ({"speed": 1.0}, ["speed", "1.0", "0.25"]),
        ({"speed": float("nan")}, ["speed", "nan"]),
        ({"step_duration": 0.1}, ["step_duration", "0.1"]),
        ({"duration": -1.0}, ["duration", "-1.0"]),
        ({"duration": float("inf")}, ["duration", "inf"]),
        ({"engine": "ode"}, ["engine", "ode", "bullet", "mujoco"]),
        ({"render_mode": "human"}, ["render_mode", "human", "rgb_array"]),
        ({"disturbances": {"payload": -1}}, ["payload.mass", "-1"]),
        ({"disturbances": {"payload": float("nan")}}, ["payload.mass", "nan"]),
        ({"disturbances": {"playload": 1}}, ["playload", "payload"]),
        ({"disturbances": {"wind": 1.0}}, ["wind", "ojas", "friction"]),
        ({"disturbances": 3}, ["disturbances", "3"]),
    ],
)
def test_bad_arguments_name_field_value_and_what_is_allowed(kwargs: dict[str, Any], words: list[str]) -> None:
    from artde_gym.envs.biped_walk import BipedWalkPayloadEnv

    with pytest.raises(ArtdeGymError) as caught:
        BipedWalkPayloadEnv(**kwargs)
    message = str(caught.value)
    assert "allowed" in message
    for word in words:
        assert word in message


def test_bad_options_and_actions() -> None:
    env = make(duration=1.0).unwrapped
    with pytest.raises(OptionError, match="'speed'"):
        env.reset(options={"speed": 0.2})
    with pytest.raises(DisturbanceError, match="payload"):
        env.reset(options={"disturbances": {"payload": "heavy"}})
    with pytest.raises(UnknownNameError, match="S2"):
        env.reset(options={"scenario": "S22"})
    observation, _ = env.reset(seed=0)
    for action in (np.zeros(11), np.zeros((1, 12)), 3.0):
        with pytest.raises(ActionError, match="shape"):
            env.step(action)
    for value in (np.nan, np.inf):
        with pytest.raises(ActionError, match="finite"):
            env.step(np.full(12, value))
    # a refused action changes nothing
    assert np.array_equal(env._measure(), observation)


def test_closing_twice_is_safe(engine_name: EngineName) -> None:
    env = make(duration=1.0, engine=engine_name)
    env.reset(seed=0)
    env.close()
    env.close()


def test_version() -> None:
    assert artde_gym.__version__
