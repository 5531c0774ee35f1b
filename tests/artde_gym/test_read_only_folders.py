"""Places where nothing can be written: one line that says so and names the option, before anything is computed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer.main
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import StoreError

SHORT = ["--workers", "1", "--env-kwargs", '{"duration": 0.1}']
FOLDERS = {
    "evaluate": ["--scenario", "Q1", "--episodes", "1", *SHORT],
    "frontier": ["--env", "QuadInfinity-Payload-v0", "--vary", "payload.mass", "--episodes", "1", *SHORT],
    "tune": ["--scenario", "Q1", "--trials", "1", *SHORT],
    "sweep": ["sweep.yaml"],
    "multiverse": ["--design", "q450", "--worlds", "1"],
    "reproduce": ["--robot", "quadrotor", "--episodes", "1"],
}
"""Commands with a results folder of their own -> words with which they run in it."""
FILES = {
    "replay": ["--scenario", "Q1"],
    "video": ["--scenario", "Q1", "--out", "video.gif"],
    "benchmark": ["--json", "benchmark.json"],
}


def refusal(words: list[str]) -> BaseException | None:
    return CliRunner().invoke(app, words).exception


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sweep.yaml").write_text(json.dumps({"scenario": "Q1", "controller": "tde", "episodes": 1}))
    return tmp_path


def test_these_are_all_commands_that_choose_a_folder() -> None:
    commands = typer.main.get_group(app).commands
    choosing = {name for name, one in commands.items() for option in one.params
                if option.name == "out" and not option.required}  # fmt: skip
    assert choosing - {"replay"} == {*FOLDERS}


@pytest.mark.parametrize("command", FOLDERS)
def test_a_default_folder_that_cannot_be_made_is_named_with_the_option(command: str, here: Path) -> None:
    """Below a file no folder can be made, not even by root."""
    (here / "runs").write_text("")
    error = refusal([command, *FOLDERS[command]])
    assert isinstance(error, StoreError), repr(error)
    assert str(error).startswith("output folder 'runs")
    assert "--out" in str(error)
    assert sorted(path.name for path in here.iterdir()) == ["runs", "sweep.yaml"]


@pytest.mark.parametrize("command", FOLDERS)
def test_a_folder_that_is_not_writable_is_named_with_the_option(
    command: str, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def denied(path: str | Path, *_: object, **_others: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(os, "mkdir", denied)  # as the system answers all but root
    error = refusal([command, *FOLDERS[command]])
    assert isinstance(error, StoreError), repr(error)
    assert "is not writable ([Errno 13] Permission denied: 'runs" in str(error)
    assert "--out" in str(error)


@pytest.mark.linux
def test_a_current_folder_that_is_gone_is_named(here: Path) -> None:
    (here / "gone").mkdir()
    script = (
        f"import os; os.chdir({str(here / 'gone')!r}); os.rmdir(os.getcwd()); from artde_gym.cli import main; main()"
    )
    words = ["evaluate", "--scenario", "Q1", "--out", str(here / "out")]
    command = [sys.executable, "-P", "-c", script, *words]  # as the command, without the current folder in `sys.path`
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("artde-gym: current folder ")
    assert done.stderr.endswith("does not exist anymore; change to another one\n")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("command", FILES)
def test_a_file_in_a_read_only_folder_is_refused_first(
    command: str, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.access
    monkeypatch.setattr(
        os, "access", lambda path, mode, **more: not mode & os.W_OK and real(path, mode, **more)
    )  # as the system answers all but root
    error = refusal([command, *FILES[command]])
    assert isinstance(error, StoreError), repr(error)
    assert "is in a folder that is not writable; choose another place" in str(error)
    assert [path.name for path in here.iterdir()] == ["sweep.yaml"]
