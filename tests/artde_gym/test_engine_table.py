"""Engines from outside: one line makes one known to environments, to the command line and to the doctor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.errors import MissingDependencyError, OptionError
from artde_gym.sim.factory import ENGINES, EngineSpec, installed_engines, make_batch, register_engine, resolve_engine

MINE = """
from artde_gym.sim.mujoco import MujocoEngine


class MyEngine(MujocoEngine):
    name = "mine"
"""


@pytest.fixture(autouse=True)
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_engine.py").write_text(MINE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(ENGINES, "_entries", dict(ENGINES))
    register_engine(EngineSpec("mine", "Mine", "my_engine:MyEngine", "my-engine"))
    register_engine(EngineSpec("absent", "Absent", "no_such_engine:Engine", "no-such-engine"))


def walked(engine: str) -> Any:
    env: Any = gym.make("BipedWalk-Payload-v0", engine=engine, duration=0.2)
    assert env.unwrapped.engine_name == env.unwrapped.engine.name == engine
    env.reset(seed=0)
    return env.step(np.ones(12))[0]


def test_an_environment_runs_in_it() -> None:
    np.testing.assert_array_equal(walked("mine"), walked("mujoco"))


def test_it_is_listed_where_it_can_be_used() -> None:
    assert installed_engines()["mine"] == "Mine"
    assert "absent" not in installed_engines()
    assert resolve_engine(None) in ("bullet", "mujoco")


def test_one_that_is_not_there_says_what_to_install() -> None:
    with pytest.raises(MissingDependencyError, match="pip install 'no-such-engine'"):
        gym.make("BipedWalk-Payload-v0", engine="absent")


def test_an_unknown_one_is_refused_with_those_that_there_are() -> None:
    names: list[Any] = ["myne", 3, ["mine"]]
    for name in names:
        with pytest.raises(OptionError, match="'mine'"):
            resolve_engine(name)


def test_batches_are_of_engines_that_have_them() -> None:
    env: Any = gym.make("BipedWalk-Payload-v0", engine="mujoco", duration=0.2)
    with pytest.raises(OptionError, match="engine is 'mine'; allowed: 'mujoco'; single environments"):
        make_batch("mine", env.unwrapped.nominal_robot, 2, 0.001, 1)


def test_a_name_is_taken_once() -> None:
    with pytest.raises(OptionError, match="is taken"):
        register_engine(EngineSpec("mujoco", "Another", "my_engine:MyEngine", "my-engine"))
