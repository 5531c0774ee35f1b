"""Commands that need a package which is not here: one line that names it and what to install, and nothing written."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import pytest
import typer.main
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import MissingDependencyError, OptionError
from artde_gym.extras import needs, require
from artde_gym.sim import factory

FLIGHT = ["--env", "QuadInfinity-Payload-v0"]
SHORT = [*FLIGHT, "--controllers", "tde", "--out", "out", "--env-kwargs", '{"duration": 0.1}', "--disturbances", "{}"]
TRAINS = pytest.mark.torch  # without PyTorch, it is what is missing
NO_BULLET = "PyBullet has no wheel for CPython 3.13"
IN_ENGINES = {
    "evaluate": [*SHORT, "--episodes", "1"],
    "frontier": [*SHORT, "--episodes", "1", "--vary", "payload.mass"],
    "tune": [*SHORT, "--episodes", "1", "--trials", "1"],
    "train": [*FLIGHT, "--algo", "ppo", "--out", "out", "--steps", "1"],
    "video": [*FLIGHT, "--controllers", "tde", "--out", "out.gif"],
    "play": FLIGHT,
    "replay": [*FLIGHT, "--controllers", "tde", "--out", "out.html"],
    "multiverse": ["--design", "q450", "--worlds", "1", "--no-vectorized", "--out", "out"],
    "reproduce": ["--robot", "quadrotor", "--episodes", "1", "--out", "out"],
}


def refusal(words: list[str]) -> BaseException | None:
    return CliRunner().invoke(app, words).exception


def forget(prefixes: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let modules be imported anew, until the test ends; then their packages have the former ones again."""
    found = {name: module for name, module in sys.modules.items() if name.startswith(prefixes)}
    for name, module in found.items():
        package, _, own = name.rpartition(".")
        monkeypatch.delitem(sys.modules, name)
        if package in sys.modules:
            monkeypatch.setattr(sys.modules[package], own, module, raising=False)


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_these_are_all_commands_that_know_engines() -> None:
    commands = typer.main.get_group(app).commands
    assert {name for name, one in commands.items() for option in one.params if option.name == "engine"} == {*IN_ENGINES}


@pytest.mark.parametrize("command", IN_ENGINES)
def test_each_command_refuses_an_engine_that_is_missing(
    command: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(factory, "missing_bullet", lambda: NO_BULLET)
    error = refusal([command, *IN_ENGINES[command], "--engine", "bullet"])
    assert isinstance(error, MissingDependencyError)
    assert str(error) == f"engine 'bullet' is not available: {NO_BULLET}"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("package", "words", "extra"),
    [
        pytest.param("stable_baselines3", ["train", *IN_ENGINES["train"]], "rl", marks=TRAINS),
        ("torch", ["train", *IN_ENGINES["train"]], "rl"),
        pytest.param("tensorboard", ["train", *IN_ENGINES["train"]], "rl", marks=TRAINS),
        pytest.param(
            "cmaes", ["train", "--env", "BipedPush-v0", "--algo", "cma-es", "--out", "out"], "rl", marks=TRAINS
        ),
        ("optuna", ["tune", *IN_ENGINES["tune"]], "tune"),
        ("yaml", ["sweep", "sweep.yaml", "--out", "out"], "sweep"),
        ("pyarrow", ["sweep", "sweep.yaml", "--out", "out"], "sweep"),
        ("yaml", ["multiverse", *IN_ENGINES["multiverse"]], "multiverse"),
        ("pyarrow", ["multiverse", *IN_ENGINES["multiverse"]], "multiverse"),
        ("yaml", ["sweep", "sweep.yaml", "--out", "out", "--executor", "ray"], "scale"),
        ("pyarrow", ["sweep", "sweep.yaml", "--out", "out", "--executor", "ray"], "scale"),
        ("ray", ["sweep", "sweep.yaml", "--out", "out", "--executor", "ray"], "scale"),
        ("websockets", ["play", *FLIGHT], "play"),
        ("imageio_ffmpeg", ["video", *FLIGHT, "--controllers", "tde", "--out", "out.mp4"], "video"),
    ],
)
def test_each_command_says_which_extra_it_needs(
    package: str, words: list[str], extra: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    forget(("baselines.t", "artde_gym.studies.sweep.yaml12", "websockets", "artde_gym.play."), monkeypatch)
    monkeypatch.setitem(sys.modules, package, None)
    error = refusal(words)
    assert isinstance(error, OptionError), repr(error)
    assert f"pip install 'artde-gym[{extra}]'" in str(error)
    assert {"sklearn": "scikit-learn", "yaml": "pyyaml"}.get(package, package).replace("_", "-") in str(error)
    assert "\n" not in str(error)
    assert list(tmp_path.iterdir()) == []


EVERY_MODULE = """
import importlib, pkgutil, sys
sys.modules.update(dict.fromkeys(HIDDEN))
import artde_gym, baselines, controllers
from artde_gym.errors import MissingDependencyError
for package in (artde_gym, baselines, controllers):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not module.name.endswith("__main__"):
            try:
                importlib.import_module(module.name)
            except MissingDependencyError as error:
                print(module.name, "|", error)
"""
OPTIONAL = {
    "cmaes", "imageio_ffmpeg", "matplotlib", "moviepy", "optuna", "pyarrow", "pybullet", "pybullet_data", "ray",
    "sklearn", "stable_baselines3", "tensorboard", "torch", "tqdm", "websockets", "yaml",
}  # fmt: skip


def test_a_module_without_its_package_names_the_extra() -> None:
    """Any other exception ends the script."""
    script = EVERY_MODULE.replace("HIDDEN", repr(sorted(OPTIONAL)))
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    said = dict(line.split(" | ") for line in done.stdout.splitlines())
    assert said["baselines.train"].endswith("is not available: pip install 'artde-gym[rl]'")
    assert said["artde_gym.play.server"].endswith("'websockets' is not available: pip install 'artde-gym[play]'")
    assert said["artde_gym.sim.bullet"].startswith("engine 'bullet' is not available: PyBullet ")
    assert all("pip install" in one for one in said.values()), said


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ModuleNotFoundError("No module", name="stable_baselines3.common"), "package 'stable-baselines3' is not avail"),
        (ImportError("libfoo.so.1: no file\n", name="pyarrow._lib"), "cannot be imported (libfoo.so.1: no file); pip"),
        (
            ImportError("broken"),
            "package 'rl' is not available: it cannot be imported (broken); pip install 'artde-gym[",
        ),
    ],
)
def test_a_broken_package_is_told_from_a_missing_one(error: ImportError, said: str) -> None:
    with pytest.raises(MissingDependencyError) as caught, needs("rl"):
        raise error
    assert said in str(caught.value)
    assert caught.value.name == error.name
    again = pickle.loads(pickle.dumps(caught.value))
    assert (type(again), str(again), again.name) == (MissingDependencyError, str(caught.value), error.name)


def test_what_is_required_is_imported() -> None:
    require("rl", "json", "artde_gym.extras")
    with pytest.raises(ModuleNotFoundError, match=r"'no-such-package'.*artde-gym\[rl\]"):
        require("rl", "json", "no_such_package")
