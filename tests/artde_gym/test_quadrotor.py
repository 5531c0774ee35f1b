"""`QuadInfinity-Payload-v0`, one vehicle, from outside: Gymnasium's contract, determinism, ends and refusals."""

from __future__ import annotations

import multiprocessing
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from artde_gym.disturbances.schedule import EVENTS
from artde_gym.errors import ActionError, ArtdeGymError, DisturbanceError, OptionError, UnknownNameError
from artde_gym.info import fall_reason
from artde_gym.robots.q450.infinity import START, infinity_path
from artde_gym.robots.q450.task import REWARD_SCALES

ID = "QuadInfinity-Payload-v0"
WEIGHT = 1.48 * 9.81
HOVER = np.array([WEIGHT, 0.0, 0.0, 0.0])
Pilot = Callable[[np.ndarray], np.ndarray]

VARIED: dict[str, Any] = {
    "payload": {"mass": {"uniform": [0.1, 0.4]}, "detach_time": 1.0},
    "wind": {"uniform": [0.5, 2.0]},
    "ground_effect": 1.0,
    "push": [{"magnitude": {"uniform": [0.5, 2]}, "start": 0.5, "duration": 0.1}],
    "sensor_noise": {"position": 0.001, "tilt": 0.002},
}


def make(**kwargs: Any) -> Any:
    return gym.make(ID, disable_env_checker=True, **kwargs)


def sampled(env: Any, **kwargs: Any) -> Any:
    """Reset, and tell what was sampled."""
    env.reset(**kwargs)
    return env.unwrapped.sampled_disturbances


def trajectory(
    env: Any, pilot: Pilot, seed: int, steps: int = 100, options: dict[str, Any] | None = None
) -> np.ndarray:
    observation, _ = env.reset(seed=seed, options=options)
    observations = [observation]
    for _ in range(steps):
        observation, *_ = env.step(pilot(observation))
        observations.append(observation)
    return np.array(observations)


@pytest.mark.parametrize("kwargs", [{}, {"measurement": "mocap", "control_period": 0.005, "disturbances": VARIED}])
def test_gymnasium_checker_passes(kwargs: dict[str, Any]) -> None:
    env = gym.make(ID, render_mode="rgb_array", **kwargs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".* can never happen")
        # wrenches are in N and Nm by design; RescaleAction gives [-1, 1]
        warnings.filterwarnings("ignore", message=".*recommend using a symmetric and normalized space")
        check_env(env.unwrapped)
    env.close()


def test_spec_survives_json() -> None:
    env = make(disturbances=VARIED, control_period=0.01, measurement="mocap")
    again: Any = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.control_period == 0.01
    assert again.unwrapped.measurement == "mocap"
    first, second = (sampled(each, seed=3) for each in (env, again))
    assert first == second


def test_same_seed_same_bits_in_one_process(pilot: Pilot) -> None:
    env, other = make(disturbances=VARIED), make(disturbances=VARIED)
    first = trajectory(env, pilot, seed=1)
    trajectory(env, pilot, seed=2, steps=30)
    trajectory(env, pilot, seed=3, steps=30, options={"disturbances": {}})
    again = trajectory(env, pilot, seed=1, options={"disturbances": VARIED})
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() == trajectory(other, pilot, seed=1).tobytes()
    assert first.tobytes() != trajectory(env, pilot, seed=2).tobytes()


def _elsewhere(pilot: Pilot) -> bytes:
    env = make(disturbances=VARIED, measurement="mocap")
    return trajectory(env, pilot, seed=1).tobytes()


def _elsewhere_open_loop(_: int) -> bytes:
    return _elsewhere(lambda observation: np.array([17.0, 0.001, -0.03, 0.0]) + 0.01 * observation[:4])


def test_same_seed_same_bits_in_another_process() -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        (there,) = pool.map(_elsewhere_open_loop, [0])
    assert _elsewhere_open_loop(0) == there


def test_two_environments_in_one_process_do_not_touch_each_other(pilot: Pilot) -> None:
    alone = trajectory(make(disturbances=VARIED), pilot, seed=5)
    env, disturber = make(disturbances=VARIED), make(disturbances={"payload": 3.0}, control_period=0.01)
    rng = np.random.default_rng(0)
    observation, _ = env.reset(seed=5)
    disturber.reset(seed=6)
    together = [observation]
    for step in range(100):
        observation, *_ = env.step(pilot(observation))
        together.append(observation)
        terminated = disturber.step(rng.uniform(disturber.action_space.low, disturber.action_space.high))[2]
        if terminated or step == 50:
            disturber.reset()
    disturber.close()
    assert alone.tobytes() == np.array(together).tobytes()


def test_async_vector_env_with_spawn(pilot: Pilot) -> None:
    envs: Any = gym.make_vec(
        ID, num_envs=2, vectorization_mode="async", vector_kwargs={"context": "spawn"}, disturbances=VARIED
    )
    observations, _ = envs.reset(seed=[1, 2])
    for _ in range(20):
        observations, *_ = envs.step(np.array([pilot(observation) for observation in observations]))
    envs.close()
    assert observations[1].tobytes() == trajectory(make(disturbances=VARIED), pilot, seed=2, steps=20)[-1].tobytes()


def test_nothing_jumps_at_the_start() -> None:
    env = make()
    observation, _ = env.reset(seed=0)
    fields = env.unwrapped.observation_layout.split(observation)
    assert np.array_equal(fields["velocity"], np.zeros(3))
    assert np.array_equal(fields["body_rates"], np.zeros(3))
    # ground effect included: what the rotors give is a little less than the weight
    assert fields["wrench_applied"][0] == pytest.approx((1.48 + 0.35) * 9.81, rel=0.01)
    np.testing.assert_allclose(fields["wrench_applied"][1:], [0.0, -0.01 * 0.35 * 9.81, 0.0], rtol=0.01, atol=1e-12)
    after = env.unwrapped.observation_layout.split(env.step(fields["wrench_applied"])[0])
    np.testing.assert_allclose(after["wrench_applied"], fields["wrench_applied"], rtol=1e-9, atol=1e-12)
    assert np.abs(after["velocity"]).max() < 2e-3  # of the wind, calm at first
    assert np.abs(after["body_rates"]).max() < 2e-3


@pytest.mark.once
def test_the_whole_flight(pilot: Pilot) -> None:
    """Two loops and the drop under an independent controller: references, times, bounds, events, truncation."""
    env = make()
    plant = env.unwrapped
    observation, _ = env.reset(seed=0)
    observations, told, total = [observation], [], 0.0
    terminated = truncated = False
    info: dict[str, Any] = {}
    while not (terminated or truncated):
        observation, reward, terminated, truncated, info = env.step(pilot(observation))
        observations.append(observation)
        total += reward
        told += [(info["time_s"], name) for name in EVENTS if info[name]]
    assert (terminated, truncated) == (False, True)
    assert info["time_s"] == pytest.approx(69.99)
    assert told == [(pytest.approx(35.01), "payload_dropped")]
    assert 150 < total < 280
    flown = np.array(observations)
    assert np.all((flown >= env.observation_space.low) & (flown <= env.observation_space.high))
    fields = plant.observation_layout.split(flown)
    path = infinity_path(70.0, 0.015)
    for name in ("position", "velocity", "acceleration", "jerk"):
        assert np.array_equal(fields[f"{name}_ref"], getattr(path, name))
    np.testing.assert_allclose(fields["phase"][:, 0], 0.015 * np.arange(len(flown)) / 70.0, atol=1e-12)
    error = np.abs(fields["position"] - fields["position_ref"])
    assert error.max() < 0.6  # the load is a third of the weight that a plain PD expects
    rest = error[round(34.0 / 0.015) : round(35.0 / 0.015), 2]
    sag = 0.35 * 9.81 / (5.0 * 1.48)  # under the load: its proportional gain is 5 / s^2
    assert 0.8 * sag < rest.mean() < sag  # a little less near the ground
    with pytest.raises(gym.error.ResetNeeded):
        env.unwrapped.step(HOVER)


@pytest.mark.parametrize(
    ("action", "reason"),
    [
        ([0.0, 0.0, 0.0, 0.0], "ground"),
        ([WEIGHT, 0.3, 0.0, 0.0], "inverted"),
        ([30.0, 0.0, 0.0, 0.0], "bounds"),
        ([WEIGHT, 0.0, 0.0, 0.25], "bounds"),
    ],
    ids=["falls", "flips", "leaves", "spins"],
)
def test_crashes_end_the_flight_and_say_why(action: list[float], reason: str) -> None:
    env = make(disturbances={})
    env.reset(seed=0)
    terminated = truncated = False
    info: dict[str, Any] = {}
    while not (terminated or truncated):
        _, _, terminated, truncated, info = env.step(np.array(action))
    assert terminated
    assert fall_reason(info) == reason
    assert info["time_s"] < 4.0
    with pytest.raises(gym.error.ResetNeeded):
        env.unwrapped.step(HOVER)
    env.reset(seed=0)
    env.step(HOVER)


def test_reward_is_the_scaled_sum_of_its_terms() -> None:
    env = make(disturbances={"motor_lag": 0.0}, control_period=0.02)
    before, _ = env.reset(seed=0)
    observation, reward, _, _, info = env.step(HOVER + np.array([3.0, 0.01, 0.0, 0.0]))
    now, then = (env.unwrapped.observation_layout.split(each) for each in (observation, before))
    terms = {name.removeprefix("reward_"): value for name, value in info.items() if name.startswith("reward_")}
    assert list(terms) == list(REWARD_SCALES)
    assert reward == pytest.approx(0.02 * sum(REWARD_SCALES[name] * value for name, value in terms.items()))
    error, rate = now["position_ref"] - now["position"], now["velocity_ref"] - now["velocity"]
    change = now["rotor_thrust"] - then["rotor_thrust"]
    expected = {
        "alive": 1.0,
        "position": np.exp(-error @ error / 0.01),
        "velocity": np.exp(-rate @ rate / 0.05),
        "upright": now["rot_body_to_world"][8],
        "effort": np.mean((now["rotor_thrust"] / 8.5) ** 2),
        "smoothness": np.mean((change / 8.5) ** 2),
    }
    assert terms == pytest.approx(expected, rel=1e-12)
    assert all(type(value) is float for value in terms.values())


def test_observations_share_no_memory() -> None:
    env = make()
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second, *_ = env.step(HOVER)
    assert not np.shares_memory(first, second)
    assert np.array_equal(first, kept)


def test_saturation_is_what_the_observation_reports() -> None:
    env = make(disturbances={"motor_lag": 0.0})
    env.reset(seed=0)
    observation, *_ = env.step(np.array([100.0, 0.0, 0.0, 0.0]))
    applied = observation[env.unwrapped.observation_layout["wrench_applied"]]
    np.testing.assert_allclose(applied, [34.0, 0.0, 0.0, 0.0], atol=1e-12)
    assert env.observation_space.contains(observation)


def test_render_shows_the_vehicle_and_follows_it_half_way() -> None:
    """A dark vehicle near the middle of the picture; one that starts elsewhere is half as far from there."""
    env = make(render_mode="rgb_array", disturbances={})

    def seen(offset: list[float]) -> np.ndarray:
        env.reset(seed=0, options={"disturbances": {"initial_position": {"offset": offset}}})
        picture = env.render().astype(int)
        assert picture.shape == (480, 640, 3)
        rows, columns = np.nonzero(picture[:380].max(axis=-1) < 90)  # text is below
        assert len(rows) > 2000
        return np.array([columns.mean(), rows.mean()])

    middle, moved = seen([0.0, 0.0, 0.0]), seen([0.3, 0.0, 0.0])
    camera = env.unwrapped.view.following((0.0, 0.0, 0.6))
    x, y, z = START
    right = camera.pixels([(x + 0.3, y, z)]) - camera.pixels([(x, y, z)])
    np.testing.assert_allclose(moved - middle, right[0] / 2, atol=8)
    env.close()
    assert make().unwrapped.render() is None


def test_reset_options_replace_disturbances() -> None:
    env = make()
    default = sampled(env, seed=0)
    assert default["payload"]["mass"] == 0.35
    assert default["payload"]["detach_time"] == 35.0
    assert default.keys() == {"payload", "wind", "ground_effect"}
    calm = sampled(env, seed=0, options={"disturbances": {"payload": 0.2}})
    assert calm.keys() == {"payload"}
    assert calm["payload"]["position"] == [0.01, 0.0, -0.1]
    assert sampled(env) == calm
    assert "wind" in sampled(env, seed=0, options={"scenario": "Q1"})


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"control_period": 0.001}, ["control_period", "0.001", "0.005"]),
        ({"control_period": 0.0}, ["control_period", "0.0"]),
        ({"control_period": 0.055}, ["control_period", "0.055"]),
        ({"control_period": float("nan")}, ["control_period", "nan"]),
        ({"control_period": "fast"}, ["control_period", "fast"]),
        ({"measurement": "gps"}, ["measurement", "gps", "mocap"]),
        ({"duration": 0.0}, ["duration", "0.0"]),
        ({"duration": float("inf")}, ["duration", "inf"]),
        ({"engine": "ode"}, ["engine", "ode", "bullet"]),
        ({"render_mode": "human"}, ["render_mode", "human", "rgb_array"]),
        ({"disturbances": {"payload": -1}}, ["payload.mass", "-1"]),
        ({"disturbances": {"wind": float("nan")}}, ["wind.scale", "nan"]),
        ({"disturbances": {"friction": 0.5}}, ["friction", "q450", "wind", "ground_effect"]),
        ({"disturbances": {"push": {"magnitude": 1, "start": 0, "body": "torso"}}}, ["torso", "body", "rear_left"]),
        ({"disturbances": {"actuator_effectiveness": {"joint": "left_knee"}}}, ["left_knee", "front_right", "all"]),
        ({"disturbances": 3}, ["disturbances", "3"]),
    ],
)
def test_bad_arguments_name_field_value_and_what_is_allowed(kwargs: dict[str, Any], words: list[str]) -> None:
    from artde_gym.envs.quadrotor import QuadInfinityPayloadEnv

    with pytest.raises(ArtdeGymError) as caught:
        QuadInfinityPayloadEnv(**kwargs)
    message = str(caught.value)
    assert "allowed" in message
    for word in words:
        assert word in message


def test_bad_options_and_actions_change_nothing() -> None:
    env = make(disturbances={}).unwrapped
    with pytest.raises(gym.error.ResetNeeded):
        env.step(HOVER)
    with pytest.raises(OptionError, match="'speed'"):
        env.reset(options={"speed": 0.2})
    with pytest.raises(DisturbanceError, match="slope"):
        env.reset(options={"disturbances": {"slope": 3.0}})
    with pytest.raises(UnknownNameError, match="Q11"):
        env.reset(options={"scenario": "Q11"})
    env.reset(seed=0)
    for action in (np.zeros(3), np.zeros((1, 4)), 3.0):
        with pytest.raises(ActionError, match="shape"):
            env.step(action)
    for value in (np.nan, np.inf, -np.inf):
        with pytest.raises(ActionError, match="finite"):
            env.step(np.array([WEIGHT, value, 0.0, 0.0]))
    observation, *_ = env.step(HOVER)
    other = make(disturbances={}).unwrapped
    other.reset(seed=0)
    assert np.array_equal(other.step(HOVER)[0], observation)


def test_closing_twice_is_safe() -> None:
    env = make()
    env.reset(seed=0)
    env.close()
    env.close()


def test_docstring_is_the_documentation() -> None:
    from artde_gym.envs.quadrotor import QuadInfinityPayloadEnv
    from artde_gym.envs.quadrotor_vector import QuadInfinityPayloadVectorEnv

    for page in (QuadInfinityPayloadEnv.__doc__, QuadInfinityPayloadVectorEnv.__doc__):
        assert page is not None
        for words in ("## Action", "## Observation", "## Reward", "## End", "## Arguments", "## Versions", "`wrench`"):
            assert words in page
        for field in QuadInfinityPayloadEnv.observation_layout.fields:
            assert f"`{field.name}`" in page
        for term in REWARD_SCALES:
            assert f"`{term}`" in page
        assert "{" not in page.replace("{}", "").replace('{"', "")
