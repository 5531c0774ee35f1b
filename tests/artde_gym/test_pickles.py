"""All environments and vectors of this project can be pickled, with their episodes."""

from __future__ import annotations

import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import load_env_creator

from artde_gym.evaluation.environments import ours

VECTORS = [name for name in ours() if gym.spec(name).vector_entry_point]


def same_episode(env: Any, again: Any) -> None:
    action = np.zeros(env.action_space.shape, env.action_space.dtype)
    for one, other in zip(env.step(action)[:4], again.step(action)[:4], strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", ours())
def test_an_environment_can_be_pickled(name: str) -> None:
    env: Any = gym.make(name, disable_env_checker=True, duration=0.1).unwrapped
    env.reset(seed=1)
    same_episode(env, pickle.loads(pickle.dumps(env)))
    env.close()


@pytest.mark.parametrize("name", VECTORS)
def test_a_vector_can_be_pickled(name: str) -> None:
    creator: Any = load_env_creator(str(gym.spec(name).vector_entry_point))
    env: Any = gym.make_vec(name, 2, "vector_entry_point", duration=0.1, engine=creator.own_engine).unwrapped
    env.reset(seed=1)
    same_episode(env, pickle.loads(pickle.dumps(env)))
    env.close()
