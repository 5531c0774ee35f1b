"""Training: what continues equals what never stopped, the adapter keeps SB3's contract, and something is learnt."""

import json
import os
import signal
import subprocess
import sys
import time
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch
from scipy import stats
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.vec_env import VecMonitor

from artde_gym.errors import OptionError
from artde_gym.report import write_report
from baselines.errors import TrainingError
from baselines.export import exported
from baselines.residual_config import ResidualConfig
from baselines.residual_env import ResidualEnv
from baselines.rollouts import OpenRollouts
from baselines.run import Run, Training
from baselines.train import Trainer, environments, train
from baselines.vec_env import ResidualVecEnv, batched

QUADROTOR = "QuadInfinity-Payload-v0"
GALE = {"wind": 2.0, "ground_effect": 1.0}


def batch(count: int, **kwargs: Any) -> Any:
    return gym.make_vec(QUADROTOR, count, vectorization_mode="vector_entry_point", engine="numpy", **kwargs)


def small(algo: str = "ppo", **more: Any) -> Training:
    options = {"n_steps": 8, "batch_size": 16} if algo == "ppo" else {"learning_starts": 8, "buffer_size": 4096}
    return Training(
        QUADROTOR,
        ResidualConfig("q450"),
        algo=algo,
        envs=4,
        env_kwargs={"duration": 1.0},
        options=options,
        test_every=1,
        **more,
    )


@pytest.fixture
def quick(monkeypatch):
    """Small intervals and tests."""
    import dataclasses

    from baselines import run
    from baselines import train as training_module
    from baselines.agent import AGENTS

    task = dataclasses.replace(AGENTS["q450"].tasks[QUADROTOR], rollouts=2, episodes=1)
    monkeypatch.setitem(AGENTS["q450"].tasks, QUADROTOR, task)
    monkeypatch.setattr(training_module, "SAC_INTERVAL", 64)
    assert run.task(QUADROTOR) is task


def test_a_training_does_not_warn_of_disturbances_that_it_replaces(tmp_path):
    """The standard push of a walk comes after the 8 s of a training's episodes."""
    run = Run(Training("BipedPush-v0", ResidualConfig("ojas"), envs=1), tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env, _ = environments(run.training, run)
    env.close()


def parameters(folder):
    newest = sorted((folder / "checkpoints").glob("0*"))[-1]
    return torch.load(newest / "parameters.pt", weights_only=True)


def equal(one, other) -> bool:
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(equal(one[key], other[key]) for key in one)
    if isinstance(one, list):
        return all(map(equal, one, other))
    return torch.equal(one, other) if isinstance(one, torch.Tensor) else one == other


@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_a_continued_training_equals_one_that_never_stopped(algo, tmp_path, quick):
    train(small(algo, steps=256), tmp_path / "whole")
    train(small(algo, steps=128), tmp_path / "parts")
    assert not equal(parameters(tmp_path / "whole"), parameters(tmp_path / "parts"))
    train(small(algo, steps=256), tmp_path / "parts")
    assert equal(parameters(tmp_path / "whole"), parameters(tmp_path / "parts"))
    curves = [(tmp_path / run / "learning_curve.csv").read_text() for run in ("whole", "parts")]
    assert curves[0] == curves[1]


def test_a_killed_training_continues_from_its_last_checkpoint(tmp_path):
    command = [
        *(sys.executable, "-m", "artde_gym.cli", "train", "--env", QUADROTOR, "--algo", "sac", "--steps", "200000"),
        *("--env-kwargs", '{"duration": 1.0}', "--options", '{"learning_starts": 100000}', "--out", str(tmp_path)),
    ]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)
    checkpoints = tmp_path / "checkpoints"
    deadline = time.monotonic() + 120
    while not list(checkpoints.glob("0*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    newest = sorted(checkpoints.glob("0*"))[-1]
    steps = json.loads((newest / "state.json").read_text())["steps"]
    assert steps > 0
    configuration = json.loads((tmp_path / "run.json").read_text())["configuration"]
    config = ResidualConfig(**configuration.pop("config"))
    configuration.pop("engine")  # which the environment and its arguments decide
    training = Training(**{**configuration, "config": config, "steps": steps + 1})
    train(training, tmp_path)
    assert (
        json.loads((sorted(checkpoints.glob("0*"))[-1] / "state.json").read_text())["interval"] == int(newest.name) + 1
    )


def test_a_folder_belongs_to_one_configuration(tmp_path, quick):
    train(small(steps=1), tmp_path)
    Run(small(steps=7, patience=3, workers=2), tmp_path)  # the same episodes, wherever and however long
    with pytest.raises(TrainingError, match="seed 4 differs from 0 of the run in"):
        Run(small(seed=4), tmp_path)
    with pytest.raises(TrainingError, match=r"algo is 'pqo'; allowed: cma-es, ppo, sac \(did you mean 'ppo'"):
        small("pqo")


def test_a_training_has_a_report(tmp_path, quick):
    train(small(steps=192), tmp_path)
    curve = (tmp_path / "learning_curve.csv").read_text().splitlines()
    text = write_report(tmp_path).read_text()
    assert f"Best of {len(curve) - 1} held-out tests" in text
    assert "tde+ppo in QuadInfinity-Payload-v0: action mode attitude" in text
    for column in curve[0].split(","):
        assert f">{column}</button>" in text


def test_numpy_inference_equals_torch(tmp_path, quick):
    rng = np.random.default_rng(0)
    for algo in ("ppo", "sac"):
        run = Run(small(algo), tmp_path / algo)
        env, residual = environments(run.training, run)
        trainer = Trainer(run, env, residual)
        with torch.no_grad():
            for parameter in trainer.model.policy.parameters():
                parameter += 0.05 * torch.randn_like(parameter)
        size = residual.features.size
        statistics: Any = trainer.env.obs_rms
        statistics.mean, statistics.var = rng.normal(size=size), rng.uniform(0.1, 4.0, size)
        network = exported(trainer.model, trainer.env)
        features = rng.normal(0, 3, (50, size)).astype("f4")
        expected, _ = trainer.model.predict(trainer.env.normalize_obs(features), deterministic=True)
        np.testing.assert_allclose(network(features), expected, rtol=0, atol=2e-5)
        np.testing.assert_array_equal(network(features), [network(row) for row in features])
        env.close()


@pytest.mark.parametrize(("env_id", "robot"), [("BipedPush-v0", "ojas"), (QUADROTOR, "q450")])
@pytest.mark.filterwarnings("ignore:Your observation .* has an unconventional shape")
def test_a_single_environment_passes_the_checker_of_sb3(env_id, robot):
    env = ResidualEnv(gym.make(env_id, disable_env_checker=True, duration=3.0), ResidualConfig(robot))
    check_env(env, skip_render_check=True)
    env.close()


def test_the_adapter_steps_each_vehicle_as_a_single_batch_would():
    """Same seeds and actions: rewards and features equal, and a new episode begins at once after the last step."""
    kwargs = {"duration": 0.15, "disturbances": GALE}
    pair, one = (
        ResidualVecEnv(batch(2, **kwargs), ResidualConfig("q450")),
        ResidualVecEnv(batch(1, **kwargs), ResidualConfig("q450")),
    )
    pair.seed(11)
    one._seeds = [12]
    together: Any = pair.reset()
    alone: Any = one.reset()
    rng = np.random.default_rng(0)
    ends = 0
    for _ in range(25):
        np.testing.assert_array_equal(together[1], alone[0])
        actions = rng.uniform(-1, 1, (2, 3)).astype("f4")
        together, rewards, done, infos = pair.step(actions)
        alone, reward, done_alone, infos_alone = one.step(actions[1:])
        assert (rewards[1], done[1]) == (reward[0], done_alone[0])
        if done[1]:
            ends += 1
            assert infos[1]["TimeLimit.truncated"]
            np.testing.assert_array_equal(infos[1]["terminal_observation"], infos_alone[0]["terminal_observation"])
            assert not np.array_equal(infos[1]["terminal_observation"], together[1])
    assert ends == 2
    pair.close()
    one.close()


def test_the_adapter_is_what_the_single_environment_is():
    """In still air, over some decisions, up to the different physics."""
    vector = ResidualVecEnv(batch(1, duration=2.0, disturbances={}), ResidualConfig("q450"))
    single = ResidualEnv(
        gym.make(QUADROTOR, disable_env_checker=True, duration=2.0, disturbances={}), ResidualConfig("q450")
    )
    many: Any = vector.reset()
    one, rewards, reward = single.reset(seed=0)[0], np.zeros(1), 0.0
    for k in range(60):
        action = 0.5 * np.sin(0.2 * k + np.arange(3.0)).astype("f4")
        many, rewards, *_ = vector.step(action[None])
        one, reward, *_ = single.step(action)
    np.testing.assert_allclose(many[0], one, rtol=0, atol=5e-3)
    assert rewards[0] == pytest.approx(reward, abs=5e-3)
    vector.close()
    single.close()


ANYWHERE = [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0]
FALLING = {
    "duration": 1.2,
    "self_collision": True,
    "disturbances": {
        "push": [
            {
                "body": "chest",
                "magnitude": {"choice": [0.0, 60.0]},
                "direction": ANYWHERE,
                "start": {"uniform": [0.05, 0.4]},
            }
        ],
        "payload": 0.5,
    },
}


def test_the_adapter_is_the_single_biped_to_the_bit():
    """Falls within a decision, and what begins after them, included."""
    vector = batched("BipedPush-v0", ResidualConfig("ojas"), 3, FALLING)
    single = ResidualEnv(
        gym.make("BipedPush-v0", disable_env_checker=True, engine="mujoco", **FALLING), ResidualConfig("ojas")
    )
    vector.seed(7)
    many: Any = vector.reset()
    one, _ = single.reset(seed=9)
    rng = np.random.default_rng(0)
    falls = ends = 0
    for _ in range(150):
        np.testing.assert_array_equal(many[2], one)
        actions = rng.uniform(-1, 1, (3, 11)).astype("f4")
        many, rewards, done, infos = vector.step(actions)
        one, reward, terminated, truncated, _ = single.step(actions[2])
        assert (rewards[2], done[2]) == (np.float32(reward), terminated or truncated)
        if done[2]:
            ends, falls = ends + 1, falls + terminated
            np.testing.assert_array_equal(infos[2]["terminal_observation"], one)
            one, _ = single.reset()
    assert ends > falls > 0
    vector.close()
    single.close()


def test_the_adapter_says_what_it_cannot_do():
    env = ResidualVecEnv(batch(2, duration=1.0), ResidualConfig("q450"))
    assert VecMonitor(env).num_envs == 2
    with pytest.raises(OptionError, match="one environment of a vector"):
        env.set_attr("x", 1)
    with pytest.raises(OptionError, match=r"decision_period is 0\.02"):
        ResidualVecEnv(batch(2, duration=1.0), ResidualConfig("q450", decision_period=0.02))
    env.close()


def test_decisions_under_a_shut_gate_are_mostly_left_out_of_rollouts():
    steps, count = 10, 4
    box = gym.spaces.Box(-np.inf, np.inf, (2,), np.float32)
    rollouts = OpenRollouts(steps, box, gym.spaces.Box(-1.0, 1.0, (1,)), n_envs=count, gate=lambda seen: seen[:, 1])
    rng = np.random.default_rng(0)
    gates = np.where(rng.random((steps, count)) < 0.5, 0.0, 0.8)
    for k, row in enumerate(gates):
        seen = np.stack([count * k + np.arange(count), row], axis=1)
        value = torch.zeros(count)
        rollouts.add(seen, np.zeros((count, 1)), np.zeros(count), np.zeros(count), value, value)
    for _ in range(2):  # epochs
        got = np.concatenate([batch.observations.numpy() for batch in rollouts.get(7)])
        assert len(set(got[:, 0])) == len(got)
        assert set(got[got[:, 1] > 0, 0]) == set(np.flatnonzero(gates.ravel()))
        assert 0 < (got[:, 1] == 0).sum() <= steps * count / 5


def returns(actor: Any, recipe: ResidualConfig, count: int = 64) -> np.ndarray:
    """Of held-out flights of three seconds, up to a crash."""
    env = ResidualVecEnv(batch(count, duration=3.0, disturbances=GALE), recipe)
    env.seed(10_000)
    features = env.reset()
    total, flying = np.zeros(count), np.ones(count, np.bool_)
    for _ in range(199):
        features, rewards, done, _ = env.step(actor(features))
        total += rewards * flying
        flying &= ~done
    env.close()
    return total


def test_something_is_learnt(tmp_path):
    """2.4 million decisions on TDE, with the task's own options: held-out return above the zero residual's."""
    recipe = ResidualConfig("q450")
    run = Run(Training(QUADROTOR, recipe, steps=2_392_064), tmp_path)
    env, residual = environments(run.training, run)
    trainer = Trainer(run, env, residual)
    trainer.interval //= 2
    while trainer.steps < run.training.steps:
        trainer.learn()
    env.close()
    trained = returns(exported(trainer.model, trainer.env), recipe)
    nothing = returns(lambda features: np.zeros((len(features), len(residual.actions))), recipe)
    found: Any = stats.wilcoxon(trained - nothing, alternative="greater")
    assert found.pvalue < 0.001
