"""The plan of a study: what all studies refuse, with which error, and before anything is written."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from artde_gym.errors import OptionError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.plan import Plan
from artde_gym.studies import frontier, tune
from artde_gym.video import video

FLYER = "QuadInfinity-Payload-v0"
SHORT: dict[str, Any] = {"duration": 0.1}


def _evaluate(out: Path, controllers: Any = ("pid",), env_id: Any = FLYER, **options: Any) -> Any:
    return evaluate(controllers, env_id, out=out, **{"env_kwargs": SHORT, "episodes": 1, **options})


def _frontier(out: Path, controllers: Any = ("pid",), env_id: Any = FLYER, **options: Any) -> Any:
    given = {"env_kwargs": SHORT, "disturbances": {}, "episodes": 1, "low": 0.1, "high": 0.2, "tolerance": 0.1}
    return frontier(controllers, env_id, "payload.mass", out=out, **{**given, **options})


def _tune(out: Path, controllers: Any = ("pid",), env_id: Any = FLYER, **options: Any) -> Any:
    given = {"env_kwargs": SHORT, "trials": 1, "episodes": 1, "held_out": 1}
    return tune(controllers, env_id, out=out, **{**given, **options})


def _video(out: Path, controllers: Any = ("pid",), env_id: Any = FLYER, **options: Any) -> Any:
    return video(controllers, out / "picture.png", env_id, **{"env_kwargs": SHORT, **options})


STUDIES = [_evaluate, _frontier, _tune, _video]
BAD: dict[str, list[Any]] = {
    "controllers": [None, 3, "pid", [], [3], ["nobody"], ["pid", "pid"]],
    "env_id": [3, ["QuadInfinity-Payload-v0"]],
    "seed": [-1, 0.5, None, True],
    "disturbances": [3, "push", [("push", 1)]],
    "env_kwargs": [3, "duration", [("duration", 1)], {"disturbances": {}}],
}
BAD_OF_EPISODES: dict[str, list[Any]] = {
    "episodes": [0, -1, 1.5, None, True],
    "workers": [0, -1, 1.5, None],
    "vectorized": ["nothing", None, 3],
}


@pytest.mark.parametrize("field", [*BAD, *BAD_OF_EPISODES])
@pytest.mark.parametrize("study", STUDIES)
def test_all_studies_refuse_the_same_before_anything_is_written(
    study: Callable[..., Any], field: str, tmp_path: Path
) -> None:
    if study is _video and field in BAD_OF_EPISODES:
        return
    for value in {**BAD, **BAD_OF_EPISODES}[field]:
        with pytest.raises((OptionError, UnknownNameError)):
            study(tmp_path / "out", **{field: value})
        assert not (tmp_path / "out").exists(), f"{field} {value!r} has left a folder"


@pytest.mark.parametrize("scenario", [3, [], ["Q1", "Q1"], ["Q1", " Q1"], "nowhere", [["Q1"]]])
def test_scenarios_are_names_each_one_once(scenario: Any) -> None:
    with pytest.raises((OptionError, UnknownNameError)):
        Plan.of(["pid"], scenario=scenario)


def test_tuning_takes_names_of_one_scenario_since_an_object_has_its_own_gains() -> None:
    class Still:
        name = "still"

        def predict(self, observation: Any, state: Any = None, **_: Any) -> Any:
            return observation, state

    with pytest.raises(OptionError, match="controllers"):
        tune([Still()], FLYER)  # pyright: ignore[reportArgumentType]
    with pytest.raises(OptionError, match="scenario"):
        tune(["pid"], scenario=["Q1", "Q1-calm"])  # pyright: ignore[reportArgumentType]


def test_a_plan_is_frozen_and_its_parts_are_of_the_same_configuration() -> None:
    plan = Plan.of(["pid", "artde"], scenario=["Q1", "Q1-calm"], episodes=3, seed=4, gains={"pid": {"k_p_p": 2.0}})
    with pytest.raises(dataclasses.FrozenInstanceError):
        plan.seed = 5  # pyright: ignore[reportAttributeAccessIssue]
    part = plan.only(["pid"], plan.cells[1])
    same = Plan.of(["pid"], scenario="Q1-calm", episodes=3, seed=4, gains={"pid": {"k_p_p": 2.0}})
    assert part.configuration() == same.configuration()
    assert plan.total == 12
    assert part.total == 3


def test_a_plan_hands_out_what_is_left_episode_by_episode() -> None:
    plan = Plan.of(["pid", "artde"], scenario=["Q1", "Q1-calm"], episodes=2)
    done = {("Q1", "artde", 0), ("Q1-calm", "pid", 1)}
    left = [(task.cell.name, task.controller, *task.episodes) for task in plan.tasks(done)]
    every = [
        (scenario, name, episode) for episode in range(2) for scenario in ("Q1", "Q1-calm") for name in ("pid", "artde")
    ]
    assert left == [key for key in every if key not in done]
