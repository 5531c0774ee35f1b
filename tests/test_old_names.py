"""Names of the release before: what users have written, and files that it has stored, still mean the same."""

from __future__ import annotations

import importlib
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.deprecation import NAMES, current_column, current_configuration, current_disturbances
from artde_gym.disturbances import Disturbances, DisturbanceSpec, Parameter
from artde_gym.errors import DisturbanceError, OptionError
from artde_gym.evaluation import evaluate
from artde_gym.kit import ROBOTS
from artde_gym.report.run import Run
from artde_gym.studies.frontier.axis import axis
from artde_gym.studies.sweep.design import design
from baselines.residual_config import ResidualConfig
from controllers.drive import DRIVES

QUADROTOR = "QuadInfinity-Payload-v0"
OLD: dict[str, Any] = {
    "payload": {"mass": 0.3, "attach": 0.01, "drop": {"uniform": [0.02, 0.04]}},
    "torque_delay": {"samples": 2},
    "mass_error": 1.1,
    "actuator_loss": [{"joint": "front_left", "factor": 0.9}],
    "wind": {"scale": 0.5, "fan_place": [0.8, 0.0, 0.7]},
}
NEW: dict[str, Any] = {
    "payload": {"mass": 0.3, "attach_time": 0.01, "detach_time": {"uniform": [0.02, 0.04]}},
    "action_delay": {"steps": 2},
    "mass_scale": 1.1,
    "actuator_effectiveness": [{"joint": "front_left", "factor": 0.9}],
    "wind": {"scale": 0.5, "fan_position": [0.8, 0.0, 0.7]},
}
SHORT: dict[str, Any] = {"env_kwargs": {"duration": 0.1}, "disturbances": NEW, "episodes": 1, "vectorized": True}


@pytest.mark.parametrize(("module", "old"), [(module, old) for module in NAMES for old in NAMES[module]])
def test_an_old_name_is_the_new_one(module: str, old: str) -> None:
    owner = importlib.import_module(module)
    with pytest.warns(DeprecationWarning, match=rf"{module}\.{old} is deprecated; use {NAMES[module][old]}"):
        found = getattr(owner, old)
    assert found is getattr(owner, NAMES[module][old])
    assert not hasattr(owner, "nothing")


def test_tables_of_all_robots_under_their_old_names() -> None:
    presets = importlib.import_module("controllers.presets")
    with pytest.warns(DeprecationWarning, match=r"DRIVES\[robot\]\.presets"):
        assert presets.PRESETS["q450"] == DRIVES["q450"].presets
    thesis = importlib.import_module("artde_gym.evaluation.thesis")
    with pytest.warns(DeprecationWarning, match=r"ROBOTS\[robot\]\.reported"):
        assert thesis.VALUES["S1"] == ROBOTS["ojas"].reported["S1"].values


def test_disturbances_under_old_names_are_drawn_as_under_new_ones() -> None:
    sites, rotors = ("body",), ("front_left", "front_right", "rear_left", "rear_right")
    with pytest.warns(DeprecationWarning, match="is deprecated; use"):
        old = Disturbances.parse(OLD, sites, rotors, "q450")
    assert old == Disturbances.parse(NEW, sites, rotors, "q450")
    with pytest.warns(DeprecationWarning, match="sample"):
        drawn = old.draw(np.random.default_rng(3))
    assert drawn == old.sample(np.random.default_rng(3))


@pytest.mark.parametrize(
    "both", [{"mass_error": 1.0, "mass_scale": 1.0}, {"payload": {"mass": 1.0, "drop": 1.0, "detach_time": 1.0}}]
)
def test_an_old_name_beside_the_new_one_is_refused(both: dict[str, Any]) -> None:
    with pytest.raises(DisturbanceError, match="its new name"):
        current_disturbances(both)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("disturbance.torque_delay.samples", "disturbance.action_delay.steps"),
        ("disturbance.payload.drop", "disturbance.payload.detach_time"),
        ("disturbance.actuator_loss.0.factor", "disturbance.actuator_effectiveness.0.factor"),
        ("disturbance.wind.fan_place.2", "disturbance.wind.fan_position.2"),
        ("disturbance.push.0.start", "disturbance.push.0.start"),
        ("recovery_time_s_drop", "recovery_time_s_drop"),
    ],
)
def test_columns(old: str, new: str) -> None:
    assert current_column(old) == new
    assert current_column(new) == new


def _as_of_before(folder: Path) -> None:
    """Put the old names into a results folder."""
    record = json.loads((folder / "summary.json").read_text())
    wanted = record["configuration"]
    wanted["backend"] = "batch" if wanted.pop("vectorized") else "single"
    wanted["traced"], wanted["trace_hz"] = wanted.pop("record_episodes"), wanted.pop("record_hz")
    wanted["cells"][0]["kwargs"]["disturbances"] = OLD
    (folder / "summary.json").write_text(json.dumps(record))
    table = (folder / "episodes.csv").read_text()
    olds = {"action_delay.steps": "torque_delay.samples", "detach_time": "drop", "attach_time": "attach"}
    for new, old in {**olds, "mass_scale": "mass_error", "actuator_effectiveness": "actuator_loss"}.items():
        assert new in table
        table = table.replace(new, old)
    (folder / "episodes.csv").write_text(table)


def test_a_folder_with_old_names_is_read_and_continued(tmp_path: Path) -> None:
    before = evaluate(["tde", "artde"], QUADROTOR, out=tmp_path, **SHORT)
    _as_of_before(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = evaluate(["tde", "artde"], QUADROTOR, out=tmp_path, **SHORT)
    assert again.episodes.equals(before.episodes)
    _as_of_before(tmp_path)
    run = Run.read(tmp_path)
    assert run.result.episodes.equals(before.episodes)
    assert run.cell("custom")["kwargs"]["disturbances"] == NEW


def test_old_arguments_of_an_evaluation() -> None:
    new = evaluate(["tde"], QUADROTOR, record_episodes=0, **SHORT)
    options = {**SHORT, "disturbances": OLD, "backend": "batch", "traced": 0, "trace_hz": 10.0}
    del options["vectorized"]
    with pytest.warns(DeprecationWarning, match="is deprecated; use"):
        old = evaluate(["tde"], QUADROTOR, **options)
    assert old.episodes.equals(new.episodes)
    with pytest.raises(OptionError, match="only 'vectorized', its new name"):
        evaluate(["tde"], QUADROTOR, backend="single", **SHORT)  # pyright: ignore[reportCallIssue]


@pytest.mark.parametrize(
    ("options", "old"),
    [
        (["evaluate", "--vectorized", "--backend", "single"], "--backend"),
        (["frontier", "--vary", "wind.scale", "--vectorized", "--backend", "single"], "--backend"),
        (["evaluate", "--record-episodes", "2", "--traced", "0"], "--traced"),
        (["evaluate", "--record-hz", "20", "--trace-hz", "50"], "--trace-hz"),
        (["train", "--action-mode", "attitude", "--channel", "cascade"], "--channel"),
        (["train", "--action-scale", "1", "--limit", "2"], "--limit"),
    ],
)
def test_an_old_option_beside_the_new_one_is_refused(options: list[str], old: str, tmp_path: Path) -> None:
    if options[0] == "train":
        pytest.importorskip("torch", exc_type=ImportError)
    words = [*options, "--env", QUADROTOR, "--out", str(tmp_path / "run")]
    outcome = CliRunner().invoke(app, words)
    assert outcome.exit_code != 0
    said = outcome.output + str(outcome.exception)
    assert old in said
    assert "its new name" in said


def test_old_options_of_the_command_line(tmp_path: Path) -> None:
    words = ["evaluate", "--env", QUADROTOR, "--controllers", "tde", "--episodes", "1", "--out", str(tmp_path / "run")]
    words += ["--env-kwargs", '{"duration": 0.1}', "--workers", "1"]
    outcome = CliRunner().invoke(app, [*words, "--backend", "batch", "--traced", "0", "--trace-hz", "50"])
    assert outcome.exit_code == 0, outcome.output
    for old, new in (("backend", "vectorized"), ("traced", "record-episodes"), ("trace-hz", "record-hz")):
        assert f"--{old} is deprecated; use --{new}" in outcome.output
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["configuration"]["vectorized"] is True
    help_text = CliRunner().invoke(app, ["evaluate", "--help"]).output
    assert "--vectorized" in help_text
    assert "--backend" not in help_text


def test_old_paths_of_a_frontier_and_of_a_sweep() -> None:
    with pytest.warns(DeprecationWarning, match=r"torque_delay\.samples"):
        assert axis("BipedPush-v0", "torque_delay.samples").path == "action_delay.steps"
    common = {"env": QUADROTOR, "controller": "tde", "disturbances": {}}
    new = design({**common, "vectorized": True, "grid": {"disturbances.mass_scale.factor": [1.0, 1.1]}})
    with pytest.warns(DeprecationWarning, match="of a sweep is deprecated"):
        old = design({**common, "backend": "batch", "grid": {"disturbances.mass_error.factor": [1.0, 1.1]}})
    assert old.points == new.points
    assert old.vectorized
    with pytest.raises(OptionError, match="backend"), pytest.warns(DeprecationWarning, match="backend"):
        design({**common, "backend": "both"})


def test_old_arguments_of_classes() -> None:
    recipe: Any = {"channel": "cascade", "limit": 1.5, "hold": 0.03}
    with pytest.warns(DeprecationWarning, match=r"argument '\w+' of ResidualConfig is deprecated; use '\w+'"):
        config = ResidualConfig("q450", **recipe)
    assert config == ResidualConfig("q450", action_mode="cascade", action_scale=1.5, decision_period=0.03)
    old_words: Any = {"words": ("a", "b")}
    with pytest.warns(DeprecationWarning, match="choices"):
        word: Any = Parameter("side", "", 0, 0, None, "", size=0, **old_words)
    assert word.choices == ("a", "b")
    old_fields: Any = {"scalar": "side", "repeated": True}
    with pytest.warns(DeprecationWarning, match="is deprecated; use"):
        old = DisturbanceSpec("x", "", (word,), "sites", **old_fields)
    assert old == DisturbanceSpec("x", "", (word,), "sites", shorthand="side", multiple=True)


def test_the_record_of_a_training() -> None:
    recipe = {"robot": "q450", "base": "tde", "channel": "cascade", "hold": 0.03, "limit": 1.5}
    found = current_configuration({"env_id": QUADROTOR, "recipe": recipe})
    named = {"action_mode": "cascade", "decision_period": 0.03, "action_scale": 1.5}
    assert found == {"env_id": QUADROTOR, "config": {"robot": "q450", "base": "tde", **named}}
