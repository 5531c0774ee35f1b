"""A registered name stands for one thing: its fixed arguments are no gains, on no path; and what is no controller."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import gymnasium as gym
import pytest

import artde_gym
import baselines
import controllers
from artde_gym import registration
from artde_gym.errors import ArtdeGymError, OptionError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.studies import frontier, sweep
from baselines.policy_file import DESCRIPTION, read, save
from baselines.saved import SHIPPED

QUADROTOR = "QuadInfinity-Payload-v0"
FIXED = [("tde", {"law": "pid"}), ("artde-robust", {"law": "tde"}), ("tde+ppo", {"policies": {}})]
NO_GAIN = r"gains of '.*stands for (law|policies) = "


@pytest.fixture
def registry(monkeypatch, tmp_path):
    monkeypatch.setattr(registration, "_controllers", registration.registered_controllers())
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def env():
    with gym.make(QUADROTOR, duration=0.3) as env:
        yield env


@pytest.mark.parametrize(("name", "gains"), FIXED)
def test_no_override_flies_something_else_under_a_name(env, name, gains, tmp_path):
    out = tmp_path / "run"
    swept: dict[str, Any] = {"env": QUADROTOR, "controller": name, "gains": {name: gains}}
    varied = {"env": QUADROTOR, "controller": name, "grid": {f"gains.{name}.{next(iter(gains))}": ["pid"]}}
    for run in (
        lambda: controllers.make(name, env, **gains),
        lambda: evaluate([name], QUADROTOR, gains={name: gains}, out=out),
        lambda: evaluate({"mine": name}, QUADROTOR, gains={"mine": gains}, out=out),
        lambda: frontier([name], QUADROTOR, "wind.scale", gains={name: gains}, out=out),
        lambda: sweep(swept, out),
        lambda: sweep(varied, out),
    ):
        with pytest.raises(OptionError, match=NO_GAIN):
            run()
        assert not out.exists()


def test_a_policy_files_recipe_overrides_gains_alone(env, tmp_path):
    saved = read(SHIPPED / "quadrotor-gale")
    save(tmp_path, saved)
    description = json.loads((tmp_path / DESCRIPTION).read_text())
    description["recipe"]["gains"] = {"law": "pid"}
    (tmp_path / DESCRIPTION).write_text(json.dumps(description))
    with pytest.raises(ArtdeGymError, match=NO_GAIN):
        baselines.load(tmp_path, env)
    save(tmp_path, saved._replace(config=dataclasses.replace(saved.config, gains={"k_p_p": 9.0})))
    baselines.load(tmp_path, env)


def test_preset_and_options_are_no_law(env):
    assert controllers.make("artde-robust", env, preset="thesis").gains == controllers.make("artde", env).gains


def test_fixed_arguments_of_a_users_controller_are_fixed(env, registry):
    (registry / "own_thrusts.py").write_text(
        "class Thrust:\n"
        "    def __init__(self, env, thrust, scale=1.0):\n"
        "        self.thrust = thrust * scale\n"
        "    def predict(self, *_):\n"
        "        return self.thrust, None\n"
    )
    artde_gym.register_controller("thrust", "own_thrusts:Thrust", thrust=4.0)
    assert controllers.make("thrust", env, scale=2.0).thrust == 8.0
    with pytest.raises(OptionError, match=r"'thrust': 5\.0.*stands for thrust = 4\.0"):
        controllers.make("thrust", env, thrust=5.0)


@pytest.mark.parametrize(
    ("point", "error", "words"),
    [
        (
            "no_such_module:make",
            UnknownNameError,
            "entry point of 'own' 'no_such_module:make' cannot be imported.*No module named",
        ),
        ("own_things:nothing", UnknownNameError, "'own_things:nothing'.*has no attribute"),
        ("own_things:number", UnknownNameError, "'own_things:number'.*function or class"),
        ("own_things:make_none", OptionError, "result of own_things:make_none is None.*`predict`"),
        ("own_things:number_of", OptionError, "result of own_things:number_of is 3.*`predict`"),
    ],
)
def test_what_is_no_controller_is_told_in_words(env, registry, tmp_path, point, error, words):
    (registry / "own_things.py").write_text(
        "number = 3\ndef make_none(env):\n    pass\ndef number_of(env):\n    return number\n"
    )
    artde_gym.register_controller("own", point)
    with pytest.raises(error, match=words):
        controllers.make("own", env)
    with pytest.raises(error, match=words):
        evaluate(["own"], QUADROTOR, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_search_space_that_cannot_be_imported_is_told_in_words(env, registry):
    artde_gym.register_controller("own", "own_things:make", tuning_space="no_such_module:space")
    with pytest.raises(UnknownNameError, match="entry point of 'own' 'no_such_module:space' cannot be imported"):
        registration.tuning_space("own", env)


@pytest.mark.parametrize("point", ["module", "a:b:c", ":make", "module:", ":", "", 3])
def test_entry_points_have_two_parts(registry, point):
    with pytest.raises(UnknownNameError, match="module:function"):
        artde_gym.register_controller("own", point)


@pytest.mark.parametrize("name", ["", 3, None, "a/b", "a,b", " a", "none", "matched"])
def test_a_name_is_one_of_files_and_lists(registry, name):
    with pytest.raises(OptionError, match="name of a controller"):
        artde_gym.register_controller(name, "module:make")


def test_names_of_this_project_are_taken(registry):
    before = registration.registered_controllers()
    with pytest.raises(OptionError, match=r"name of a controller is 'artde'; allowed: any name except"):
        artde_gym.register_controller("artde", "somewhere:else")
    assert registration.registered_controllers() == before
    for _ in range(2):  # of one's own, as a notebook's cell that is run again
        artde_gym.register_controller("own", "somewhere:else")
