"""A residual on the arm: what it sees, what it is rewarded for, and its task; many arms as one."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import artde_gym  # noqa: F401  (registers the environment)
from baselines.residual import Residual
from baselines.residual_config import ResidualConfig
from baselines.residual_env import ResidualEnv
from baselines.tasks import task

ID = "ArmTrack-Payload-v0"
PUSHED: dict[str, Any] = {
    "payload": {"mass": 1.0, "attach_time": 0.1},
    "push": [{"body": "tool", "magnitude": 50.0, "direction": [1.0, 0.0, 0.0], "start": 0.15, "duration": 0.1}],
}


def test_the_agent_sees_the_tools_error_and_is_rewarded_for_a_small_one() -> None:
    env: Any = gym.make(ID, engine="mujoco", duration=1.0)
    adapter = Residual.of(env, ResidualConfig("arm")).adapter
    at, observation = env.unwrapped.observation_layout.slices, env.reset(seed=0)[0]
    state, rewards = adapter.start(observation), []
    for error in (0.0, 1e-5, 1e-3, 1e-2):
        observation[at["tool"]] = observation[at["tool_ref"]] - [0.0, error, 0.0]
        seen, _ = adapter.observe(observation, {}, state)
        np.testing.assert_allclose(seen[adapter.features["tool_error"]], [0.0, error, 0.0], atol=1e-15)
        rewards.append(float(adapter.reward_terms(observation, state, False)["tool"]))
    assert rewards == pytest.approx([1.0, np.exp(-0.1), np.exp(-1.0), np.exp(-np.sqrt(10.0))], rel=1e-6)


@pytest.mark.torch
def test_many_arms_under_actions_are_one_arm_at_a_time() -> None:
    from baselines.vec_env import batched

    config, kwargs = ResidualConfig("arm"), {"duration": 0.4, "disturbances": PUSHED}
    many = batched(ID, config, 3, kwargs)
    many.seed(5)
    seen = [many.reset()]
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (15, 3, 7))
    for action in actions:
        many.step_async(action)
        features, _, done, _ = many.step_wait()
        assert not done.any()
        seen.append(features)
    for i in range(3):
        one = ResidualEnv(gym.make(ID, engine="mujoco", disable_env_checker=True, **kwargs), config)
        features, _ = one.reset(seed=5 + i)
        np.testing.assert_array_equal(features, seen[0][i])
        for k, action in enumerate(actions[:, i]):
            features, *_ = one.step(action)
            np.testing.assert_array_equal(features, seen[k + 1][i])


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_the_task_trains_on_payloads_and_on_pushes_by_level(level: float) -> None:
    made = gym.make_vec(ID, 8, "vector_entry_point", engine="mujoco", disturbances=task(ID).training(level))
    env: Any = made.unwrapped
    env.reset(seed=3)
    drawn = env.sampled_disturbances
    assert len({one["payload"]["mass"] for one in drawn}) == 8
    assert all(push["body"] == "tool" for one in drawn for push in one["push"])
    assert 0 < max(push["magnitude"] for one in drawn for push in one["push"]) <= 60.0 + 90.0 * level
