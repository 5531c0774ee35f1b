from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed", exc_type=ImportError)

pytestmark = pytest.mark.clients

ON_POLICY = {"A2C": {"n_steps": 20}, "PPO": {"n_steps": 50, "batch_size": 50, "n_epochs": 1}}
OFF_POLICY = {name: {"learning_starts": 50, "train_freq": 10, "batch_size": 16} for name in ("SAC", "TD3", "DDPG")}


def small(**more: Any) -> dict[str, Any]:
    """Arguments of a small model; new ones, since models change them."""
    return {"policy_kwargs": {"net_arch": [8], **more}, "device": "cpu", "seed": 0}


def finite(model: Any) -> bool:
    return all(bool(parameter.isfinite().all()) for parameter in model.policy.parameters())


@pytest.mark.parametrize(("algorithm", "options"), [*ON_POLICY.items(), *OFF_POLICY.items()])
def test_each_algorithm_learns(make: Callable[[], Any], algorithm: str, options: dict[str, Any]) -> None:
    model = getattr(sb3, algorithm)("MlpPolicy", make(), **options, **small()).learn(200)
    assert model.num_timesteps >= 200
    assert finite(model)
    assert model.ep_info_buffer  # episodes have ended and were counted


def test_the_checker_has_no_objection(make: Callable[[], Any]) -> None:
    from stable_baselines3.common.env_checker import check_env

    check_env(make())


@pytest.mark.parametrize("parallel", ["DummyVecEnv", "SubprocVecEnv"])
def test_vectors_of_its_own(make: Callable[[], Any], parallel: str) -> None:
    vectors = pytest.importorskip("stable_baselines3.common.vec_env")
    env = vectors.VecNormalize(getattr(vectors, parallel)([make, make]))
    model = sb3.PPO("MlpPolicy", env, n_steps=20, batch_size=40, n_epochs=1, **small()).learn(80)
    assert finite(model)
    assert np.isfinite(env.reset()).all()
    env.close()


def test_a_recurrent_policy_learns(make: Callable[[], Any]) -> None:
    contrib = pytest.importorskip("sb3_contrib", reason="sb3-contrib is not installed")
    options = {"n_steps": 50, "batch_size": 50, "n_epochs": 1, **small(lstm_hidden_size=8)}
    model = contrib.RecurrentPPO("MlpLstmPolicy", make(), **options).learn(200)
    assert model.num_timesteps >= 200
    assert finite(model)
