"""`QuadInfinity-Payload-v0`, many vehicles at once: each as if alone, and Gymnasium's conventions of vectors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

from artde_gym.envs import quadrotor_vector
from artde_gym.errors import ActionError, ArtdeGymError, OptionError

ID = "QuadInfinity-Payload-v0"
WEIGHT = 1.48 * 9.81
Pilot = Callable[[np.ndarray], np.ndarray]

VARIED: dict[str, Any] = {
    "payload": {
        "mass": {"uniform": [0.1, 0.4]},
        "detach_time": {"uniform": [0.3, 0.9]},
        "attach_time": {"choice": [0.0, 0.1]},
    },
    "wind": {"choice": [0.0, 1.0, 3.0]},
    "ground_effect": {"choice": [0.0, 5.0]},
    "push": [
        {"body": "front_left", "magnitude": {"uniform": [0.0, 2.0]}, "start": {"uniform": [0.1, 0.5]}, "duration": 0.1},
        {"magnitude": {"choice": [0.0, 1.0]}, "direction": [0, 1, 1], "start": 0.31, "duration": 0.0333},
    ],
    "sensor_noise": {"position": {"choice": [0.0, 0.001]}, "tilt": {"choice": [0.0, 0.002]}},
    "action_delay": {"choice": [0, 1, 2]},
    "motor_lag": {"choice": [0.0, 0.035, 0.05]},
    "actuator_effectiveness": [{"joint": "all", "factor": {"uniform": [0.9, 1.0]}, "start": 0.4}],
    "mass_scale": {"uniform": [0.9, 1.1]},
    "initial_position": {"offset": [{"normal": [0.0, 0.02]}, {"normal": [0.0, 0.02]}, 0.0]},
}


def make(num_envs: int, **kwargs: Any) -> Any:
    return gym.make_vec(ID, num_envs=num_envs, vectorization_mode="vector_entry_point", **{"engine": "numpy", **kwargs})


def sampled(env: Any, **kwargs: Any) -> Any:
    """Reset, and tell what was sampled."""
    env.reset(**kwargs)
    return env.unwrapped.sampled_disturbances


def single(**kwargs: Any) -> Any:
    return gym.make(ID, disable_env_checker=True, **kwargs).unwrapped


def actions_of(pilot: Pilot, observations: np.ndarray) -> np.ndarray:
    """The pilot's actions one by one: its own arithmetic may depend on the size of a batch."""
    return np.array([pilot(np.ascontiguousarray(observation)) for observation in observations])


def flown(env: Any, pilot: Pilot, seed: Any, steps: int) -> list[tuple[bytes, ...]]:
    """What each environment saw: observations, rewards, ends, and drawn disturbances."""
    observations, _ = env.reset(seed=seed)
    drawn = [repr(one).encode() for one in env.sampled_disturbances]
    seen = [(observation.tobytes(), one) for observation, one in zip(observations, drawn, strict=True)]
    logs = [list(first) for first in seen]
    for _ in range(steps):
        observations, rewards, terminated, truncated, info = env.step(actions_of(pilot, observations))
        for i, log in enumerate(logs):
            told = b"".join(values[i].tobytes() for _, values in sorted(info.items()))
            log += [observations[i].tobytes(), rewards[i].tobytes(), told]
            log += [terminated[i].tobytes(), truncated[i].tobytes()]
    return [tuple(log) for log in logs]


# ----------------------------------------------------------------------------------------------------- each as if alone


@pytest.mark.once
@pytest.mark.parametrize("kwargs", [{}, {"dtype": "float32"}, {"measurement": "mocap", "control_period": 0.01}])
def test_batch_is_loop_to_the_bit(kwargs: dict[str, Any], pilot: Pilot, monkeypatch: pytest.MonkeyPatch) -> None:
    seeds, steps = [11, 5, 7, 3, 2, 13, 17], 60
    arguments = {"disturbances": VARIED, "duration": 0.8, **kwargs}  # flights end meanwhile, and begin anew
    loop = [flown(make(1, **arguments), pilot, [seed], steps)[0] for seed in seeds]
    together = flown(make(7, **arguments), pilot, seeds, steps)
    assert together == loop
    monkeypatch.setattr(quadrotor_vector, "FLEET", 3)  # simulated in fleets of 3, 3 and 1
    assert flown(make(7, **arguments), pilot, seeds, steps) == loop


@pytest.mark.once
def test_another_size_of_arrays_is_the_same_to_the_bit(pilot: Pilot) -> None:
    """Vector instructions treat the end of an array differently: sizes around their width."""
    few, many = make(5, disturbances=VARIED), make(133, disturbances=VARIED)
    first, second = few.reset(seed=0)[0], many.reset(seed=0)[0]
    for _ in range(40):
        first = few.step(actions_of(pilot, first))[0]
        second = many.step(np.concatenate([actions_of(pilot, second[:5]), np.tile([WEIGHT, 0, 0, 0], (128, 1))]))[0]
        assert first.tobytes() == second[:5].tobytes()


def test_seeds_draw_what_they_draw_for_one_environment() -> None:
    env, alone = make(3, disturbances=VARIED), single(disturbances=VARIED)
    for seeds in (4, [9, 4, 1]):
        observations, _ = env.reset(seed=seeds)
        expected = [4, 5, 6] if seeds == 4 else seeds
        for i, seed in enumerate(expected):
            observation, _ = alone.reset(seed=seed)
            assert env.sampled_disturbances[i] == alone.sampled_disturbances
            np.testing.assert_allclose(observations[i], observation, rtol=0, atol=1e-12)
        assert list(env.np_random_seed) == expected
    assert len(env.np_random) == 3


def test_generators_go_on_without_a_seed_as_those_of_one_environment() -> None:
    env, alone = make(2, disturbances=VARIED), single(disturbances=VARIED)
    first = sampled(env, seed=[1, 2])
    second = sampled(env)
    assert second[1] != first[1]
    alone.reset(seed=2)
    assert sampled(alone) == second[1]
    again = sampled(env, seed=[None, 2])
    assert again[1] == first[1]
    assert again[0] not in (first[0], second[0])


@pytest.mark.once
def test_float32_flies_nearly_the_same(pilot: Pilot) -> None:
    double, half = make(4, disturbances=VARIED), make(4, disturbances=VARIED, dtype="float32")
    a, b = double.reset(seed=0)[0], half.reset(seed=0)[0]
    assert b.dtype == half.single_observation_space.dtype == half.single_action_space.dtype == np.float32
    for _ in range(66):
        a, *_ = double.step(pilot(a))
        b, rewards, _, _, info = half.step(pilot(b))
        assert b.dtype == np.float32
        assert rewards.dtype == np.float64
        assert all(values.dtype == np.float32 for name, values in info.items() if name.startswith("reward_"))
    np.testing.assert_allclose(b[:, :3], a[:, :3], rtol=0, atol=1e-4)
    for _, fleet in half._fleets:
        arrays = [value for value in {**vars(fleet), **vars(fleet.bodies)}.values() if isinstance(value, np.ndarray)]
        assert all(array.dtype in (np.float32, np.int64, np.uint64, np.bool_) for array in arrays)


def test_observations_are_new_arrays_with_contiguous_components() -> None:
    env = make(6)
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second, *_ = env.step(np.tile([17.9, 0.0, -0.03, 0.0], (6, 1)))
    third, *_ = env.step(np.asfortranarray(np.tile([17.9, 0.0, -0.03, 0.0], (6, 1))))
    assert first.shape == (6, 41) == env.observation_space.shape
    assert first.T.flags.c_contiguous
    assert not any(np.shares_memory(a, b) for a, b in ((first, second), (second, third), (first, third)))
    assert np.array_equal(first, kept)
    assert env.observation_space.contains(second)


# --------------------------------------------------------------------------------------------- Gymnasium's conventions


def test_it_is_made_by_the_vector_entry_point() -> None:
    env: Any = make(4096, dtype="float32")
    assert isinstance(env, quadrotor_vector.QuadInfinityPayloadVectorEnv)
    assert env.num_envs == 4096
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.spec is not None
    assert env.spec.id == ID
    alone = single()
    assert env.single_observation_space == alone.observation_layout.box(np.dtype("float32"))
    assert make(2).single_observation_space == alone.observation_space
    assert make(2).single_action_space == alone.action_space
    for name in (
        "robot_name",
        "control_period",
        "nominal_robot",
        "observation_layout",
        "action_layout",
        "metrics_spec",
    ):
        assert env.get_attr(name) == (getattr(alone, name),) * 4096
    env.close()


def test_spec_survives_json() -> None:
    env: Any = make(3, disturbances=VARIED, dtype="float32", measurement="mocap")
    again: Any = gym.make_vec(EnvSpec.from_json(env.spec.to_json()))
    assert (again.num_envs, again.dtype, again.measurement) == (3, np.float32, "mocap")
    first, second = (sampled(each, seed=3) for each in (env, again))
    assert first == second


@pytest.mark.once
def test_same_seed_same_bits_after_other_flights(pilot: Pilot) -> None:
    env = make(3, disturbances=VARIED, duration=0.4)
    first = flown(env, pilot, 1, 40)
    flown(env, pilot, 2, 17)
    assert flown(env, pilot, 1, 40) == first
    assert flown(env, pilot, 2, 40) != first


def test_autoreset_is_that_of_gymnasiums_own_vector(pilot: Pilot) -> None:
    """Beside Gymnasium's `SyncVectorEnv` over single environments: ends, rewards, masks and restarts come alike."""
    disturbances = {"payload": {"mass": {"uniform": [0.1, 0.4]}}, "mass_scale": {"uniform": [0.95, 1.05]}}
    arguments: dict[str, Any] = {"disturbances": disturbances, "duration": 0.6}
    ours = make(3, **arguments)
    theirs: Any = gym.make_vec(ID, num_envs=3, vectorization_mode="sync", **arguments)
    a, b = ours.reset(seed=[1, 2, 3])[0], theirs.reset(seed=[1, 2, 3])[0]
    ends = 0
    for step in range(150):
        actions = pilot(b)
        actions[0] = [0.0, 0.0, 0.0, 0.0]  # falls to the ground
        if step == 100:
            actions[1] = [0.0, 2.7, 0.0, 0.0]
        a, rewards, terminated, truncated, info = ours.step(actions)
        b, their_rewards, their_terminated, their_truncated, their_info = theirs.step(actions)
        np.testing.assert_allclose(a, b, rtol=0, atol=0.02)
        np.testing.assert_allclose(rewards, their_rewards, rtol=0, atol=1e-3)
        assert np.array_equal(terminated, their_terminated)
        assert np.array_equal(truncated, their_truncated)
        assert info["time_s"] == pytest.approx(their_info["time_s"])
        assert np.array_equal(info["_time_s"], their_info["_time_s"])
        assert info.keys() == their_info.keys()
        for name, values in info.items():
            assert values.dtype == their_info[name].dtype
            np.testing.assert_allclose(values, their_info[name], rtol=0, atol=5e-3)
        ends += int((terminated | truncated).sum())
    assert ends > 8
    theirs.close()


@pytest.mark.once
def test_others_do_not_notice_a_crash(pilot: Pilot) -> None:
    calm, crashing = make(3), make(3)
    a, b = calm.reset(seed=0)[0], crashing.reset(seed=0)[0]
    crashes = 0
    for _ in range(120):
        actions = actions_of(pilot, b)
        actions[1] = [34.0, 2.7, -2.7, 0.27]
        a = calm.step(actions_of(pilot, a))[0]
        b, _, terminated, _, _ = crashing.step(actions)
        crashes += terminated[1]
        assert a[[0, 2]].tobytes() == b[[0, 2]].tobytes()
    assert crashes > 2


def test_actions_of_finished_flights_are_ignored() -> None:
    env = make(2, duration=0.15, disturbances={})
    env.reset(seed=0)
    hover = np.tile([WEIGHT, 0.0, 0.0, 0.0], (2, 1))
    for _ in range(9):
        assert not env.step(hover)[3].any()
    assert env.step(hover)[3].all()
    observations, rewards, terminated, truncated, info = env.step(np.full((2, 4), np.nan))
    assert not (terminated | truncated).any()
    assert np.array_equal(rewards, [0.0, 0.0])
    assert np.array_equal(info["time_s"], [0.0, 0.0])
    np.testing.assert_allclose(observations[:, :3], [[0.0, 0.0, 0.6]] * 2, atol=1e-12)
    assert np.array_equal(observations[:, 40], [0.0, 0.0])
    with pytest.raises(ActionError, match="environment 1"):
        env.step(np.array([[WEIGHT, 0, 0, 0], [WEIGHT, np.nan, 0, 0]]))


@pytest.mark.parametrize("measurement", ["ideal", "mocap"])
def test_reset_mask_resets_some(pilot: Pilot, measurement: str) -> None:
    env, other = (make(3, disturbances=VARIED, measurement=measurement) for _ in range(2))
    a, b = env.reset(seed=0)[0], other.reset(seed=0)[0]
    for _ in range(10):
        a, b = env.step(actions_of(pilot, a))[0], other.step(actions_of(pilot, b))[0]
    mask = np.array([False, True, False])
    options = {"reset_mask": mask}
    a, info = env.reset(seed=[5, 6, 7], options=options)
    assert options == {"reset_mask": mask}
    assert all(np.array_equal(values, mask) for name, values in info.items() if name[0] == "_")
    alone = single(disturbances=VARIED, measurement=measurement)
    fresh, _ = alone.reset(seed=6)
    assert env.sampled_disturbances[1] == alone.sampled_disturbances
    np.testing.assert_allclose(a[1], fresh, rtol=0, atol=1e-12)
    assert a[[0, 2]].tobytes() == b[[0, 2]].tobytes()
    for _ in range(20):
        a, b = env.step(actions_of(pilot, a))[0], other.step(actions_of(pilot, b))[0]
        assert a[[0, 2]].tobytes() == b[[0, 2]].tobytes()
    assert np.array_equal(a[:, 40] < b[:, 40], mask)


def test_reset_may_change_disturbances() -> None:
    env = make(2, disturbances={})
    assert sampled(env, seed=0) == [{}, {}]
    drawn = env.reset(options={"disturbances": {"payload": 0.2, "push": [{"magnitude": 1, "start": 0.0}]}})[1]
    assert drawn["disturbance.payload.mass"].tolist() == [0.2, 0.2]
    info = env.step(np.tile([WEIGHT, 0, 0, 0], (2, 1)))[4]
    assert info["push_begins"].tolist() == [1, 1]
    named = env.reset(seed=0, options={"scenario": "Q1"})[1]
    assert "disturbance.wind.scale" in named
    assert "disturbance.push.magnitude" not in named


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"num_envs": 0}, ["num_envs", "0", ">= 1"]),
        ({"num_envs": 2.5}, ["num_envs", "2.5"]),
        ({"num_envs": 1, "dtype": "float16"}, ["dtype", "float16", "float32"]),
        ({"num_envs": 1, "control_period": 0.001}, ["control_period", "0.001"]),
        ({"num_envs": 1, "measurement": "gps"}, ["measurement", "gps", "ideal"]),
        ({"num_envs": 1, "duration": -1.0}, ["duration", "-1.0"]),
        ({"num_envs": 1, "disturbances": {"grf_pulse": 3.0}}, ["grf_pulse", "q450", "payload"]),
    ],
)
def test_bad_arguments_name_field_value_and_what_is_allowed(kwargs: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(ArtdeGymError) as caught:
        quadrotor_vector.QuadInfinityPayloadVectorEnv(**{"engine": "numpy", **kwargs})
    for word in (*words, "allowed"):
        assert word in str(caught.value)


def test_bad_resets_and_steps() -> None:
    env = make(2, disturbances={})
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros((2, 4)))
    with pytest.raises(OptionError, match=r"seed is \[1, 2, 3\]"):
        env.reset(seed=[1, 2, 3])
    with pytest.raises(OptionError, match="reset_mask"):
        env.reset(options={"reset_mask": np.array([True, False])})  # the other one has never begun
    env.reset(seed=0)
    for mask in (np.array([True]), [1, 0], np.zeros(2, np.bool_)):
        with pytest.raises(OptionError, match="reset_mask"):
            env.reset(options={"reset_mask": mask})
    with pytest.raises(OptionError, match="speed"):
        env.reset(options={"speed": 1})
    for actions in (np.zeros(4), np.zeros((3, 4)), np.zeros((2, 3))):
        with pytest.raises(ActionError, match="shape"):
            env.step(actions)
    other = make(2, disturbances={})
    other.reset(seed=0)
    hover = np.tile([WEIGHT, 0.0, 0.0, 0.0], (2, 1))
    assert env.step(hover)[0].tobytes() == other.step(hover)[0].tobytes()  # refusals change nothing


@pytest.mark.once
def test_two_vectors_in_one_process_do_not_touch_each_other(pilot: Pilot) -> None:
    alone = flown(make(2, disturbances=VARIED), pilot, 3, 20)
    env, disturber = make(2, disturbances=VARIED), make(5, disturbances={}, control_period=0.03)
    disturber.reset(seed=1)
    step = env.step

    def disturbed(actions: np.ndarray) -> Any:
        disturber.step(np.full((5, 4), 1.0))
        return step(actions)

    env.step = disturbed
    assert flown(env, pilot, 3, 20) == alone
