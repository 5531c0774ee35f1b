"""The linear balance law and its tuning: what the law is, candidates judged as if alone, and a tuning continued."""

import json
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from baselines.balance import GAINS, balance_network
from baselines.errors import TrainingError
from baselines.residual import Residual
from baselines.residual_config import ResidualConfig
from baselines.residual_env import ResidualEnv
from baselines.run import Training


@pytest.fixture
def residual():
    env = gym.make("BipedPush-v0", disable_env_checker=True, duration=0.5, disturbances={})
    yield Residual.of(env, ResidualConfig("ojas"))
    env.close()


def test_the_law_is_linear_in_the_state_of_its_plane(residual):
    """Pitching acts on what moves in the sagittal plane alone, rolling likewise, and each by its own gain."""
    gains = np.linspace(0.01, 0.28, GAINS)
    network = balance_network(gains, residual.features, residual.actions)
    large = {"tilt": (0.2, 1), "angular_velocity": (1.0, 1), "velocity_error": (0.4, 0), "displacement": (0.05, 0)}
    sagittal = ("swing_x", "body_x", "stance_pitch", "lean_pitch")
    for column, (field, (size, component)) in enumerate(large.items()):
        features = np.zeros(residual.features.size)
        features[residual.features[field].start + component] = size
        found = dict(zip(residual.actions, network(features), strict=True))
        expected = dict(zip(sagittal, gains.reshape(-1, 4)[:4, column], strict=True))
        for name, action in found.items():
            assert action == pytest.approx(expected.get(name, 0.0), abs=1e-6)


@pytest.fixture
def tuning(monkeypatch):
    """Small generations."""
    import dataclasses

    from baselines import ojas_tasks, tune_balance
    from baselines.agent import AGENTS

    tasks = AGENTS["ojas"].tasks
    monkeypatch.setitem(tasks, "BipedPush-v0", dataclasses.replace(tasks["BipedPush-v0"], episodes=1))
    for name, value in {"POPULATION": 5, "PUSHES": 2, "DURATION": 1.5}.items():
        monkeypatch.setattr(tune_balance, name, value)
    pushes = [ojas_tasks.push({"choice": [20.0, 60.0]}, start={"uniform": [0.1, 0.6]})]
    monkeypatch.setattr(tune_balance, "_PUSH", {"push": pushes})
    return tune_balance


def training(steps: int) -> Training:
    return Training(
        "BipedPush-v0", ResidualConfig("ojas"), "cma-es", steps, env_kwargs={"engine": "mujoco"}, test_every=100
    )


def generations(folder) -> list[dict[str, Any]]:
    return json.loads((folder / "generations.json").read_text())["generations"]


@pytest.mark.torch
def test_a_continued_tuning_equals_one_that_never_stopped(tuning, tmp_path, monkeypatch):
    monkeypatch.setattr(tuning, "DURATION", 0.5)
    tuning.tune(training(400), tmp_path / "whole")
    tuning.tune(training(1), tmp_path / "parts")
    assert len(generations(tmp_path / "parts")) == 1
    tuning.tune(training(400), tmp_path / "parts")
    assert generations(tmp_path / "parts") == generations(tmp_path / "whole")
    assert len(generations(tmp_path / "whole")) > 1


@pytest.mark.torch
def test_candidates_are_judged_as_if_each_were_alone(tuning):
    kwargs = {"duration": tuning.DURATION, "self_collision": True, "disturbances": tuning._PUSH}
    env = tuning.batched("BipedPush-v0", ResidualConfig("ojas"), 4, kwargs)
    rng = np.random.default_rng(2)
    networks = [balance_network(rng.normal(0, 0.5, GAINS), env.residual.features, env.residual.actions) for _ in "ab"]
    seeds = [3, 11]
    costs, count = tuning._judge(env, networks, seeds)
    alone = ResidualEnv(
        gym.make("BipedPush-v0", disable_env_checker=True, engine="mujoco", **kwargs), ResidualConfig("ojas")
    )
    steps, falls = 0, 0
    for network, cost in zip(networks, costs, strict=True):
        total = 0.0
        for seed in seeds:
            features, _ = alone.reset(seed=seed)
            over = terminated = False
            while not over:
                features, reward, terminated, truncated, _ = alone.step(network(features))
                over, total, steps = terminated or truncated, total + reward, steps + 1
            falls += terminated
        # one law for all rows and a law for each are other products, which round differently
        assert cost == pytest.approx(1.0 - total / 2 / (2.5 * tuning.DURATION / 0.02), abs=1e-3)
    assert count == steps
    assert 0 < falls < 4
    env.close()
    alone.close()


@pytest.mark.torch
def test_what_has_no_balance_law_or_no_batch_is_refused(tuning, tmp_path):
    with pytest.raises(TrainingError, match="'joints'; allowed: synergies, wide-synergies, of which the law has gains"):
        tuning.tune(
            Training("BipedPush-v0", ResidualConfig("ojas", action_mode="joints"), "cma-es"), tmp_path / "joints"
        )
    with pytest.raises(TrainingError, match="engine is 'bullet'; allowed: 'mujoco'"):
        tuning.tune(
            Training("BipedPush-v0", ResidualConfig("ojas"), "cma-es", env_kwargs={"engine": "bullet"}),
            tmp_path / "bullet",
        )
