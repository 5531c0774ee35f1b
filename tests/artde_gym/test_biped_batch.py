"""Many bipeds at once in MuJoCo: each as the single one to the bit, and Gymnasium's conventions of vectors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

import controllers
from artde_gym.envs.biped_push import BipedPushVectorEnv
from artde_gym.errors import ActionError, ArtdeGymError, OptionError

ID = "BipedPush-v0"
ALL_AROUND = [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0]
PUSHED: dict[str, Any] = {
    "payload": {"mass": {"uniform": [0.5, 1.5]}},
    "friction": {"uniform": [0.7, 0.9]},
    "mass_scale": {"uniform": [0.95, 1.05]},
    "push": [{"body": "chest", "magnitude": {"uniform": [5, 30]}, "direction": ALL_AROUND, "start": 0.03}],
}
VARIED: dict[str, Any] = {
    "payload": {
        "mass": {"uniform": [0.3, 1.5]},
        "attach_time": {"choice": [0.0, 0.02]},
        "detach_time": {"choice": [0.01, 0.05, 1e9]},
    },
    "push": [
        {"body": "chest", "magnitude": {"uniform": [5, 40]}, "start": {"uniform": [0.0, 0.05]}, "duration": 0.02},
        {"body": "left_arm", "magnitude": {"choice": [0.0, 20.0]}, "direction": [0, -1, -1], "start": 0.013},
    ],
    "grf_pulse": {"magnitude": {"choice": [0.0, 40.0]}},
    "friction": {"uniform": [0.6, 0.9]},
    "slope": {"pitch_deg": {"uniform": [-1, 1]}, "roll_deg": {"uniform": [-1, 1]}},
    "sensor_noise": {"position": {"choice": [0.0, 1e-5]}, "tilt": 1e-3},
    "encoder_bits": {"choice": [16, 20]},
    "action_delay": {"choice": [0, 1]},
    "motor_lag": {"choice": [0.0, 0.002]},
    "actuator_effectiveness": [{"joint": "left_knee", "factor": 0.9, "start": {"uniform": [0.0, 0.1]}}],
    "mass_scale": {"uniform": [0.9, 1.1]},
    "initial_pose": [{"joint": "all", "offset": {"normal": [0.0, 0.002]}}],
}


def make(num_envs: int, **kwargs: Any) -> Any:
    return gym.make_vec(
        ID, num_envs=num_envs, vectorization_mode="vector_entry_point", **{"engine": "mujoco", **kwargs}
    )


def sampled(env: Any, **kwargs: Any) -> Any:
    """Reset, and tell what was sampled."""
    env.reset(**kwargs)
    return env.unwrapped.sampled_disturbances


def single(**kwargs: Any) -> Any:
    return gym.make(ID, disable_env_checker=True, engine="mujoco", **kwargs).unwrapped


def told(info: dict[str, Any], robot: int | None = None) -> dict[str, Any]:
    """All of an info, or of one robot's share in it, to be compared."""
    own = {name: value for name, value in info.items() if name[0] != "_"}
    return {name: np.asarray(value if robot is None else value[robot]).tolist() for name, value in own.items()}


def walked_alone(seed: int, steps: int, law: str = "tde", **kwargs: Any) -> list[Any]:
    """What a single environment says of a walk, restarted as next-step autoreset does."""
    env = single(**kwargs)
    policy, state, start = controllers.make(law, env), None, True
    observation, info = env.reset(seed=seed)
    log: list[Any] = [(observation.tobytes(), told(info), env.sampled_disturbances)]
    over = False
    for _ in range(steps):
        action, state = policy.predict(observation, state, episode_start=start)
        if over:
            observation, info = env.reset()
            over, entry = False, (observation.tobytes(), 0.0, False, False)
        else:
            observation, reward, terminated, truncated, info = env.step(action)
            over = terminated or truncated
            entry = (observation.tobytes(), reward, terminated, truncated)
        start = over
        log.append((*entry, told(info), env.sampled_disturbances))
    env.close()
    return log


def walked_together(env: Any, seeds: Any, steps: int, law: str = "tde") -> list[list[Any]]:
    """The same for each environment of a vector."""
    policy, state, start = controllers.make(law, env), None, None
    observations, info = env.reset(seed=seeds)
    logs: list[list[Any]] = [
        [(own.tobytes(), told(info, i), env.sampled_disturbances[i])] for i, own in enumerate(observations)
    ]
    for _ in range(steps):
        actions, state = policy.predict(observations, state, episode_start=start)
        observations, rewards, terminated, truncated, info = env.step(actions)
        start = terminated | truncated
        for i, log in enumerate(logs):
            ends = bool(terminated[i]), bool(truncated[i])
            own = told(info, i), env.sampled_disturbances[i]
            log.append((observations[i].tobytes(), float(rewards[i]), *ends, *own))
    return logs


# ----------------------------------------------------------------------------------------------- each as the single one


@pytest.mark.once
@pytest.mark.parametrize(
    ("disturbances", "kwargs"),
    [
        ({}, {"duration": 0.1}),
        (None, {"duration": 0.15}),
        (PUSHED, {"duration": 0.15, "self_collision": True, "observe_ground_force": True}),
        (PUSHED, {"duration": 0.2, "control_period": 0.004, "actuator_inertia": "lumped", "arms": "revolute"}),
        (VARIED, {"duration": 0.12}),
        (VARIED, {"duration": 0.16, "control_period": 0.002, "speed": 0.05, "step_duration": 1.2}),
    ],
)
def test_batch_is_single_to_the_bit(disturbances: Any, kwargs: dict[str, Any]) -> None:
    """Observations, rewards, ends, events, and the restarts after them, whatever the order of events beside."""
    seeds, steps = [11, 5, 7], 170
    together = walked_together(make(3, disturbances=disturbances, **kwargs), seeds, steps)
    for seed, log in zip(seeds, together, strict=True):
        assert log == walked_alone(seed, steps, disturbances=disturbances, **kwargs)


@pytest.mark.once
def test_falls_are_those_of_the_single_one() -> None:
    kick = {"body": "chest", "magnitude": {"uniform": [150, 400]}, "direction": ALL_AROUND, "start": 0.0}
    kwargs: dict[str, Any] = {"disturbances": {"push": [kick]}, "duration": 2.0, "control_period": 0.004}
    together = walked_together(make(3, **kwargs), [1, 2, 3], 400, "artde")
    assert sum(entry[2] for log in together for entry in log[1:]) >= 3
    for seed, log in zip([1, 2, 3], together, strict=True):
        assert log == walked_alone(seed, 400, "artde", **kwargs)


@pytest.mark.once
def test_a_robot_that_diverges_ends_as_the_single_one() -> None:
    """Bare links under TDE diverge: through speeds beyond all bounds, without a warning."""
    kwargs: dict[str, Any] = {"disturbances": {}, "actuator_inertia": "none", "control_period": 0.01, "duration": 3.0}
    (log,) = walked_together(make(1, **kwargs), [0], 250)
    assert any(entry[2] for entry in log[1:])
    assert log == walked_alone(0, 250, **kwargs)


@pytest.mark.once
def test_numbers_of_environments_and_threads_do_not_change_a_bit() -> None:
    kwargs: dict[str, Any] = {"disturbances": PUSHED, "duration": 0.1}
    whole = walked_together(make(9, **kwargs), 20, 150)
    assert walked_together(make(9, threads=2, **kwargs), 20, 150) == whole
    assert walked_together(make(4, threads=3, **kwargs), 20, 150) == whole[:4]
    assert walked_together(make(1, **kwargs), [28], 150) == whole[8:]


@pytest.mark.once
def test_same_seed_same_bits_after_other_walks() -> None:
    env = make(2, disturbances=PUSHED, duration=0.1)
    first = walked_together(env, 1, 120)
    walked_together(env, 2, 33)
    env.reset(options={"disturbances": VARIED})
    env.reset(options={"disturbances": PUSHED})
    assert walked_together(env, 1, 120) == first
    assert walked_together(env, 2, 120) != first


def test_generators_go_on_without_a_seed_as_those_of_one_environment() -> None:
    env, alone = make(2, disturbances=PUSHED), single(disturbances=PUSHED)
    first = sampled(env, seed=[1, 2])
    second = sampled(env)
    assert second[1] != first[1]
    alone.reset(seed=2)
    assert sampled(alone) == second[1]
    third = sampled(env, seed=[None, 2])
    assert third[1] == first[1]
    assert third[0] not in (first[0], second[0])
    assert list(env.np_random_seed)[1] == 2


# --------------------------------------------------------------------------------------------- Gymnasium's conventions


def test_it_is_made_by_the_vector_entry_point() -> None:
    env, alone = make(3, observe_ground_force=True), single(observe_ground_force=True)
    assert isinstance(env, BipedPushVectorEnv)
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.single_observation_space == alone.observation_space
    assert env.single_action_space == alone.action_space
    assert env.observation_space.shape == (3, alone.observation_space.shape[0])
    for name in (
        "robot_name",
        "control_period",
        "nominal_robot",
        "observation_layout",
        "action_layout",
        "metrics_spec",
    ):
        assert env.get_attr(name) == (getattr(alone, name),) * 3
    assert make(2, autoreset_mode="Disabled").metadata["autoreset_mode"] is AutoresetMode.DISABLED
    assert "Actions" not in str(BipedPushVectorEnv.__doc__)
    for words in ("{", "}"):
        assert f"{words}shared" not in str(BipedPushVectorEnv.__doc__)
    for word in ("q1..q6", "autoreset_mode", "threads", "reset_mask", "payload of 1.3 kg and the two pushes"):
        assert word in str(BipedPushVectorEnv.__doc__)
    env.close()


def test_spec_survives_json() -> None:
    env: Any = make(3, disturbances=PUSHED, control_period=0.002, threads=2)
    again: Any = gym.make_vec(EnvSpec.from_json(env.spec.to_json()))
    assert (again.num_envs, again.control_period) == (3, 0.002)
    first, second = (sampled(each, seed=3) for each in (env, again))
    assert first == second


def test_observations_are_new_arrays_in_the_space() -> None:
    env = make(4, disturbances={})
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second, *_ = env.step(np.zeros((4, 12)))
    third, *_ = env.step(np.asfortranarray(np.zeros((4, 12))))
    assert not any(np.shares_memory(a, b) for a, b in ((first, second), (second, third), (first, third)))
    assert np.array_equal(first, kept)
    assert env.observation_space.contains(second)


@pytest.mark.once
def test_others_do_not_notice_a_fall() -> None:
    kwargs: dict[str, Any] = {"disturbances": PUSHED, "duration": 2.0, "control_period": 0.002}
    calm, falling = make(3, **kwargs), make(3, **kwargs)
    policy, (a, b) = controllers.make("tde", calm), (calm.reset(seed=0)[0], falling.reset(seed=0)[0])
    ours = theirs = start = None
    falls = 0
    for _ in range(400):
        actions, ours = policy.predict(a, ours)
        other, theirs = policy.predict(b, theirs, episode_start=start)
        other[1] = 40.0
        a = calm.step(actions)[0]
        b, _, terminated, truncated, _ = falling.step(other)
        start = terminated | truncated
        falls += terminated[1]
        assert a[[0, 2]].tobytes() == b[[0, 2]].tobytes()
    assert falls >= 1


def test_without_autoreset_a_walk_that_is_over_waits() -> None:
    env = make(3, autoreset_mode="Disabled", disturbances={**VARIED, "payload": 1.0}, duration=0.1)
    other = make(3, autoreset_mode=AutoresetMode.DISABLED, disturbances={**VARIED, "payload": 1.0}, duration=0.1)
    truncated = np.zeros(3, np.bool_)
    env.reset(seed=[1, 2, 3])
    other.reset(seed=[1, 2, 3])
    still = np.zeros((3, 12))
    for _ in range(50):
        env.step(still)
        other.step(still)
    mask = np.array([False, True, False])
    observations, info = env.reset(options={"reset_mask": mask})
    assert np.array_equal(info["_time_s"], mask)
    for _ in range(50):
        observations, _, terminated, truncated, _ = env.step(still)
        theirs, *_ = other.step(still)
        assert observations[[0, 2]].tobytes() == theirs[[0, 2]].tobytes()  # noise goes on as if nobody had looked
    assert np.array_equal(truncated, [True, False, True])
    for _ in range(50):
        again, rewards, terminated, truncated, info = env.step(np.where([[True], [False], [True]], np.nan, still))
        assert np.array_equal(again[[0, 2]], observations[[0, 2]])
        assert np.array_equal(rewards[[0, 2]], [0.0, 0.0])
        assert not (terminated | truncated)[[0, 2]].any()
    assert truncated[1]
    assert np.array_equal(info["time_s"], [0.1, 0.1, 0.1])


def test_reset_mask_resets_some() -> None:
    env, other = make(3, disturbances=PUSHED), make(3, disturbances=PUSHED)
    a, b = env.reset(seed=0)[0], other.reset(seed=0)[0]
    still = np.zeros((3, 12))
    for _ in range(10):
        a, b = env.step(still)[0], other.step(still)[0]
    mask = np.array([False, True, False])
    a, info = env.reset(seed=[5, 6, 7], options={"reset_mask": mask})
    assert a[[0, 2]].tobytes() == b[[0, 2]].tobytes()
    assert all(np.array_equal(values, mask) for name, values in info.items() if name[0] == "_")
    alone = single(disturbances=PUSHED)
    fresh, _ = alone.reset(seed=6)
    assert env.sampled_disturbances[1] == alone.sampled_disturbances
    assert a[1].tobytes() == fresh.tobytes()
    for _ in range(20):
        a, b = env.step(still)[0], other.step(still)[0]
        assert a[[0, 2]].tobytes() == b[[0, 2]].tobytes()


def test_reset_takes_scenarios() -> None:
    env = make(2, control_period=0.004)
    drawn = sampled(env, seed=0, options={"scenario": "S3-L4"})
    assert len(drawn[0]["push"]) == len(drawn[1]["push"]) > 1
    with pytest.raises(OptionError, match=r"control_period of this environment is 0\.001; allowed: 0\.004"):
        make(1).reset(options={"scenario": "S3-L4"})


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"num_envs": 0}, ["num_envs", "0", ">= 1"]),
        ({"num_envs": 2.5}, ["num_envs", "2.5"]),
        ({"engine": "bullet"}, ["engine", "bullet", "'mujoco'", "sync"]),
        ({"engine": "ode"}, ["engine", "ode", "'mujoco'"]),
        ({"threads": 0}, ["threads", "0", ">= 1"]),
        ({"threads": True}, ["threads", "True"]),
        ({"control_period": 0.0015}, ["control_period", "0.0015"]),
        ({"duration": -1.0}, ["duration", "-1.0"]),
        ({"arms": "three"}, ["arms", "three", "revolute"]),
        ({"disturbances": {"wind": 1.0}}, ["wind", "ojas", "payload"]),
    ],
)
def test_bad_arguments_name_field_value_and_what_is_allowed(kwargs: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(ArtdeGymError) as caught:
        BipedPushVectorEnv(**{"num_envs": 1, "engine": "mujoco", **kwargs})
    for word in (*words, "allowed"):
        assert word in str(caught.value)


def test_bad_resets_and_steps() -> None:
    env = make(2, disturbances={})
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros((2, 12)))
    with pytest.raises(OptionError, match="reset_mask"):
        env.reset(options={"reset_mask": np.array([True, False])})  # the other one has never begun
    env.reset(seed=0)
    for actions in (np.zeros(12), np.zeros((3, 12)), np.zeros((2, 11))):
        with pytest.raises(ActionError, match="shape"):
            env.step(actions)
    with pytest.raises(ActionError, match=r"environment 1.*finite torques"):
        env.step(np.array([np.zeros(12), np.full(12, np.nan)]))
    other = make(2, disturbances={})
    other.reset(seed=0)
    assert env.step(np.ones((2, 12)))[0].tobytes() == other.step(np.ones((2, 12)))[0].tobytes()  # nothing has changed


@pytest.mark.once
def test_two_vectors_in_one_process_do_not_touch_each_other() -> None:
    alone = walked_together(make(2, disturbances=PUSHED), 3, 40)
    env, disturber = make(2, disturbances=PUSHED), make(3, disturbances={"payload": 3.0}, control_period=0.002)
    disturber.reset(seed=1)
    step = env.step

    def disturbed(actions: np.ndarray) -> Any:
        disturber.step(np.full((3, 12), 1.0))
        return step(actions)

    env.step = disturbed
    assert walked_together(env, 3, 40) == alone


def test_memory_does_not_grow_with_steps_and_restarts() -> None:
    env = make(4, disturbances=VARIED, duration=0.1)
    env.reset(seed=0)

    def resident() -> int:
        return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096

    def run(steps: int) -> None:
        for _ in range(steps):
            env.step(np.zeros((4, 12)))

    run(110)
    before = resident()
    run(330)
    assert resident() - before < 2e6
