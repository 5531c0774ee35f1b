"""A law from outside: registered in a line, it has the presets of the law that it is like, on every robot."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import artde_gym  # noqa: F401  (registers the environments)
import controllers
from artde_gym import registration
from artde_gym.cli import app
from artde_gym.cli.catalog import controllers as catalog
from artde_gym.errors import ArtdeGymError, OptionError, StoreError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.registration import GainRange, tuning_space
from artde_gym.studies import tune
from controllers import GainError, LawSpec
from controllers.design import design
from controllers.drive import DRIVES
from controllers.law_table import LAWS
from controllers.laws.tde import TdeGains
from controllers.presets import all_presets, law_presets
from controllers.registration import check_law

LAW = '''\
"""TDE whose estimate leaks: tau_k = (1 - leak L) tau_applied,k-1 + m_bar (u_k - a_k)."""

import dataclasses

from controllers import LawSpec
from controllers.laws.tde import TdeGains, tde, tde_init
from controllers.laws.tracking import Law


@dataclasses.dataclass(frozen=True)
class LeakyGains(TdeGains):
    leak: float = 0.5  # 1/s


def leaky_init(gains, signals, period):
    return tde_init(signals, period)


def leaky(gains, state, signals, period):
    kept = (1.0 - gains.leak * period) * signals.tau_applied
    return tde(gains, state, signals._replace(tau_applied=kept), period)


LEAKY = LawSpec(Law(leaky_init, leaky), LeakyGains, "TDE that leaks", like="tde", ranges={"leak": (0.05, 5.0)})
'''
SHORT = """

def short(gains, state, signals, period):
    force, state = leaky(gains, state, signals, period)
    return force[..., :1], state


SHORT = LawSpec(Law(leaky_init, short), LeakyGains, "one component", like="tde")
"""
SCALAR = """

def scalar(gains, state, signals, period):
    rate = 2.0 if gains.gamma_0 > 100.0 else 1.0
    force, state = artde(gains, state, signals, period)
    return force + 0.01 * rate * gains.gamma_0 * (signals.q_ref - signals.q), state


SCALAR = LawSpec(Law(artde_init, scalar), ArtdeGains, "gains that are numbers", like="artde")
"""
ROBOTS: dict[str, tuple[str, dict[str, Any]]] = {
    "ojas": ("BipedWalk-Payload-v0", {"duration": 0.2}),
    "q450": ("QuadInfinity-Payload-v0", {"duration": 0.3}),
    "arm": ("ArmTrack-Payload-v0", {"duration": 0.2}),
}


@pytest.fixture
def law(monkeypatch, tmp_path) -> Iterator[ModuleType]:
    (tmp_path / "leaky_law.py").write_text(LAW)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", dict(registration._controllers))
    controllers.register_law("leaky", "leaky_law:LEAKY")
    yield sys.modules["leaky_law"]
    del sys.modules["leaky_law"]


def make_env(robot: str) -> Any:
    env_id, kwargs = ROBOTS[robot]
    return gym.make(env_id, disable_env_checker=True, disturbances={}, **kwargs)


@pytest.mark.parametrize("robot", ROBOTS)
def test_it_runs_at_every_preset_and_without_its_term_is_the_law_that_it_is_like(law: Any, robot: str) -> None:
    presets = law_presets(DRIVES[robot], "tde")
    assert [*law_presets(DRIVES[robot], "leaky")] == [*presets]
    none = {"leak_p": 0.0, "leak_q": 0.0} if robot == "q450" else {"leak": 0.0}
    with make_env(robot) as env:
        first, _ = env.reset(seed=0)
        seen = first * np.random.default_rng(0).normal(1.0, 0.01, (5, first.size))
        for preset in presets:
            plain, own = (controllers.make(name, env, preset=preset) for name in ("tde", "leaky"))
            same = controllers.make("leaky", env, preset=preset, **none)
            states: list[Any] = [None, None, None]
            actions: list[np.ndarray] = []
            for observation in seen:
                actions = []
                for i, policy in enumerate((plain, same, own)):
                    action, states[i] = policy.predict(observation, states[i])
                    actions.append(action)
                np.testing.assert_array_equal(actions[0], actions[1])
            assert (actions[0] != actions[2]).any()


@pytest.mark.parametrize("robot", ROBOTS)
def test_it_is_evaluated_designed_and_has_tuning_ranges(law: Any, robot: str) -> None:
    env_id, kwargs = ROBOTS[robot]
    found = evaluate(["leaky", "tde"], env_id, episodes=1, disturbances={}, env_kwargs=kwargs)
    assert found.controllers == ["leaky", "tde"]
    for own, plain in zip(design(robot, "leaky"), design(robot, "tde"), strict=True):
        np.testing.assert_array_equal(own.eigenvalues, plain.eigenvalues)
        np.testing.assert_array_equal(own.stiffness, plain.stiffness)
    with make_env(robot) as env:
        added = [f"leak{suffix}" for suffix in (("_p", "_q") if robot == "q450" else ("",))]
        whole = tuning_space("tde", env) | dict.fromkeys(added, GainRange(0.5, 0.05, 5.0))
        assert tuning_space("leaky", env) == whole


def test_it_is_listed_and_the_commands_know_it(law: Any) -> None:
    (entry,) = [one for one in catalog() if one["name"] == "leaky"]
    assert entry["text"] == "TDE that leaks"
    assert entry["gains"] == ["m_bar", "k_p", "k_d", "leak"]
    assert {preset["robot"] for preset in entry["presets"]} == set(ROBOTS)
    for line in (["list", "controllers", "--name", "leaky"], ["design", "--robot", "arm", "--law", "leaky"]):
        answer = CliRunner().invoke(app, line)
        assert answer.exit_code == 0, answer.output


def test_it_is_tuned_by_workers_and_a_folder_knows_its_code(law: Any, tmp_path: Path) -> None:
    env_id, kwargs = ROBOTS["q450"]
    common: dict[str, Any] = {"env_kwargs": kwargs, "vectorized": True, "workers": 2}
    best = tune(["leaky"], env_id, trials=2, episodes=1, held_out=1, **common).best["leaky"]
    assert {"leak_p", "leak_q", "m_bar_p"} <= best.keys()
    folder = tmp_path / "run"
    evaluate(["leaky"], env_id, episodes=1, out=folder, env_kwargs=kwargs)
    (tmp_path / "leaky_law.py").write_text(LAW.replace("1.0 - ", "1.0 + "))
    del sys.modules["leaky_law"]
    with pytest.raises(StoreError, match="code of leaky: leaky"):
        evaluate(["leaky"], env_id, episodes=1, out=folder, env_kwargs=kwargs)


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('like="tde"', 'like="tdo"', "law that 'mine' is like.*'tdo'.*did you mean 'tde'"),
        ("leak: float = 0.5", "leak: float", "range of 'leak'.*is of a gain without a default; only.*: none has"),
        ('ranges={"leak"', 'ranges={"k_p"', "range of 'k_p'.*is of a gain without a default; only.*: leak"),
        ("leak: float = 0.5", "leak: float = 0.0", "range of 'leak'"),
        ('ranges={"leak"', 'ranges={"leek"', "range of 'leek'"),
        ("LeakyGains,", "None,", "range of 'leak'"),
        ("LEAKY =", "LEAK =", "cannot be imported"),
        ("LEAKY =", "LEAKY = 3\nLEAK =", "LawSpec"),
    ],
)
def test_a_law_that_cannot_be_one_is_refused_at_once(monkeypatch, tmp_path, before, after, words) -> None:
    assert before in LAW
    name = f"bad_law_{abs(hash((before, after)))}"
    (tmp_path / f"{name}.py").write_text(LAW.replace(before, after))
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ArtdeGymError, match=words):
        controllers.register_law("mine", f"{name}:LEAKY")
    assert "mine" not in registration.registered_controllers()


def test_a_law_of_one_component_too_few_is_refused_and_not_broadcast(monkeypatch, tmp_path) -> None:
    (tmp_path / "short_law.py").write_text(LAW + SHORT)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", dict(registration._controllers))
    controllers.register_law("short", "short_law:SHORT")
    with make_env("arm") as env, pytest.raises(OptionError, match=r"shape of the force of '.*' is \(1,\)"):
        controllers.make("short", env).predict(env.reset(seed=0)[0])


def test_further_gains_need_defaults_and_controllers_gains() -> None:
    spec = LAWS["tde"]
    with pytest.raises(OptionError, match=r"gain of 'mine' 'alpha' has no default, and no preset of 'tde'"):
        check_law("mine", LawSpec(spec.law, LAWS["artde"].gains, like="tde"))
    with pytest.raises(OptionError, match="gains of 'mine'"):
        check_law("mine", LawSpec(spec.law, like="tde"))
    with pytest.raises(UnknownNameError, match="module:object"):
        controllers.register_law("mine", "leaky")


@pytest.mark.parametrize("robot", ["q450", "arm"])
def test_a_law_whose_gains_are_numbers_gets_numbers_beside_itself_at_other_gains(monkeypatch, tmp_path, robot) -> None:
    imports = "from controllers.laws.artde import ArtdeGains, artde, artde_init"
    (tmp_path / "scalar_law.py").write_text(
        LAW.replace("import dataclasses\n", f"import dataclasses\n{imports}\n") + SCALAR
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", dict(registration._controllers))
    controllers.register_law("scalar", "scalar_law:SCALAR")
    env_id, kwargs = ROBOTS[robot]
    engine = {} if robot == "q450" else {"engine": "mujoco"}
    suffixes = ("_p", "_q") if robot == "q450" else ("",)
    gains = {name: {f"gamma_0{one}": rate for one in suffixes} for name, rate in (("low", 50.0), ("high", 200.0))}
    options: dict[str, Any] = {"episodes": 2, "env_kwargs": {**kwargs, **engine}, "vectorized": True}
    whole: Any = evaluate(dict.fromkeys(gains, "scalar"), env_id, gains=gains, **options).episodes
    for name, own in gains.items():
        alone: Any = evaluate({name: "scalar"}, env_id, gains={name: own}, **options).episodes
        one = whole[whole["controller"] == name].reset_index(drop=True)
        pd.testing.assert_frame_equal(one, alone, check_exact=True)


def test_a_policy_beside_objects_of_other_classes_is_not_stacked() -> None:
    with make_env("arm") as env:
        low, high = (controllers.make("artde", env, gamma_0=rate) for rate in (50.0, 200.0))
        assert low.stacked([low, high]) is not None
        assert low.stacked([low, high, object()]) is None


def test_names_of_this_projects_controllers_are_taken(law: Any) -> None:
    with pytest.raises(OptionError, match="name of a controller is 'artde'"):
        controllers.register_law("artde", "leaky_law:LEAKY")
    with pytest.raises(OptionError, match="name of a controller 'a/b' contains a slash"):
        controllers.register_law("a/b", "leaky_law:LEAKY")


def test_every_law_of_this_project_fits_its_family_and_a_robot() -> None:
    known = {law for drive in DRIVES.values() for law, _ in all_presets(drive)}
    for name, spec in LAWS.items():
        if spec.gains is not None:
            check_law(name, spec)
            assert name in known


def test_gains_are_those_of_the_named_law_but_for_a_robots_own(law: Any) -> None:
    for robot, drive in DRIVES.items():
        presets = all_presets(drive)
        for (of, name), preset in presets.items():
            if of == "tde+kd":
                assert preset.gains == presets["tde+c", name].gains
            if of == "pid" and robot != "q450":
                assert preset.gains == presets["tde", name].gains
    with make_env("q450") as env, pytest.raises(UnknownNameError, match="preset of 'pid'"):
        controllers.make("pid", env, preset="thesis")
    with make_env("arm") as env, pytest.raises(GainError, match="leek"):
        controllers.make("leaky", env, leek=1.0)
    assert isinstance(law.LEAKY.gains(0.1, 2.0, 3.0), TdeGains)
