"""Tuning: equal budgets, reproducible and resumable proposals, falls dearer than errors, and who refuses what."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import artde_gym
from artde_gym import registration
from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError, DisturbanceError, OptionError, StoreError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.registration import GainRange, registered_controllers, tuning_space
from artde_gym.studies import Tuning, tune

QUADROTOR = "QuadInfinity-Payload-v0"
BIPED = "BipedWalk-Payload-v0"
SHORT: dict[str, Any] = {"trials": 3, "episodes": 1, "held_out": 1, "env_kwargs": {"duration": 0.6}}


def gains_of(found: Tuning, name: str) -> list[dict[str, float]]:
    return [json.loads(row["gains"]) for row in found.trials.to_dict(orient="records") if row["controller"] == name]


@pytest.fixture
def lift(tmp_path, monkeypatch):
    """A controller with one gain, its constant thrust; the bare vehicle weighs 14.5 N."""
    (tmp_path / "lifting.py").write_text(
        "import numpy as np\n"
        "from artde_gym.registration import GainRange\n"
        "class Lift:\n"
        "    def __init__(self, env, thrust=4.0):\n"
        "        self.action = np.array([thrust, 0.0, 0.0, 0.0])\n"
        "    def predict(self, observation, state=None, episode_start=None, deterministic=True):\n"
        "        return self.action, None\n"
        "def tuning_space(env):\n"
        "    return {'thrust': GainRange(4.0, 3.0, 34.0)}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", registered_controllers())
    artde_gym.register_controller("lift", "lifting:Lift", tuning_space="lifting:tuning_space")


@pytest.mark.once
def test_finds_the_gain_that_flies_where_the_preset_falls(lift):
    found = tune(["lift"], QUADROTOR, trials=25, episodes=1, held_out=2, disturbances={}, env_kwargs={"duration": 1.5})
    assert found.metric == "rmse_m"
    first = found.trials.iloc[0]
    assert (first["falls"], first["cost"] > 1000.0, np.isnan(first["error"])) == (1, True, True)
    assert abs(found.best["lift"]["thrust"] - 1.48 * 9.81) < 0.5
    assert found.held_out is not None
    assert [found.held_out.falls("custom", name)[0] for name in ("lift", "lift-tuned")] == [2, 0]
    # a later fall costs less, and any flight less than any fall
    rows = found.trials.to_dict(orient="records")
    falling = sorted((json.loads(r["gains"])["thrust"], r["cost"]) for r in rows if r["falls"])
    sinking = [cost for thrust, cost in falling if thrust < 14.0]
    assert len(sinking) > 1
    assert sinking == sorted(sinking, reverse=True)
    assert max(row["cost"] for row in rows if not row["falls"]) < 10.0


def test_every_controller_gets_the_same_budget_and_its_preset_first():
    names = ["tde", "pid"]
    found = tune(names, QUADROTOR, **SHORT)
    assert found.trials.groupby("controller").size().to_dict() == {"tde": 3, "pid": 3}
    assert found.trials["trial"].tolist() == [0, 0, 1, 1, 2, 2]
    with gym.make(QUADROTOR) as env:
        for name in names:
            space, tried = tuning_space(name, env), gains_of(found, name)
            assert tried[0] == {gain: where.initial for gain, where in space.items()}
            assert tried[0] != tried[1] != tried[2]
            assert all(space[gain].low <= value <= space[gain].high for one in tried for gain, value in one.items())
            costs = [row["cost"] for row in found.trials.to_dict(orient="records") if row["controller"] == name]
            assert found.best[name] == tried[int(np.argmin(costs))]
    # the preset's trial is an evaluation like any other, and its episodes are not those of the comparison
    training = evaluate(["tde"], QUADROTOR, episodes=1, seed=0, env_kwargs=SHORT["env_kwargs"])
    assert found.trials.iloc[0]["cost"] == training.episodes.iloc[0]["rmse_m"]
    assert found.held_out is not None
    assert set(found.held_out.episodes["seed"]).isdisjoint(training.episodes["seed"])
    np.testing.assert_array_equal(found.held_out.controllers, ["tde", "tde-tuned", "pid", "pid-tuned"])


def contents(folder: Path) -> tuple[str, str, Any]:
    record = json.loads((folder / "tuning.json").read_text())
    return (folder / "trials.csv").read_text(), (folder / "held-out" / "episodes.csv").read_text(), record["best"]


def test_an_interrupted_run_continues_as_if_nothing_had_happened(tmp_path):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    names = ["tde", "geometric"]
    assert tune(names, QUADROTOR, out=whole, **SHORT).complete
    calls = 0

    def interrupt(what: str, update: Any) -> None:
        nonlocal calls
        calls += update.ended
        if calls == 3:  # in the second trial
            raise KeyboardInterrupt

    first = tune(names, QUADROTOR, out=broken, on_progress=interrupt, **SHORT)
    assert (first.complete, first.held_out, len(first.trials)) == (False, None, 2)
    assert json.loads((broken / "tuning.json").read_text())["complete"] is False
    second = tune(names, QUADROTOR, out=broken, **SHORT)
    assert contents(broken) == contents(whole)
    third = tune(names, QUADROTOR, out=broken, on_progress=lambda what, update: pytest.fail(what), **SHORT)
    pd.testing.assert_frame_equal(second.trials, third.trials)
    assert json.loads((broken / "tuning.json").read_text())["complete"] is True
    with pytest.raises(StoreError, match="trials"):
        tune(names, QUADROTOR, out=broken, **{**SHORT, "trials": 4})


@pytest.mark.once
def test_a_controller_is_tuned_alike_in_any_company():
    together = tune(["tde", "pid"], QUADROTOR, **SHORT)
    alone = tune(["pid"], QUADROTOR, **SHORT)
    assert gains_of(together, "pid") == gains_of(alone, "pid")
    other = tune(["pid"], QUADROTOR, seed=1, **SHORT)
    assert gains_of(other, "pid")[1:] != gains_of(alone, "pid")[1:]


@pytest.mark.once
def test_the_biped_is_tuned_too():
    kwargs = {"duration": 0.2, "actuator_inertia": "lumped", "control_period": 0.004}
    found = tune(["tde"], BIPED, **{**SHORT, "trials": 2, "env_kwargs": kwargs})
    assert found.metric == "rmse_deg"
    assert found.best["tde"].keys() == {"m_bar", "k_p", "k_d"}


@pytest.mark.parametrize(
    ("names", "options", "error", "words"),
    [
        (["artd"], {}, UnknownNameError, "'artd'.*did you mean 'artde'"),
        (["tde", "tde"], {}, OptionError, "given twice"),
        ("tde", {}, OptionError, "a list of names"),
        ([], {}, OptionError, "a list of names"),
        (["tde+balance"], {}, UnknownNameError, "to be tuned is 'tde.balance'"),
        (["computed-torque"], {}, UnknownNameError, "'q450' is 'computed-torque'"),
        (["tde"], {"trials": 0}, OptionError, "trials is 0"),
        (["tde"], {"held_out": 2.5}, OptionError, "held_out is 2.5"),
        (["tde"], {"env_kwargs": {"speed": 1}}, OptionError, "'speed'"),
        (["tde"], {"disturbances": {"wind": -1}}, DisturbanceError, "wind"),
        (["tde"], {"disturbances": {"wind": {1}}}, ArtdeGymError, "JSON"),
        (["tde"], {"scenario": "S1"}, OptionError, "S1"),
        (["tde"], {"vectorized": "both"}, OptionError, "'both'"),
    ],
)
def test_refusals_come_before_the_first_trial_and_leave_no_folder(tmp_path, names, options, error, words):
    with pytest.raises(error, match=words):
        tune(names, QUADROTOR, out=tmp_path / "run", **{**SHORT, **options})
    assert not (tmp_path / "run").exists()


def test_a_controller_without_ranges_says_so(monkeypatch):
    monkeypatch.setattr(registration, "_controllers", registered_controllers())
    artde_gym.register_controller("mine", "somewhere:make")
    with pytest.raises(UnknownNameError, match=r"to be tuned is 'mine'.*artde.*tde"):
        tune(["mine"], QUADROTOR, **SHORT)
    with pytest.raises(UnknownNameError, match="tuning_space"):
        artde_gym.register_controller("mine", "somewhere:make", tuning_space="nowhere")


@pytest.mark.parametrize("env_id", [QUADROTOR, BIPED])
def test_every_range_holds_its_preset(env_id):
    with gym.make(env_id) as env:
        spaces = {}
        for name in registered_controllers():
            try:
                spaces[name] = tuning_space(name, env)
            except UnknownNameError:
                continue
        assert {"tde", "atde", "artde", "artde-robust", "pid"} <= spaces.keys()
        for space in spaces.values():
            for where in space.values():
                assert isinstance(where, GainRange)
                assert 0 < where.low <= where.initial <= where.high


def test_without_optuna_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(OptionError, match=r"artde-gym\[tune\]"):
        tune(["tde"], QUADROTOR, **SHORT)


def test_command(tmp_path):
    arguments = ["tune", "--env", QUADROTOR, "--controllers", "tde,pid", "--trials", "2", "--episodes", "1"]
    arguments += ["--held-out", "2", "--workers", "1", "--out", str(tmp_path / "run")]
    outcome = CliRunner().invoke(app, [*arguments, "--env-kwargs", json.dumps(SHORT["env_kwargs"])])
    assert outcome.exit_code == 0, outcome.output
    text = " ".join(outcome.output.split())
    for words in ("Tuned gains beside the presets", "tde", "pid", "0/2", "k_p_q", "Written to"):
        assert words in text
    assert (tmp_path / "run" / "held-out" / "summary.json").exists()
