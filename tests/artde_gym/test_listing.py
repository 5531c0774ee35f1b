"""`artde-gym list`: all there is, from the tables that work with it."""

from __future__ import annotations

import json
from typing import Any

import gymnasium as gym
import pytest
from typer.testing import CliRunner

import controllers
from artde_gym.cli import app
from artde_gym.cli.catalog import TOPICS
from artde_gym.disturbances import DISTURBANCES
from artde_gym.registration import registered_controllers
from artde_gym.scenarios import SCENARIOS
from controllers.presets import named_gains


def listing(*arguments: str) -> str:
    outcome = CliRunner().invoke(app, ["list", *arguments], env={"COLUMNS": "80"})
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def test_everything_has_a_place_and_fits_a_narrow_terminal() -> None:
    for arguments in ([], *([topic] for topic in TOPICS)):
        text = listing(*arguments)
        assert max(map(len, text.splitlines())) <= 80
    text = listing()
    assert len(text.splitlines()) <= 60
    for name in (
        *SCENARIOS,
        *registered_controllers(),
        *DISTURBANCES,
        "BipedPush-v0",
        "wind.scale",
        "bullet, mujoco, batch",
    ):
        assert name in text
    text = listing("disturbances", "--name", "push")
    for word in ("torso", "chest", "0 to 500 N", "required", '{"uniform": [low, high]}'):
        assert word in text


@pytest.mark.parametrize("width", [60, 80])
def test_no_name_of_the_summary_is_broken_and_none_stands_twice_in_a_row(width: int) -> None:
    outcome = CliRunner().invoke(app, ["list"], env={"COLUMNS": str(width)})
    assert max(map(len, outcome.output.splitlines())) <= width
    words = {word.strip(",:") for word in outcome.output.split()}
    frontiers = TOPICS["frontiers"]()
    assert {*SCENARIOS, *registered_controllers(), *DISTURBANCES, *(entry["name"] for entry in frontiers)} <= words
    assert "gymnasium.make_vec" in outcome.output
    assert outcome.output.count("push.magnitude") < sum(entry["name"] == "push.magnitude" for entry in frontiers)


def test_a_name_of_a_preset_has_the_robots_with_that_preset() -> None:
    found = {entry["name"]: {one["robot"] for one in entry["presets"]} for entry in TOPICS["controllers"]()}
    assert found["tde-tight"] == {"q450"}
    assert found["tde-stiff"] == {"ojas"}
    assert found["artde-robust"] == {"arm", "ojas", "q450"}


def test_json_holds_the_gains_that_a_controller_has() -> None:
    """Every preset, built for the robot, has the very gains that are listed."""
    envs: dict[str, Any] = {
        "ojas": gym.make("BipedWalk-Payload-v0", disable_env_checker=True, duration=0.2),
        "arm": gym.make("ArmTrack-Payload-v0", disable_env_checker=True, duration=0.2, disturbances={}),
        "q450": gym.make("QuadSling-Payload-v0", disable_env_checker=True, duration=0.2),  # some laws need its cable
    }
    found = json.loads(listing("controllers", "--json"))
    assert [entry["name"] for entry in found] == list(registered_controllers())
    for entry in found:
        for preset in entry["presets"]:
            if (entry["name"] in ("pid", "tde+kd") and preset["robot"] != "q450") or entry["name"] == "tde+kd":
                continue  # the law's own gains are computed from these
            policy = controllers.make(entry["name"], envs[preset["robot"]], preset=preset["preset"])
            built = {name: _plain(value) for name, value in named_gains(policy.gains).items()}
            assert built == {name: gain["value"] for name, gain in preset["gains"].items()}, entry["name"]
            assert preset["source"]
    for env in envs.values():
        env.close()
    artde = next(entry for entry in found if entry["name"] == "artde")
    (default,) = [one for one in artde["presets"] if one["robot"] == "ojas" and one["default"]]
    assert default["gains"]["m_bar"] == {"value": 0.042, "unit": "kg m^2"}
    assert default["gains"]["cap"]["value"] == "inf"


def _plain(value: Any) -> Any:
    if value == float("inf"):
        return "inf"
    return list(value) if isinstance(value, tuple) else value


def test_json_holds_the_schemas_of_the_disturbances() -> None:
    found = {entry["name"]: entry for entry in json.loads(listing("disturbances", "--json"))}
    assert list(found) == list(DISTURBANCES)
    (mass, *_) = found["payload"]["parameters"]
    assert (mass["name"], mass["unit"], mass["required"]) == ("mass", "kg", True)
    assert found["payload"]["bare_number"] == "mass"
    assert "chest" in found["push"]["choices"]["ojas"]["body"]
    scenarios = json.loads(listing("--json"))["scenarios"]
    assert scenarios[0]["engines"][:2] == ["bullet", "mujoco"]


@pytest.mark.parametrize(
    "arguments", [["controler"], ["controllers", "--name", "artd"], ["--name", "artde"], ["scenarios", "--name", "S9"]]
)
def test_a_wrong_name_is_refused(arguments: list[str]) -> None:
    outcome = CliRunner().invoke(app, ["list", *arguments])
    assert outcome.exit_code == 1
    assert "allowed" in str(outcome.exception)
