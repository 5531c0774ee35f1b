"""Messages on the command line and in errors: short, in words, once, and before anything is opened."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

import controllers
from artde_gym.cli import app
from artde_gym.errors import ActionError, ArtdeGymError, OptionError
from artde_gym.evaluation import evaluate
from controllers.laws.errors import GainError
from controllers.laws.tde import TdeGains

FLIGHT = ["--controllers", "tde", "--env", "QuadInfinity-Payload-v0", "--env-kwargs", '{"duration": 0.1}']


def test_a_value_is_shortened_and_the_rule_follows() -> None:
    with pytest.raises(GainError) as caught:
        TdeGains(np.full((12, 12), 0.123456789), 1.0, 1.0)  # pyright: ignore[reportArgumentType]  # make_plain
    assert len(str(caught.value)) < 220
    assert str(caught.value).endswith("allowed: a positive number, one a joint, or a positive definite matrix")
    error = OptionError("field", list(range(1000)), "three of them")
    assert len(str(error)) < 400
    assert str(error).endswith("...; allowed: three of them")
    assert error.value == list(range(1000))


def test_an_environment_of_others_is_no_attribute_error() -> None:
    with pytest.raises(OptionError, match=r"environment to be controlled is .*CartPole.*; allowed: one of artde_gym"):
        controllers.make("tde", gym.make("CartPole-v1"))


class Broken:
    """A policy whose third action is wrong."""

    def __init__(self, action: np.ndarray) -> None:
        self.action = action

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Any, Any]:
        count = 0 if state is None else state
        action = self.action if count == 2 else np.zeros(4)
        return np.broadcast_to(action, (*observation.shape[:-1], len(action))), count + 1


@pytest.mark.parametrize("vectorized", [False, True])
@pytest.mark.parametrize(("action", "problem"), [(np.full(4, np.nan), "finite"), (np.zeros(5), "shape")])
def test_a_wrong_action_names_its_controller_and_episode(action: np.ndarray, problem: str, vectorized: bool) -> None:
    policies = {"tde": "tde", "broken": Broken(action)}
    with pytest.raises(
        ActionError, match=rf"broken in Q1, episode 0\b.*{problem}|{problem}.*broken in Q1, episode 0\b"
    ):
        evaluate(policies, scenario="Q1", episodes=2, vectorized=vectorized, env_kwargs={"duration": 0.1})


class Planner(Broken):
    """A policy that sends the wrong action to a vector of its own."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Any, Any]:
        if state == 2:
            inner = gym.make_vec("QuadInfinity-Payload-v0", num_envs=10, duration=0.1, engine="numpy")
            inner.reset(seed=0)
            inner.step(np.concatenate([np.zeros((9, 4)), self.action[None]]))
        return super().predict(observation, state)


@pytest.mark.parametrize("vectorized", [False, True])
def test_a_wrong_action_of_a_policys_own_environment_is_not_the_episodes(vectorized: bool) -> None:
    planner = Planner(np.full(4, np.nan))
    with pytest.raises(ActionError, match=r"^action of environment 9 is"):
        evaluate({"broken": planner}, scenario="Q1", episodes=2, vectorized=vectorized, env_kwargs={"duration": 0.1})


def test_a_warning_is_one_line_once(tmp_path: Path) -> None:
    late = '{"push": [{"magnitude": 1.0, "start": 5.0}]}'
    words = ["evaluate", *FLIGHT, "--disturbances", late, "--episodes", "2", "--workers", "2", "--out", str(tmp_path)]
    run = subprocess.run([sys.executable, "-m", "artde_gym.cli", *words], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    (line,) = run.stderr.splitlines()
    assert line.startswith("artde-gym: warning: push can never happen")


def test_no_empty_line_precedes_the_output(tmp_path: Path) -> None:
    outcome = CliRunner().invoke(app, ["replay", *FLIGHT, "--out", str(tmp_path / "x.html")])
    assert outcome.output.startswith("Written to"), outcome.output


@pytest.mark.parametrize("more", [["--controllers", "tde,artde,pid"], ["--gains", '{"tde": {"k_p": "1"}}']])
def test_live_play_refuses_before_it_shows_an_address(more: list[str]) -> None:
    outcome = CliRunner().invoke(app, ["play", *FLIGHT, *more, "--no-browser"])
    assert isinstance(outcome.exception, (ArtdeGymError, GainError))
    assert "http" not in outcome.output


def test_an_algorithm_without_a_law_to_tune_says_so(tmp_path: Path) -> None:
    pytest.importorskip("cmaes", reason="cmaes is not installed (extra rl)")
    pytest.importorskip("torch", reason="torch is not installed (extra rl)")
    words = ["train", "--env", "QuadInfinity-Payload-v0", "--algo", "cma-es", "--steps", "10"]
    outcome = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "out")])
    assert "has no law of the robot 'q450'" in str(outcome.exception)
