"""Text of users on a terminal: brackets are brackets, labels are there at any width, and nothing is done in silence."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from rich.progress import Progress
from typer.testing import CliRunner

import artde_gym.cli
from artde_gym.cli import app
from artde_gym.cli.display import terminal, words
from artde_gym.errors import OptionError, UnknownNameError
from artde_gym.studies.frontier.axis import axis
from artde_gym.studies.sweep.console import print_sweep
from artde_gym.studies.sweep.execution import Sweep

FLYER = "--env QuadInfinity-Payload-v0 --controllers pid --episodes 1 --workers 1 --disturbances {}"


@pytest.mark.parametrize("command", ["evaluate", "frontier --vary payload.mass --low 0.1 --high 0.2 --tolerance 0.1"])
def test_brackets_in_a_folder_are_printed_as_they_are(command: str, tmp_path: Path) -> None:
    folder = tmp_path / "run[/1][red]:smile:"
    line = [*f"{command} {FLYER}".split(), "--env-kwargs", '{"duration": 0.1}', "--out", str(folder), "--report"]
    answer = CliRunner().invoke(app, line)
    assert answer.exit_code == 0, answer.output
    assert str(folder) in answer.output.replace("\n", "")


@pytest.mark.parametrize(
    "locale",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"PYTHONIOENCODING": "", "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    ],
)
def test_letters_that_a_terminal_does_not_know_end_nothing(locale: dict[str, str], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "artde_gym.cli", "evaluate", *FLYER.split(), "--env-kwargs", '{"duration": 0.1}']
    done = subprocess.run(
        [*command, "--out", "l\u00e4uft \u2192", "--report"], capture_output=True, text=True, cwd=tmp_path,
        env={**os.environ, **locale}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Report: l" in done.stdout
    (folder,) = tmp_path.iterdir()
    assert "l\u00e4uft \u2192 --report" in (folder / "report.html").read_text(encoding="utf-8")


def test_no_scenario_is_named_whose_disturbances_were_replaced(tmp_path: Path) -> None:
    answer = CliRunner().invoke(
        app, ["evaluate", *FLYER.split(), "--env-kwargs", '{"duration": 0.1}', "--out", str(tmp_path / "run")]
    )
    assert answer.exit_code == 0, answer.output
    assert list(pd.read_csv(tmp_path / "run" / "episodes.csv").scenario.unique()) == ["custom"]


def test_brackets_in_a_progress_bar() -> None:
    console = terminal()
    with console.capture() as printed, Progress(words("description"), console=console) as bar:
        bar.add_task("[/1] [red]")
    assert "[/1] [red]" in printed.get()


def test_commands_print_through_one_kind_of_console() -> None:
    for file in Path(str(artde_gym.cli.__file__)).parent.glob("*.py"):
        if file.name != "display.py":
            text = file.read_text(encoding="utf-8")
            assert "= Console(" not in text, file
            assert 'TextColumn("{' not in text, file


LABELS = {
    "gains.gamma_0": 123.456,
    "env_kwargs.control_period": 0.001,
    "disturbance.payload.mass": 1.25,
    "disturbance.push.0.magnitude": 17.0,
    "disturbance.friction.coefficient": 0.55,
    "disturbance.actuator_effectiveness.joint": "left_hip",
}


@pytest.mark.parametrize("width", [60, 80, 120, 250])
def test_every_label_of_a_sweep_is_there_at_any_width(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    first: dict[str, Any] = {
        "env": "BipedWalk-Payload-v0",
        "scenario": "S2",
        "controller": "artde",
        "fell": 0,
        **LABELS,
    }
    second = {**first, **{name: f"[/{i}]" for i, name in enumerate(LABELS)}}
    rows = [
        {"cell": str(i), "episode": episode, "rmse_deg": 0.5 + 0.01 * episode, **labels}
        for i, labels in enumerate((first, second))
        for episode in range(3)
    ]
    console = terminal()
    with console.capture() as printed:
        print_sweep(Sweep(pd.DataFrame(rows), Path("runs"), True), console)
    shown = printed.get()
    for name, value in LABELS.items():
        assert name.split(".", 1)[1] in shown
        assert str(value) in shown or f"{value:.4g}" in shown
    assert all(f"[/{i}]" in shown for i in range(len(LABELS)))
    assert "0/3" in shown


@pytest.mark.parametrize("scenario", ["S1", "Q1,S1"])
def test_a_scenario_of_another_robot_is_refused(scenario: str, tmp_path: Path) -> None:
    line = f"reproduce --robot quadrotor --scenario {scenario} --episodes 1 --out {tmp_path / 'x'}"
    answer = CliRunner().invoke(app, line.split())
    assert isinstance(answer.exception, OptionError)
    assert str(answer.exception) == "scenario is 'S1'; allowed: a scenario of the robot 'quadrotor'"
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("env_id", ["BipedPush-v0", "QuadInfinity-Payload-v0"])
@pytest.mark.parametrize("path", ["width", "height"])
def test_a_frontier_varies_nothing_of_pictures(env_id: str, path: str) -> None:
    with pytest.raises(UnknownNameError, match="vary") as caught:
        axis(env_id, path, 16.0, 32.0, 16.0)
    assert "width" not in str(caught.value).split("allowed")[1]
