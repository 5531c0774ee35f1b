"""Every option of every command, given what nobody should: an answer in one line, and never a run without an end."""

from __future__ import annotations

import contextlib
import signal
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import pytest
import typer.models
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError
from controllers import GainError

COMMANDS: dict[str, Any] = {
    command.name or str(getattr(command.callback, "__name__", "")): command.callback
    for command in app.registered_commands
}
ANSWERED = (ArtdeGymError, GainError, gym.error.Error, OSError)
"""What `artde_gym.cli.main` prints as one line."""
PATIENCE = 30  # s, after which a call counts as one without an end

SWEEP = """
env: QuadInfinity-Payload-v0
controller: pid
episodes: 1
disturbances: {}
env_kwargs: {duration: 0.1}
"""
MULTIVERSE = """
env: QuadInfinity-Payload-v0
controllers: [pid]
worlds: 1
disturbances: {}
env_kwargs: {duration: 0.1}
factors: {wind: {path: disturbances.wind.scale, uniform: [0, 1], source: a guess}}
"""
FLYER = ["--env", "QuadInfinity-Payload-v0", "--controllers", "pid", "--env-kwargs", '{"duration": 0.1}']
ONCE = ["--workers", "1", "--out", "out"]
QUICK: dict[str, list[str]] = {
    "evaluate": [*FLYER, *ONCE, "--episodes", "1", "--disturbances", "{}"],
    "frontier": [*FLYER, *ONCE, "--episodes", "1", "--disturbances", "{}", "--vary", "payload.mass",
                 "--low", "0.1", "--high", "0.2", "--tolerance", "0.1"],
    "tune": [*FLYER, *ONCE, "--episodes", "1", "--trials", "2", "--held-out", "1", "--disturbances", "{}"],
    "sweep": ["sweep.yaml", *ONCE],
    "multiverse": ["--design", "multiverse.yaml", *ONCE],
    "reproduce": ["--robot", "quadrotor", "--scenario", "Q1", "--controllers", "pid", "--episodes", "0", *ONCE],
    "train": ["--env", "BipedPush-v0", "--out", "out", "--algo", "none"],
    "report": ["empty"],
    "replay": ["empty", "--out", "x.html"],
    "video": [*FLYER, "--out", "x.png", "--width", "16", "--disturbances", "{}"],
    "play": ["--env", "nowhere"],
    "list": [],
    "benchmark": ["--quick", "--sections", "none"],
    "doctor": ["--checks", "none"],
    "design": ["--robot", "quadrotor"],
}  # fmt: skip
"""Arguments with which a command has next to nothing to do, or something to refuse at its end."""

pytestmark = pytest.mark.slow

NUMBERS = ["-1", "0", "nan", "inf", "-inf", "1e308", "1e-308", "1" + "0" * 30, "x", "", "0x10", "1,5", "[1]", "true"]
WORDS = ["", " ", ",", "x" * 300, "é" * 200, "[/1]", "../x", "none,none", "-", "null", "1e999", "{}", "\n", "tde,,pid"]
OBJECTS = [
    "", "null", "1", "[1]", '"x"', "{", "[" * 5000, '{"": 1}', '{"x": 1}', '{"pid": 1}', '{"pid": null}',
    '{"pid": [1]}', '{"pid": {"": 1}}', '{"pid": {"nope": 1}}', '{"pid": {"k_p_p": NaN}}', '{"pid": {"k_p_p": "x"}}',
    '{"pid": {"k_p_p": {"x": [1]}}}', '{"pid": {"preset": 1}}', '{"pid": {"law": 1}}', '{"pid": {"env": 1}}',
    '{"duration": NaN}', '{"duration": -1}', '{"duration": 1e308}', '{"duration": "x"}', '{"duration": [1]}',
    '{"control_period": 1e-308}', '{"control_period": null}', '{"width": 1e9}', '{"engine": 1}', '{"engine": [1]}',
    '{"render_mode": {}}', '{"measurement": []}', '{"disturbances": {}}', '{"num_envs": 2}', '{"self": 1}',
    '{"payload": 1e308}', '{"payload": NaN}', '{"payload": []}', '{"payload": {"mass": {"normal": [0, 1e308]}}}',
    '{"push": 1}', '{"push": [[]]}', '{"push": null}', '{"wind": {"scale": -1}}', '{"wind": {"scale": {"choice": []}}}',
]  # fmt: skip
PATHS = ["", ".", "file", "file/x", "/dev/null/x", "/proc/x/y", "x" * 300, "é" * 200, "a[/1]", "empty", "~nobody/x"]
JSON = {"gains", "disturbances", "env_kwargs", "options"}


class Option(NamedTuple):
    """Of a command: its flag ("" of an argument) and the type of its value."""

    command: str
    name: str
    flag: str
    kind: str

    @property
    def values(self) -> list[str]:
        if self.name in JSON:
            return OBJECTS
        return NUMBERS if self.kind in ("int", "float") else PATHS if self.kind == "Path" else WORDS

    def words(self, value: str) -> list[str]:
        """A quick call in which it has this value."""
        words = list(QUICK[self.command])
        if not self.flag:
            return [*words[1:], "--", value]
        if self.flag in words:
            place = words.index(self.flag)
            del words[place : place + 2]
        return [*words, f"{self.flag}={value}"]


def options(command: str, function: Any) -> Iterator[Option]:
    """Those of a command that take a value, by the annotations of its function."""
    for name, annotation in typing.get_type_hints(function, include_extras=True).items():
        if name == "return":
            continue
        of, info = typing.get_args(annotation)
        kind = next(one.__name__ for one in (typing.get_args(of) or (of,)))
        if kind != "bool":
            given = info.param_decls[0] if info.param_decls else f"--{name.replace('_', '-')}"
            yield Option(command, name, "" if isinstance(info, typer.models.ArgumentInfo) else given, kind)


OPTIONS = {f"{one.command} {one.name}": one for name, function in COMMANDS.items() for one in options(name, function)}


class EndlessError(Exception):
    """A call that goes on and on."""


@contextlib.contextmanager
def ending() -> Iterator[None]:
    """A call that does not end fails."""

    def end(*_: object) -> None:
        raise EndlessError

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(PATIENCE)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def test_every_command_is_here() -> None:
    assert COMMANDS.keys() == QUICK.keys()


@pytest.mark.parametrize("option", OPTIONS)
def test_whatever_an_option_is_given_there_is_an_answer(
    option: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, unanswered = OPTIONS[option], {}
    for number, value in enumerate(one.values):
        folder = tmp_path / str(number)
        (folder / "empty").mkdir(parents=True)
        (folder / "file").write_text("not a folder")
        (folder / "sweep.yaml").write_text(SWEEP)
        (folder / "multiverse.yaml").write_text(MULTIVERSE)
        monkeypatch.chdir(folder)
        with ending():
            error = CliRunner().invoke(app, [one.command, *one.words(value)]).exception
        refused = isinstance(error, SystemExit) and error.code in (1, 2)
        if not (error is None or isinstance(error, ANSWERED) or refused):
            unanswered[value[:80]] = f"{type(error).__name__}: {error}"
    assert unanswered == {}
