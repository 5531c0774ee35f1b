"""Copies of environments are equal and independent, bit for bit, at any time of an episode."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.sim.factory import EngineName

BIPED: dict[str, Any] = {
    "payload": {"mass": 1.0, "attach_time": 0.004, "detach_time": 0.03},
    "push": [{"magnitude": {"uniform": [5, 20]}, "start": 0.01, "duration": 0.02}],
    "grf_pulse": 20.0,
    "rotor_inertia": {"uniform": [0.03, 0.06]},
    "mass_distribution": 1.1,
    "contact": 0.02,
    "torque_limit": 30.0,
    "friction": {"uniform": [0.6, 0.9]},
    "slope": 1.0,
    "mass_scale": {"uniform": [0.9, 1.1]},
    "sensor_noise": {"position": 1e-4, "velocity": 1e-3},
    "encoder_bits": 14,
    "action_delay": 2,
    "motor_lag": 0.003,
    "actuator_effectiveness": [{"joint": "all", "factor": 0.9, "start": 0.02}],
}
QUADROTOR: dict[str, Any] = {
    "payload": {"mass": {"uniform": [0.2, 0.3]}, "attach_time": 0.03, "detach_time": 0.2},
    "push": [{"magnitude": {"uniform": [1, 3]}, "start": 0.05, "duration": 0.053}],
    "wind": {"steady": [2.0, 0.0, 0.0]},
    "ground_effect": 1.0,
    "sensor_noise": {"position": 1e-3},
    "action_delay": 1,
    "motor_lag": 0.05,
    "actuator_effectiveness": [{"joint": "all", "factor": 0.95, "start": 0.1}],
}
CASES: dict[str, dict[str, Any]] = {
    "BipedPush-v0": {"disturbances": BIPED, "duration": 0.1},
    "QuadInfinity-Payload-v0": {"disturbances": QUADROTOR, "duration": 0.6, "measurement": "mocap"},
}
WAYS: dict[str, Callable[[Any], Any]] = {
    "deepcopy": copy.deepcopy,
    "pickle": lambda env: pickle.loads(pickle.dumps(env)),
}
BEFORE = [8, pytest.param(50, marks=pytest.mark.once)]
"""Steps before the copy."""


def make(name: str, engine: EngineName) -> Any:
    return gym.make(name, engine=engine, disable_env_checker=True, **CASES[name])


def make_vec(name: str, **kwargs: Any) -> Any:
    engine = "mujoco" if name.startswith("Biped") else "numpy"
    return gym.make_vec(name, 3, "vector_entry_point", engine=engine, **CASES[name], **kwargs)


def go(env: Any, steps: int) -> list[Any]:
    """All that an environment tells in some steps with actions of its own; it begins anew where an episode ends."""
    seen: list[Any] = []
    low, high = env.action_space.low, env.action_space.high
    for _ in range(steps):
        action = 0.5 * (low + high) + 0.02 * (env.action_space.sample() - 0.5 * (low + high))
        observation, reward, terminated, truncated, info = env.step(action)
        told = {name: np.asarray(value).tolist() for name, value in sorted(info.items())}
        seen.append((observation.tolist(), np.asarray(reward).tolist(), np.asarray(terminated).tolist(), told))
        if isinstance(env.unwrapped, gym.Env) and (terminated or truncated):
            observation, info = env.reset()
            seen.append((observation.tolist(), env.get_wrapper_attr("sampled_disturbances")))
    return seen


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("before", BEFORE)
def test_a_copy_goes_on_as_the_original(name: str, engine_name: EngineName, way: str, before: int) -> None:
    env = make(name, engine_name)
    env.action_space.seed(1)
    env.reset(seed=4)
    go(env, before)
    twin = WAYS[way](env)
    assert repr(go(twin, 70)) == repr(go(env, 70))  # to a second episode and into it
    assert twin.spec == env.spec
    twin.close()
    go(env, 1)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("before", BEFORE)
def test_a_copy_of_a_vector_goes_on_as_the_original(name: str, way: str, before: int) -> None:
    env = make_vec(name)
    env.action_space.seed(1)
    env.reset(seed=4)
    go(env, before)
    twin = WAYS[way](env)
    assert repr(go(twin, 70)) == repr(go(env, 70))
    twin.close()
    go(env, 1)


@pytest.mark.parametrize("name", CASES)
def test_copies_do_not_touch_each_other(name: str, engine_name: EngineName) -> None:
    env, other = make(name, engine_name), make(name, engine_name)
    for each in (env, other):
        each.action_space.seed(1)
        each.reset(seed=4)
        go(each, 20)
    twin = copy.copy(env.unwrapped)
    expected = repr(go(other, 20))
    twin.step(twin.action_space.high)
    twin.reset(seed=9)
    go(twin, 10)
    assert repr(go(env, 20)) == expected


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("vector", [False, True])
def test_a_fresh_environment_is_copied_too(name: str, vector: bool) -> None:
    env = make_vec(name) if vector else make(name, "mujoco")
    twin = pickle.loads(pickle.dumps(env))
    first, second = env.reset(seed=3)[0], twin.reset(seed=3)[0]
    assert first.tobytes() == second.tobytes()
    env.close()
    with pytest.raises(gym.error.ClosedEnvironmentError):
        copy.deepcopy(env).reset(seed=0)
