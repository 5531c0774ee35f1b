"""CleanRL is one file an algorithm and no package: here is what its continuous PPO wraps an environment in."""

from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import wrappers

pytestmark = pytest.mark.clients

STEPS = 40  # more than an episode has


def wrapped(name: str, arguments: dict[str, Any]) -> gym.Env[Any, Any]:
    env = gym.wrappers.RescaleAction(gym.make(name, **arguments), np.float64(-1.0), np.float64(1.0))
    env = wrappers.FlattenObservation(env)
    env = wrappers.RecordEpisodeStatistics(env)
    env = wrappers.ClipAction(env)
    env = wrappers.NormalizeObservation(env)
    space = gym.spaces.Box(-10.0, 10.0, env.observation_space.shape, np.float64)
    env = wrappers.TransformObservation(env, lambda seen: np.clip(seen, -10.0, 10.0), space)
    env = wrappers.NormalizeReward(env, gamma=0.99)
    return wrappers.TransformReward(env, lambda reward: float(np.clip(float(reward), -10.0, 10.0)))


def check(env: Any) -> None:
    """Act at random, and look at what comes out of a vector environment."""
    env.action_space.seed(0)
    observations, _ = env.reset(seed=0)
    ended = 0
    for _ in range(STEPS):
        observations, rewards, terminated, truncated, info = env.step(env.action_space.sample())
        assert observations.shape == (2, *env.single_observation_space.shape)
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        if "episode" in info:
            done = info["_episode"]
            assert done.tolist() == (terminated | truncated).tolist()
            assert (info["episode"]["l"][done] > 0).all()
            ended += int(done.sum())
    assert ended
    env.close()


def test_the_wrappers_of_single_environments(name: str, arguments: dict[str, Any]) -> None:
    check(gym.vector.SyncVectorEnv([lambda: wrapped(name, arguments)] * 2))


def test_the_wrappers_of_vectors(name: str, arguments: dict[str, Any]) -> None:
    engine = "numpy" if name.startswith("Quad") else "mujoco"
    env = gym.make_vec(name, 2, "vector_entry_point", engine=engine, **arguments)
    env = wrappers.vector.RescaleAction(env, -1.0, 1.0)
    env = wrappers.vector.FlattenObservation(env)
    env = wrappers.vector.RecordEpisodeStatistics(env)
    env = wrappers.vector.ClipAction(env)
    env = wrappers.vector.NormalizeObservation(env)
    env = wrappers.vector.TransformObservation(env, lambda seen: np.clip(seen, -10.0, 10.0))
    env = wrappers.vector.NormalizeReward(env, gamma=0.99)
    check(wrappers.vector.TransformReward(env, lambda rewards: np.clip(rewards, -10.0, 10.0)))
