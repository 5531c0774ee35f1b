from collections.abc import Callable
from typing import Any

import pytest

PPOConfig = pytest.importorskip(
    "ray.rllib.algorithms.ppo", reason="RLlib is not installed", exc_type=ImportError
).PPOConfig

pytestmark = pytest.mark.clients


def test_an_iteration_of_ppo(name: str, make: Callable[[], Any]) -> None:
    from ray.tune.registry import register_env

    register_env(name, lambda _: make())
    config = (
        PPOConfig()
        .environment(name)
        .env_runners(num_env_runners=0, num_envs_per_env_runner=2, rollout_fragment_length=50)
        .training(train_batch_size_per_learner=100, minibatch_size=50, num_epochs=1)
    )
    algorithm = config.build_algo()
    result = algorithm.train()
    assert result["env_runners"]["num_env_steps_sampled"] >= 100
    algorithm.stop()
