"""Options of the command line: one notion of a robot's name, nothing given twice, nothing empty, nothing ignored."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError, UnknownNameError
from artde_gym.kit import ROBOTS, find_robot

ARM = "ArmTrack-Payload-v0"
SCENARIO = ["--scenario", "Q1", "--controllers", "tde", "--episodes", "1", "--workers", "1"]


def refusal(*words: str) -> str:
    outcome = CliRunner().invoke(app, words)
    assert isinstance(outcome.exception, ArtdeGymError), (words, outcome.output, outcome.exception)
    return str(outcome.exception)


def test_a_name_comes_before_a_title_and_a_shared_title_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    assert find_robot("biped", ROBOTS).name == "ojas"
    titled = {"my-arm": "arm", "dog": "biped"}
    for name, title in titled.items():
        monkeypatch.setitem(ROBOTS._entries, name, dataclasses.replace(ROBOTS["arm"], name=name, title=title))
    assert find_robot("arm", ROBOTS).name == "arm"
    assert find_robot("my-arm", ROBOTS).name == "my-arm"
    with pytest.raises(UnknownNameError, match="'ojas' or 'dog'"):
        find_robot("biped", ROBOTS)
    with pytest.raises(UnknownNameError, match="ojas"):
        find_robot("horse", ROBOTS)


@pytest.mark.parametrize("robot", ["ojas", "biped", "arm", "q450"])
def test_design_takes_a_robot_by_its_name_and_by_its_title(robot: str) -> None:
    assert CliRunner().invoke(app, ["design", "--robot", robot, "--json"]).exit_code == 0


@pytest.mark.parametrize("name", ["robot", "law", "preset", "period", "gains"])
@pytest.mark.parametrize("law", ["tde", "tde-switched"])
def test_an_argument_that_a_motion_lacks_is_named(name: str, law: str) -> None:
    assert f"{name!r}; allowed: actuator_inertia" in refusal("design", "--law", law, "--motion", f'{{"{name}": "x"}}')


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--cap", "0.01"], "cap is 0.01; allowed: a law that switches"),
        (["--law", "tde-switched", "--period", "0.001"], "period is 0.001; allowed: a law with one m_bar"),
        (["--figure", "x.png"], "'x.png'; allowed: the path of an SVG file"),
        (["--figure", "/nonexistent/x.svg"], "'/nonexistent/x.svg' is in a folder that does not exist"),
        (["--speed", "0.1", "--motion", '{"speed": 0.2}'], "contradicts the 0.1 of --speed"),
    ],
)
def test_design_refuses_an_option_that_would_do_nothing_or_cannot_be_met(words: list[str], said: str) -> None:
    assert said in refusal("design", *words)


@pytest.mark.parametrize("figure", ["x.png", "/nonexistent/x.svg"])
@pytest.mark.parametrize(
    "study", [["frontier", "--controllers", "tde", "--vary", "payload.mass"], ["multiverse", "--design", "ojas"]]
)
def test_a_study_refuses_its_figure_before_it_runs(study: list[str], figure: str) -> None:
    assert figure in refusal(*study, "--figure", figure)


@pytest.mark.parametrize("seed", ["0", "1"])
def test_a_seed_does_not_go_with_a_folder_even_if_it_is_the_default(seed: str, tmp_path: Path) -> None:
    assert f"--seed {seed} does not go with a folder" in refusal("replay", str(tmp_path), "--seed", seed)


@pytest.mark.parametrize("option", ["--action-scale", "--decision-period"])
def test_a_training_refuses_zero_in_place_of_the_default(option: str, tmp_path: Path) -> None:
    words = ["train", "--env", "BipedWalk-Payload-v0", "--out", str(tmp_path / "out"), option, "0"]
    assert f"{option} is 0.0; allowed: above 0" in refusal(*words)


def test_a_frontier_knows_all_of_its_scenarios_before_the_first_one_runs(tmp_path: Path) -> None:
    words = ["frontier", "--controllers", "tde", "--vary", "payload.mass", "--out", str(tmp_path / "out")]
    assert "one of the robot in BipedPush-v0" in refusal(*words, "--scenario", "S1,Q1")
    assert "did you mean 'S2'" in refusal(*words, "--scenario", "S1,s2")
    assert "is given twice" in refusal(*words, "--scenario", "S1,S1")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("asked", ["pictures", "videos"])
def test_a_report_of_a_study_has_neither_pictures_nor_videos(asked: str, tmp_path: Path) -> None:
    (tmp_path / "frontier.json").write_text("{}")
    assert f"{asked} True goes with the results of" in refusal("report", str(tmp_path), f"--{asked}")


def test_an_arms_design_has_no_preset() -> None:
    assert "preset 'designed' does not go with an arm" in refusal("design", "--env", ARM, "--preset", "designed")


def test_a_design_names_the_disturbances_that_have_no_part_in_it() -> None:
    given = '{"disturbances": {"payload": 1.0, "encoder_bits": 16, "joint_friction": {"scale": 2.0}}}'
    outcome = CliRunner().invoke(app, ["design", "--env", ARM, "--env-kwargs", given, "--json"])
    told = json.loads(outcome.output)
    assert told["left_out"] == ["payload", "joint_friction"]
    assert told["encoder_bits"] == 16


@pytest.mark.parametrize("command", ["evaluate", "frontier", "tune", "video", "replay", "play"])
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--engine", "mujoco", "--env-kwargs", '{"engine": "bullet"}'], "contradicts the 'mujoco' of --engine"),
        (["--env-kwargs", '{"duration": 1.0, "duration": 2.0}'], "'duration' is given twice"),
        (["--scenario", ""], "''"),
        (["--controllers", "tde,,artde"], "names with a comma"),
        (["--env", "BipedWalks-Payload-v0"], "did you mean 'BipedWalk-Payload-v0'"),
    ],
)
def test_what_is_given_twice_or_is_empty_is_refused(
    command: str, words: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    vary = ["--vary", "payload.mass"] if command == "frontier" else []
    own = {"play": ["--no-browser", "--port", "0"], "video": ["--out", "x.gif"]}.get(command, [])
    assert said in refusal(command, *words, *vary, *own)


def test_an_equal_engine_may_be_given_twice() -> None:
    words = ["--engine", "mujoco", "--env-kwargs", '{"engine": "mujoco"}', "--seed", "-1"]
    assert "seed" in refusal("evaluate", *SCENARIO, *words)
