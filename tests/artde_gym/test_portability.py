"""Without PyBullet, and without what POSIX or Linux alone have: imports, the default engine, messages, records."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from packaging.requirements import Requirement
from typer.testing import CliRunner

import artde_gym
from artde_gym.benchmark import measure, memory
from artde_gym.cli import app
from artde_gym.errors import MissingDependencyError, OptionError, StoreError
from artde_gym.evaluation import evaluate
from artde_gym.sim import factory

ROOT = Path(__file__).parents[2]
SHORT = {"duration": 0.1, "control_period": 0.004}

ALL_MODULES = """
OTHERS = {"torch", "stable_baselines3", "cmaes", "ray"}
import importlib, pkgutil, artde_gym, baselines, controllers
failed = {}
for package in (artde_gym, baselines, controllers):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if module.name.endswith("__main__"):
            continue
        try:
            importlib.import_module(module.name)
        except ImportError as error:
            if error.name not in OTHERS:
                failed[module.name] = str(error)
"""

BUT_BULLET = """
failed = {name: why for name, why in failed.items() if "pybullet" not in why}
"""

HIDE_BULLET = """
import sys
sys.modules.update(dict.fromkeys(["pybullet", "pybullet_data"]))
"""

HIDE_POSIX = """
import builtins, os, signal, socket, multiprocessing
import filelock, gymnasium, mujoco, numpy, pandas, platformdirs
import scipy.stats, typer, rich.console, PIL.Image
for name in ("sched_getaffinity", "getloadavg", "fork", "geteuid", "getuid", "killpg"):
    delattr(os, name)
for name in ("SIGKILL", "SIGALRM", "SIGHUP", "setitimer", "alarm", "pause"):
    delattr(signal, name)
real, hidden = builtins.__import__, {"fcntl", "resource", "termios", "pwd", "grp", "pty", "tty", "syslog", "curses"}
def only_portable(name, globals=None, *arguments, **more):
    importer = str((globals or {}).get("__name__"))
    if name in hidden and importer.startswith(("artde_gym", "baselines", "controllers")):
        raise ModuleNotFoundError(f"{name} in {importer}", name=name)
    return real(name, globals, *arguments, **more)
builtins.__import__ = only_portable
"""


def run(script: str) -> str:
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def no_bullet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(factory, "missing_bullet", lambda: "PyBullet has no wheel for CPython 3.13")


def test_every_module_but_bullets_own_imports_without_it() -> None:
    failed = json.loads(run(f"{HIDE_BULLET}{ALL_MODULES}import json\nprint(json.dumps(failed))"))
    assert failed.keys() == {"artde_gym.sim.bullet", "artde_gym.sim.pybullet_module"}


@pytest.mark.once
def test_no_module_needs_what_posix_alone_has() -> None:
    assert "nothing" in run(f"{HIDE_POSIX}{ALL_MODULES}{BUT_BULLET}print(failed or 'nothing')")


@pytest.mark.once
def test_an_evaluation_needs_nothing_of_posix(tmp_path: Path) -> None:
    call = ["evaluate", "--engine", "mujoco", "--env-kwargs", json.dumps(SHORT), "--out", str(tmp_path / "run"),
            "--episodes", "1", "--workers", "1", "--scenario", "S1", "--report"]  # fmt: skip
    run(f"{HIDE_POSIX}from artde_gym.cli import app\napp({call})")
    assert (tmp_path / "run" / "report.html").exists()


@pytest.mark.parametrize("name", ["BipedWalk-Payload-v0", "BipedPush-v0", "QuadInfinity-Payload-v0"])
def test_mujoco_is_the_default_without_bullet(name: str, no_bullet: None) -> None:
    env: Any = gym.make(name, duration=3.0)
    assert env.unwrapped.engine_name == env.unwrapped.engine.name == "mujoco"
    env.close()
    with pytest.raises(MissingDependencyError, match="'bullet' is not available: PyBullet has no wheel for"):
        gym.make(name, engine="bullet")
    assert issubclass(MissingDependencyError, OptionError)


@pytest.mark.bullet
def test_bullet_is_the_default_where_it_is() -> None:
    env: Any = gym.make("BipedPush-v0", duration=3.0)
    assert env.unwrapped.engine_name == env.unwrapped.engine.name == "bullet"
    env.close()


def test_the_message_tells_a_missing_wheel_from_a_missing_package(monkeypatch: pytest.MonkeyPatch) -> None:
    absent, broken = ModuleNotFoundError("No module", name="pybullet"), ImportError("undefined symbol", name="b3")
    monkeypatch.setattr(factory, "has_wheel", lambda *_: False)
    assert "has no wheel for CPython" in factory.why_no_bullet(absent)
    assert "artde-gym[bullet]" in factory.why_no_bullet(absent)
    monkeypatch.setattr(factory, "has_wheel", lambda *_: True)
    assert "pip install pybullet" in factory.why_no_bullet(absent)
    assert "undefined symbol" in factory.why_no_bullet(broken)


@pytest.mark.parametrize("version", [(3, 11), (3, 12), (3, 13), (3, 14)])
@pytest.mark.parametrize("system", ["linux", "darwin", "win32"])
@pytest.mark.parametrize("machine", ["x86_64", "aarch64", "arm64", "AMD64"])
@pytest.mark.parametrize("implementation", ["CPython", "PyPy"])
def test_the_dependency_has_the_marker_of_the_wheels(
    version: tuple[int, int], system: str, machine: str, implementation: str
) -> None:
    from importlib import metadata

    (wanted,) = [one for one in map(Requirement, metadata.requires("artde-gym") or ())
                 if one.name == "pybullet" and "extra" not in str(one.marker)]  # fmt: skip
    assert wanted.marker is not None
    here = {"python_version": ".".join(map(str, version)), "sys_platform": system, "platform_machine": machine,
            "implementation_name": implementation.lower()}  # fmt: skip
    assert wanted.marker.evaluate(here) == factory.has_wheel(implementation, version, system, machine)


def test_listings_say_that_bullet_is_not_here(no_bullet: None) -> None:
    for arguments in (["list"], ["list", "environments"]):
        shown = " ".join(CliRunner().invoke(app, arguments).output.split())
        assert "Not installed here: bullet. `artde-gym doctor` says why." in shown


def test_records_and_the_first_line_name_the_engine(tmp_path: Path, no_bullet: None) -> None:
    outcome = CliRunner().invoke(
        app,
        ["evaluate", "--scenario", "S1", "--controllers", "tde", "--episodes", "1", "--workers", "1", "--report",
         "--env-kwargs", json.dumps(SHORT), "--out", str(tmp_path / "run")],
    )  # fmt: skip
    assert outcome.exit_code == 0, outcome.output
    assert outcome.output.startswith("Engine: MuJoCo ")
    record = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert [cell["kwargs"]["engine"] for cell in record["configuration"]["cells"]] == ["mujoco"]
    assert record["provenance"]["engines"] == {"mujoco": "default"}
    assert "BipedWalk-Payload-v0 in MuJoCo" in (tmp_path / "run" / "report.html").read_text()


@pytest.mark.bullet
def test_a_folder_of_one_engine_does_not_go_on_in_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def evaluation() -> None:
        evaluate(["tde"], scenario="S1", episodes=1, out=tmp_path / "evaluate", env_kwargs=SHORT)

    evaluation()
    with monkeypatch.context() as patched:
        patched.setattr(factory, "missing_bullet", lambda: "not here")
        with pytest.raises(StoreError, match="other results"):
            evaluation()
    evaluation()


def test_memory_is_left_out_where_no_process_knows_its_own(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(memory, "MEMORY", tmp_path / "statm")
    assert "/proc" in measure(["memory"])["memory"].skipped


def test_opengl_is_the_systems_own_where_it_has_a_window_system(monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    from artde_gym.sim import opengl

    asked = []
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(opengl.importlib, "import_module", lambda name: asked.append(name) or _Contexts)
    before = dict(os.environ)
    opengl.context()
    assert asked == ["mujoco.gl_context"]
    assert dict(os.environ) == before


class _Contexts:
    @staticmethod
    def GLContext(width: int, height: int) -> None:  # MuJoCo's name
        assert (width, height) == (1, 1)


def test_the_package_is_found_without_its_checkout() -> None:
    assert artde_gym.__version__


def test_files_of_users_may_be_written_by_an_editor_on_windows(tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    from artde_gym.cli.arguments import given_disturbances
    from artde_gym.multibody.model_file import model_text, parsed
    from artde_gym.studies.sweep.design import read

    def written(name: str, text: str) -> Path:
        (tmp_path / name).write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
        return tmp_path / name

    assert given_disturbances(str(written("some.json", '{\n"payload": 1.3\n}\n'))) == {"payload": 1.3}
    assert read(written("sweep.yaml", "scenario: S1\nepisodes: 2\n")) == {"scenario": "S1", "episodes": 2}
    model = written("arm.urdf", '<?xml version="1.0" encoding="utf-8"?>\n<robot name="a"/>\n')
    assert parsed(model_text(model), "arm.urdf").tag == "robot"
