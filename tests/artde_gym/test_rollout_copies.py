"""A policy that writes into what it is given changes neither its score nor its signals."""

from __future__ import annotations

import json
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.evaluation.environments import vector
from artde_gym.evaluation.rollout import Episode, run_episode
from artde_gym.evaluation.vector_rollout import run_vector

SHORT: dict[str, Any] = {"duration": 0.3}
QUADROTOR = "QuadInfinity-Payload-v0"
BIPED = "BipedWalk-Payload-v0"


class Flatterer:
    """A policy that writes into what it is handed, and into the diagnostics that it gave away, after its decision."""

    def __init__(self, policy: Any) -> None:
        self.policy = policy
        self.given: list[dict[str, Any]] = []

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Any, Any]:
        for old in self.given:
            for values in old.values():
                values[...] = 0.0
        self.given = []
        action, state = self.policy.predict(observation.copy(), state=state, episode_start=episode_start)
        observation[...] = 0.0
        if isinstance(episode_start, np.ndarray):
            episode_start[...] = False
        return action, state

    def diagnostics(self, state: Any) -> dict[str, Any]:
        self.given.append({name: np.array(values) for name, values in self.policy.diagnostics(state).items()})
        return self.given[-1]


class Meddler(gym.Wrapper[Any, Any, Any, Any]):
    """An environment whose `info` is written into after it has been handed out."""

    info: dict[str, Any]

    def reset(self, **kwargs: Any) -> tuple[Any, dict[str, Any]]:
        observation, self.info = self.env.reset(**kwargs)
        return observation, self.info

    def step(self, action: Any) -> Any:
        self.info["disturbance.payload.mass"] = 99.0
        return self.env.step(action)


def equal(one: Episode, other: Episode) -> None:
    np.testing.assert_equal(one.row, other.row)
    assert one.traces.keys() == other.traces.keys()
    for name, values in one.traces.items():
        np.testing.assert_array_equal(values, other.traces[name])


@pytest.mark.parametrize("env_id", [BIPED, QUADROTOR])
def test_one_episode(env_id: str) -> None:
    env = gym.make(env_id, disable_env_checker=True, **SHORT)
    policy = controllers.make("artde", env)
    honest = run_episode(env, policy, 3)
    equal(run_episode(env, Flatterer(policy), 3), honest)
    equal(run_episode(Meddler(env), policy, 3), honest)
    env.close()


@pytest.mark.once
def test_many_episodes() -> None:
    env = vector(QUADROTOR, json.dumps(SHORT), 3)
    policy = controllers.make("artde", env)
    for one, other in zip(
        run_vector(env, Flatterer(policy), [1, 2, 3], recorded=range(2)),
        run_vector(env, policy, [1, 2, 3], recorded=range(2)),
        strict=True,
    ):
        equal(one, other)
    env.close()
