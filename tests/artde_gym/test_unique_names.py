"""Every scenario, controller and case counts once, however it is written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from artde_gym.errors import OptionError
from artde_gym.evaluation import evaluate
from artde_gym.studies import frontier, reproduce, tune
from artde_gym.studies.sweep.design import design
from artde_gym.video import video

SCENARIO: dict[str, Any] = {"scenario": "S2", "controller": "tde"}


def test_a_scenario_named_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="'Q1'"):
        evaluate(["tde"], scenario=["Q1", "Q1"], episodes=1, out=tmp_path / "run")
    with pytest.raises(OptionError, match="'Q1'"):
        reproduce("quadrotor", tmp_path / "run", scenarios=["Q1", "Q1"], controllers=["artde"], episodes=1)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    "controllers",
    [
        ["tde", "tde"],
        {"tde": "tde", " tde": "atde"},
        {"é": "tde", "e\u0301": "atde"},
        {"tde": "tde", "TDE": "atde"},  # one file of signals where a disk ignores case
        {"ß": "tde", "SS": "atde"},
    ],
)
def test_a_controller_named_twice_is_refused(tmp_path: Path, controllers: Any) -> None:
    with pytest.raises(OptionError, match="is given twice"):
        evaluate(controllers, scenario="Q1", episodes=1)
    with pytest.raises(OptionError, match="is given twice"):
        frontier(controllers, "QuadInfinity-Payload-v0", "wind.scale", episodes=1)
    with pytest.raises(OptionError, match="is given twice"):
        video(controllers, tmp_path / "film.gif", scenario="Q1")


def test_a_name_is_a_word() -> None:
    with pytest.raises(OptionError, match="name of a controller is 1"):
        evaluate({1: "tde", "1": "atde"}, scenario="Q1", episodes=1)  # pyright: ignore[reportArgumentType]


def test_tune_refuses_a_controller_named_twice() -> None:
    with pytest.raises(OptionError, match="is given twice"):
        tune(["tde", "tde"], scenario="Q1", trials=1)


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("gains.tde.k_p", [100, 100.0]),
        ("gains.tde.m_bar", [[1, 2, 3], [1.0, 2.0, 3.0]]),
        ("env_kwargs.control_period", [0.004, 4e-3]),
        ("env_kwargs.duration", [58, 58.0]),
        ("disturbances.payload", [1, 1.0, {"mass": 1}, {"mass": 1.0, "attach_time": 0}]),
        ("disturbances.payload", [{"uniform": [1, 2]}, {"mass": {"uniform": [1.0, 2.0]}}]),
        ("disturbances.friction", [0.8, {"coefficient": 0.8}]),
        ("disturbances", [{"payload": 1}, {"payload": {"mass": 1}}, {"payload": 1, "push": []}]),
    ],
)
def test_spellings_of_one_case_are_one_case(path: str, values: list[Any]) -> None:
    assert len({design({**SCENARIO, "grid": {path: [value]}}).points[0].id for value in values}) == 1
    assert len(design({**SCENARIO, "grid": {path: values}}).points) == 1


def test_a_default_that_is_spelled_out_is_the_case_without_it() -> None:
    plain, spelled = (design({**SCENARIO, "env_kwargs": given}).points[0] for given in ({}, {"control_period": 1e-3}))
    assert plain.id == spelled.id


@pytest.mark.parametrize(
    ("path", "values"),
    [
        ("gains.tde.k_p", [100, 100.5]),
        ("env_kwargs.self_collision", [True, 1]),
        ("env_kwargs.self_collision", [False, 0]),
        ("disturbances.payload", [1, {"mass": 1, "detach_time": 5}]),
        ("disturbances.payload", [1, {"uniform": [1, 1]}]),
    ],
)
def test_different_cases_stay_different(path: str, values: list[Any]) -> None:
    assert len(design({**SCENARIO, "grid": {path: values}}).points) == 2
