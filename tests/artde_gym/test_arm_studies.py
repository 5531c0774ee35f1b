"""An arm from a file, whose joints are other ones than the built-in arm's, in everything that reads its metrics."""

from __future__ import annotations

import itertools
import json
from typing import Any

import gymnasium as gym
import pytest
from typer.testing import CliRunner

import artde_gym
from artde_gym.cli import app
from artde_gym.evaluation.cells import Cell
from artde_gym.evaluation.environments import metrics_spec_of
from artde_gym.play.player import Player
from artde_gym.registration import registered_controllers
from artde_gym.studies import tune
from controllers import make
from tests.artde_gym.test_arm import small_arm

ID = "ArmTrack-Payload-v0"


@pytest.fixture
def arguments(tmp_path):
    """A crane: two joints turn (q1, q2), one slides (q3)."""
    return {"robot": str(small_arm(tmp_path)), "armature": 0.2, "duration": 0.3, "engine": "mujoco"}


def told(*words: str) -> str:
    outcome = CliRunner().invoke(app, list(words))
    assert outcome.exit_code == 0, outcome.output + repr(outcome.exception)
    return outcome.output


def rows_of(text: str, title: str) -> list[str]:
    """First words of the rows of the table below a title."""
    lines = text.split(title, 1)[1].split("─ \n", 1)[1].splitlines()
    return [line.split()[0] for line in itertools.takewhile(str.strip, lines)]


@pytest.mark.parametrize("vectorized", [[], ["--vectorized"]], ids=["single", "vectorized"])
def test_tables_and_reports_have_the_joints_of_the_file(arguments, tmp_path, vectorized):
    run = [
        "evaluate",
        "--scenario",
        "A1",
        "--controllers",
        "tde,artde",
        "--episodes",
        "2",
        "--workers",
        "1",
        *vectorized,
    ]
    text = told(*run, "--env-kwargs", json.dumps(arguments), "--out", str(tmp_path / "run"), "--report")
    assert rows_of(text, "RMS error (deg)") == ["q1", "q2"]
    assert rows_of(text, "RMS torque (Nm)") == ["q1", "q2", "q3"]
    report = (tmp_path / "run/report.html").read_text(encoding="utf-8")
    assert ">q2<" in report
    assert ">q4<" not in report
    told("replay", str(tmp_path / "run"), "--out", str(tmp_path / "replay.html"))


def test_its_gains_are_tuned_from_those_designed_for_it(arguments, tmp_path):
    found = tune(["tde"], scenario="A1", trials=1, episodes=1, held_out=1, env_kwargs=arguments)
    own = make("tde", gym.make(ID, **arguments)).gains
    assert found.best["tde"] == pytest.approx({"k_p": own.k_p, "k_d": own.k_d})


def test_an_episode_of_it_is_replayed_and_played(arguments, tmp_path):
    assert artde_gym.replay(["tde"], ID, env_kwargs=arguments, disturbances={}).html
    player = Player(Cell("custom", ID, arguments), "tde", registered_controllers()["tde"], {})
    player.reset(0, {})
    player.step()
    assert len(player.frame()) > 0


def test_its_metrics_are_those_of_the_environment(arguments):
    env: Any = gym.make(ID, **arguments).unwrapped
    told_of, own = metrics_spec_of(ID, arguments), env.metrics_spec
    assert [one.axes for one in (*told_of.errors, *told_of.efforts)] == [
        one.axes for one in (*own.errors, *own.efforts)
    ]
    assert [dict(one.axes) for one in metrics_spec_of(ID).errors] != [dict(one.axes) for one in own.errors]
