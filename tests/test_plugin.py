"""A robot from outside: the package in tests/plugin/, found by its entry points, goes through everything.

It is on the path of subprocesses alone, with the metadata that an installation would write. What they run is the code
of the tutorial.
"""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pandas as pd
import pytest
from documentation.blocks import blocks, commands
from PIL import Image

ROOT = Path(__file__).parents[1]
PLUGIN = ROOT / "tests/plugin"
PAGE = (ROOT / "docs/tutorials/own-robot.md").read_text(encoding="utf-8")
RUN = """
import json, sys, warnings
import artde_gym
warnings.filterwarnings("error", ".* is deprecated; use ", DeprecationWarning)
code, commands = json.load(sys.stdin)
exec(code)
if commands:
    from typer.testing import CliRunner
    from artde_gym.cli import app
    for words in commands:
        outcome = CliRunner().invoke(app, words, env={"COLUMNS": "200"})
        assert outcome.exit_code == 0, f"{words}: {outcome.output} {outcome.exception!r}"
        print(outcome.output)
"""
DOCTOR = """
import artde_gym.doctor.environments as checks
from controllers.stability_check import stability
checks.ours = lambda: ["TwoLinkArm-Swing-v0"]
from artde_gym.sim.factory import ENGINES
engines = [lambda name=name: checks.in_engine(name) for name in ENGINES]
for check in (*engines, checks.batch, checks.stable_baselines3, stability):
    for line in check():
        assert line.status in ("ok", "missing"), line
        print(line.what, line.status)
"""
BARE = """
import gymnasium as gym
import controllers
from artde_gym.errors import UnknownNameError
from controllers import GainError
env = gym.make("TwoLinkArm-Swing-v0", duration=0.1)
for law, gains in (("tde", {}), ("tde", {"m_bar": 0.06}), ("artde", {"nonsense": 1})):
    try:
        controllers.make(law, env, **gains)
    except GainError as error:
        print(error)
try:
    controllers.make("tde", env, preset="hand")
except UnknownNameError as error:
    print(error)
policy = controllers.make("tde", env, m_bar=0.06, k_p=100.0, k_d=20.0)
observation, _ = env.reset(seed=0)
assert policy.predict(observation)[0].shape == (2,)
"""
AGENT = """
import numpy as np
import gymnasium as gym
import controllers
from baselines.residual_config import ResidualConfig
from baselines.residual_env import ResidualEnv
env, plain = (gym.make("TwoLinkArm-Swing-v0", duration=0.2) for _ in range(2))
agent, policy = ResidualEnv(env, ResidualConfig("two-link-arm")), controllers.make("tde", plain)
agent.reset(seed=1)
observation, _ = plain.reset(seed=1)
state = None
for _ in range(3):
    *_, info = agent.step(np.zeros(2))
    for _ in range(10):  # 20 ms
        action, state = policy.predict(observation, state)
        observation, *_ = plain.step(action)
assert env.unwrapped._measure().tobytes() == observation.tobytes()
assert {"residual_tracking", "residual_effort"} <= info.keys()
agent.step(np.ones(2))
assert 0 < env.unwrapped._q[0] != plain.unwrapped._q[0]
"""

PLAY = """
import json
import numpy as np
from artde_gym.evaluation.plan import Plan
from artde_gym.play.game import Game
from artde_gym.play.text import start_text, told_text

def game(disturbances):
    return Game(Plan.of(["tde"], "TwoLinkArm-Swing-v0", disturbances=disturbances))

played = game(None)
about = json.loads(start_text(played))["start"]
assert about["able"] == {"push": True, "drop": True, "attach": True}
assert about["push"]["site"] == "tip" and about["joints"] == 2 and about["controllers"][0] == "artde"
orders = [{"do": "drop"}, {"do": "payload", "on": False}, {"do": "attach", "mass": 0.4}]
for order in [*orders, {"do": "push", "site": "tip", "force": [5, 0, 0]}]:
    played.do(order)
    assert played.refused == "", played.refused
    played.advance(0.3)
assert json.loads(told_text(played))["told"]["payload"] == "held"
played.do({"do": "drop"})
played.advance(0.2)
again = game(played.record.disturbances())
again.advance(played.time)
assert again.frame() == played.frame()
assert set(played.record.disturbances()) == {"payload", "push"}
"""


def install(folder: Path, groups: tuple[str, ...] = ("artde_gym.robots", "artde_gym.drives")) -> Path:
    """Write the metadata of an installation that brings some of the groups of entry points; returns its place."""
    project = tomllib.loads((PLUGIN / "pyproject.toml").read_text())["project"]
    info = folder / "site" / "two_link_arm-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    points = [f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in project["entry-points"][group].items())
              for group in groups]  # fmt: skip
    (info / "entry_points.txt").write_text("\n".join(points))
    return info.parent


def run(folder: Path, site: Path, code: str, calls: list[list[str]] | None = None) -> str:
    """Run code, and then commands, in a process that finds the robot; returns what it prints."""
    paths = os.pathsep.join((str(PLUGIN), str(site)))
    outcome = subprocess.run(
        [sys.executable, "-c", RUN],
        input=json.dumps([code, calls or []]),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert outcome.returncode == 0, f"{outcome.stdout[-3000:]}\n{outcome.stderr[-4000:]}"
    return outcome.stdout


@pytest.mark.torch
def test_the_tutorial_takes_a_robot_through_everything(tmp_path: Path) -> None:
    for package in ("optuna", "stable_baselines3"):
        pytest.importorskip(package)
    code = "\n".join(part.text for part in blocks(PAGE) if part.language == "python")
    said = run(tmp_path, install(tmp_path), code, commands(PAGE))
    assert "two-link-arm" in said  # of `list`
    rows = pd.read_csv(tmp_path / "run/episodes.csv")
    assert sorted(rows["controller"]) == ["artde", "tde"]
    assert set(rows["fell"]) == {False}
    assert max(rows["rmse_deg"]) < 2
    assert set(rows["disturbance.push.0.body"]) == {"tip"}
    page = (tmp_path / "run/report.html").read_text()
    assert "The swing under" in page  # pictures, by the kit's name of the motion
    assert "inside (0, 2)" in page  # m_bar, by the model's inertia
    assert (tmp_path / "frontier").is_dir()
    assert len(pd.read_csv(tmp_path / "tuning/trials.csv")) == 2
    assert (tmp_path / "training/policy/policy.json").is_file()
    with Image.open(tmp_path / "swing.gif") as film:
        assert getattr(film, "n_frames", 0) >= 3


def test_doctor_examines_it(tmp_path: Path) -> None:
    said = run(tmp_path, install(tmp_path), DOCTOR)
    assert "TwoLinkArm-Swing-v0 ok" in said
    assert "two-link-arm, joints ok" in said


def test_without_a_drive_it_has_the_joint_space_laws_and_no_presets(tmp_path: Path) -> None:
    first, second, third, fourth = run(tmp_path, install(tmp_path, ("artde_gym.robots",)), BARE).splitlines()
    assert "m_bar, k_p, k_d" in first
    assert "'two-link-arm' has no presets" in first
    assert "k_p, k_d" in second
    assert "nonsense" in third
    assert "none: the robot has no presets" in fourth


@pytest.mark.once
def test_a_residual_of_zero_is_the_base_and_any_other_accelerates_joints(tmp_path: Path) -> None:
    run(tmp_path, install(tmp_path), AGENT)


@pytest.mark.once
def test_it_can_be_played_with(tmp_path: Path) -> None:
    run(tmp_path, install(tmp_path), PLAY)


def test_a_plug_in_that_cannot_be_imported_is_named(tmp_path: Path) -> None:
    site = install(tmp_path)
    points = site / "two_link_arm-1.0.dist-info/entry_points.txt"
    points.write_text("[artde_gym.drives]\nbroken = no_such_module:DRIVE\n")
    code = (
        "from controllers.drive import DRIVES\ntry:\n    list(DRIVES)\nexcept Exception as error:\n    print(error)\n"
    )
    assert "no_such_module:DRIVE" in run(tmp_path, site, code)


def test_its_package_may_bring_controllers_whose_names_are_taken_then(tmp_path: Path) -> None:
    site = install(tmp_path)
    (site / "resting.py").write_text(
        "from artde_gym.registration import ControllerSpec\n"
        "class Rest:\n"
        "    def predict(self, observation, state=None, episode_start=None, deterministic=True):\n"
        "        return [0.0, 0.0], None\n"
        "def make(env):\n    return Rest()\n"
        "SPECS = (ControllerSpec('rest', 'resting:make', {}, 'no torque'),)\n"
    )
    points = site / "two_link_arm-1.0.dist-info/entry_points.txt"
    points.write_text(points.read_text() + "\n[artde_gym.controllers]\nresting = resting:SPECS\n")
    code = """
from artde_gym.errors import OptionError
try:
    artde_gym.register_controller("rest", "somewhere:else")
except OptionError as error:
    print(error)
"""
    short = ["--episodes", "1", "--workers", "1", "--env-kwargs", '{"duration": 0.2}', "--out", "run"]
    said = run(tmp_path, site, code, [["evaluate", "--scenario", "L1", "--controllers", "rest,tde", *short]])
    assert "any name except" in said
    assert sorted(pd.read_csv(tmp_path / "run/episodes.csv")["controller"]) == ["rest", "tde"]


@pytest.mark.once
def test_no_file_of_the_project_names_it() -> None:
    files = [file for package in ("artde_gym", "baselines", "controllers") for file in (ROOT / package).rglob("*.py")]
    assert files
    assert not [file for file in files if "two_link_arm" in (text := file.read_text()) or "two-link-arm" in text]


OWN = re.compile(
    r"artde_gym/(robots/(ojas|q450)/|envs/(biped|quadrotor))|controllers/(drives|presets)/(ojas|q450)"
    r"|baselines/((ojas|q450)\w*|legs|tune_balance)\.py"
)
"""Modules of the project's own robots; the linear balance law is the biped's."""


@pytest.mark.once
def test_its_own_robots_are_plug_ins_too() -> None:
    for package in ("artde_gym", "baselines", "controllers"):
        for file in (ROOT / package).rglob("*.py"):
            if not OWN.match(str(file.relative_to(ROOT))):
                for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                    if isinstance(node, ast.Constant) and node.value in ("ojas", "q450"):
                        pytest.fail(f"{file}:{node.lineno} names a robot")
                    if isinstance(node, (ast.ImportFrom, ast.Import)):
                        assert not re.search(r"ojas|q450", ast.unparse(node)), f"{file}:{node.lineno}"
