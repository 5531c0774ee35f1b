"""Trainings with bad arguments: refused in one line, before anything is written; files are whole or not there."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")

from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError, OptionError
from baselines import run as run_module
from baselines.errors import TrainingError
from baselines.options import OPTIONS
from baselines.residual_config import ResidualConfig
from baselines.run import Training
from baselines.train import train
from controllers import GainError

QUADROTOR, BIPED = "QuadInfinity-Payload-v0", "BipedPush-v0"
SHORT = {"duration": 0.3}


def training(env: str = QUADROTOR, base: str = "tde", **more: Any) -> Training:
    recipe = ResidualConfig("q450" if env == QUADROTOR else "ojas", base)
    return Training(env, recipe, **{"envs": 2, "steps": 16, "env_kwargs": SHORT, **more})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"base": "nope"}, "controller is 'nope'"),
        (
            {"base": "tde+ppo", "options": {"n_steps": 8, "batch_size": 16}},
            "base 'tde[+]ppo' is a trained policy.*choose a law",
        ),
        ({"env_kwargs": {**SHORT, "engine": "mujoco"}}, "engine is 'mujoco'"),
        ({"env_kwargs": {**SHORT, "nope": 1}}, "argument of .* is 'nope'"),
        ({"env": BIPED, "env_kwargs": {**SHORT, "nope": 1}}, "argument of .* is 'nope'"),
        ({"env_kwargs": {**SHORT, "disturbances": {}}}, "pass it as `disturbances`"),
        ({"env_kwargs": {"duration": -1.0}}, "duration is -1"),
        ({"env_kwargs": {"duration": object()}}, "values that JSON can write"),
        ({"options": {"n_steps": 1, "batch_size": 2}, "envs": 1}, "arguments that go together"),
    ],
)
def test_bad_arguments_are_found_before_the_folder_is_claimed(tmp_path: Path, arguments: Any, words: str) -> None:
    with pytest.raises(ArtdeGymError, match=words):
        train(training(**arguments), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "field",
    [{"steps": True}, {"seed": -1}, {"seed": 2**32}, {"level": float("nan")}, {"workers": 0}, {"options": [1]}],
)
def test_fields_of_a_training_are_checked_at_construction(field: dict[str, Any]) -> None:
    with pytest.raises((TrainingError, OptionError), match=next(iter(field))):
        training(**field)


@pytest.mark.parametrize("algo", OPTIONS)
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -7, "word", [None], {}])
def test_options_without_sense_are_refused_by_name(algo: str, value: Any) -> None:
    with pytest.raises(OptionError, match=f"option of {algo} is 'unknown'"):
        training(algo=algo, options={"unknown": value})
    for name in OPTIONS[algo]:
        if (name, value) != ("log_std_init", -7) and (name, value) != ("target_entropy", -7):
            with pytest.raises(OptionError, match=f"options: {name}"):
                training(algo=algo, options={name: value})


@pytest.mark.parametrize("algo", ["ppo", "sac"])
def test_the_options_are_arguments_of_the_algorithm(algo: str) -> None:
    """A name that Stable-Baselines3 does not know would be found by a user."""
    import inspect

    import stable_baselines3

    known = inspect.signature(getattr(stable_baselines3, algo.upper()).__init__).parameters
    assert set(OPTIONS[algo]) - set(known) <= {"log_std_init", "net_arch"}  # of its policy


@pytest.mark.parametrize(
    "field",
    [
        {"robot": ["q450"]}, {"base": 3}, {"gains": [1]}, {"gains": {1: 1}}, {"action_mode": "x"}, {"action_mode": 0},
        {"action_mode": []}, {"decision_period": False}, {"decision_period": 1e9}, {"decision_period": "0.015"},
        {"decision_period": None}, {"action_scale": float("nan")},
        {"action_scale": -1.0}, {"action_scale": []}, {"gated": "no"}, {"gated": 1},
    ],
)  # fmt: skip
def test_fields_of_a_recipe_are_checked_at_construction(field: dict[str, Any]) -> None:
    with pytest.raises(OptionError, match=next(iter(field))):
        ResidualConfig(**{"robot": "q450", **field})


def test_a_disk_that_is_full_leaves_no_empty_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(OSError, match="No space"):
            run_module._claim(tmp_path, {"seed": 0})
    assert list(tmp_path.iterdir()) == []
    run_module._claim(tmp_path, {"seed": 0})
    assert json.loads((tmp_path / "run.json").read_text())["configuration"] == {"seed": 0}


@pytest.mark.parametrize(
    "arguments",
    [
        ["--options", '{"gamma": NaN}'],
        ["--options", "words"],
        ["--action-mode", "x"],
        ["--base", "nope"],
        ["--env-kwargs", '{"nope": 1}'],
        ["--seed", "-1"],
        ["--action-scale", "nan"],
        ["--gains", "[1]"],
        ["--gains", '{"k_p": -1}'],
        ["--decision-period", "0.02"],
    ],
)
def test_a_mistake_is_one_line(arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    with pytest.raises((ArtdeGymError, GainError)) as caught:  # of which `main` makes a line
        app(["train", "--env", QUADROTOR, "--out", str(out), *arguments], standalone_mode=False)
    assert len(str(caught.value).splitlines()) == 1
    assert capsys.readouterr() == ("", "")
    assert not out.exists()


def test_the_command_ends_with_code_2(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "artde_gym.cli", "train", "--env", QUADROTOR, "--out", str(tmp_path / "run")]
    outcome = subprocess.run([*command, "--base", "nope"], capture_output=True, text=True, check=False)
    assert outcome.returncode == 2
    assert (outcome.stdout, len(outcome.stderr.splitlines())) == ("", 1)
    assert "Traceback" not in outcome.stderr
