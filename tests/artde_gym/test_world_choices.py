"""Choices of plausible worlds of any kind, settings that no factor sets, and worlds that are all alike."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from typer.testing import CliRunner

import artde_gym
from artde_gym import registration
from artde_gym.cli import app
from artde_gym.errors import ActionError, DisturbanceError, OptionError, StoreError
from artde_gym.report import multiverse_page, write_report
from artde_gym.studies import multiverse, read_multiverse
from artde_gym.studies.multiverse.console import print_multiverse
from artde_gym.studies.multiverse.design import design
from artde_gym.studies.multiverse.factor import Factor
from artde_gym.studies.multiverse.job import check_points
from artde_gym.studies.multiverse.result import Multiverse

pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra sweep)")

FLIGHT: dict[str, Any] = {
    "env": "QuadInfinity-Payload-v0",
    "disturbances": {},
    "env_kwargs": {"duration": 0.1},
    "controllers": ["tde", "artde"],
    "vectorized": True,
    "worlds": 4,
}
CHOICES = {
    "vectors": ("disturbances.payload.position", [[0, 0, -0.1], [0, 0, -0.2]]),
    "mappings": ("disturbances", [{}, {"wind": 1.0}]),
    "mixed": ("disturbances.payload.mass", [{"uniform": [0.1, 0.5]}, 0.3]),
    "numbers": ("disturbances.payload.mass", [0.1, 0.3]),
    "words": ("env_kwargs.measurement", ["ideal", "mocap"]),
}


def flight(path: str, values: list[Any], **others: Any) -> dict[str, Any]:
    return {**FLIGHT, "factors": {"x": {"path": path, "choice": values, "source": "a guess"}}, **others}


@pytest.mark.parametrize("kind", CHOICES)
def test_worlds_may_choose_between_values_of_any_kind(kind: str, tmp_path: Path) -> None:
    path, values = CHOICES[kind]
    made = flight(path, values, disturbances={"payload": 0.3} if kind == "vectors" else {})
    found = multiverse(made, tmp_path)
    assert found.complete
    chosen = [world.factors["x"] for world in found.design.worlds]
    assert all(value in chosen for value in values)
    assert len(set(found.episodes["factor.x"].tolist())) == 2
    assert set(found.factors([0, 1, 2, 3]).ravel().tolist()) == ({0.1, 0.3} if kind == "numbers" else {0.0, 1.0})
    again = multiverse(made, tmp_path)  # nothing is left to do, and the folder can be read
    assert len(again.episodes) == len(found.episodes)
    assert "0: " in write_report(tmp_path).read_text(encoding="utf-8") or kind == "numbers"


def test_choices_of_several_types_are_stored_as_text() -> None:
    factor = Factor.of("x", {"path": "disturbances", "choice": [{"wind": 1.0}, 0.3, "on"], "source": "a guess"})
    assert [factor.stored(value) for value in factor.arguments] == ['{"wind": 1.0}', "0.3", "on"]
    assert factor.numbers([0.3, {"wind": 1.0}]).tolist() == [1.0, 0.0]


@pytest.mark.parametrize("path", ["controller", "seed"])
def test_no_factor_sets_what_all_worlds_share_or_have_of_their_own(path: str) -> None:
    with pytest.raises(OptionError, match=f"'{path}' is not a setting of a world"):
        design(flight(path, ["tde", "artde"]))
    with pytest.raises(OptionError, match=f"'{path}' is not a setting of a world"):
        design(flight("disturbances.payload.mass", [0.1], set={path: "tde"}))


def test_a_path_is_set_once() -> None:
    for path, values in (("disturbances.payload.mass", [0.1]), ("disturbances.payload", [0.1]), ("disturbances", [{}])):
        with pytest.raises(OptionError, match="in 'set', and of a factor"):
            design(flight(path, values, set={"disturbances.payload.mass": 0.2}))


def test_a_value_inside_another_overrides_it_in_whatever_order() -> None:
    outer = {"path": "disturbances.payload", "choice": [0.1], "source": "a guess"}
    inner = {"path": "disturbances.payload.mass", "choice": [0.2], "source": "a guess"}
    for factors in ({"a": outer, "b": inner}, {"b": inner, "a": outer}):
        (point, *_) = design({**FLIGHT, "factors": factors}).points().values()
        assert point.cell.kwargs["disturbances"]["payload"] == {"mass": 0.2}


def test_the_message_names_the_distribution_once() -> None:
    factors = {"x": {"path": "env_kwargs.speed", "uniform": [3, 0], "source": "a guess"}}
    with pytest.raises(OptionError, match=r"^factor 'x'\.uniform is \[3, 0\]"):
        design({**FLIGHT, "factors": factors})


def test_a_path_to_a_disturbance_asks_for_a_scenario() -> None:
    with pytest.raises(OptionError, match="needs a scenario"):
        design(flight("disturbances.wind.scale", [1.0], disturbances=None)).points()


def test_where_all_worlds_are_alike_none_is_the_most_favorable(tmp_path: Path) -> None:
    file = tmp_path / "design.yaml"
    file.write_text(
        "env: QuadInfinity-Payload-v0\ndisturbances: {}\nenv_kwargs: {duration: 0.1}\ncontrollers: [tde, artde]\n"
        "vectorized: true\nworlds: 2\nfactors: {x: {path: disturbances.payload.mass, choice: [0.1, 0.2], source: x}}\n"
        "claims: [{survives: [artde, tde]}]\n"
    )
    words = ["multiverse", "--design", str(file), "--out", str(tmp_path / "out"), "--workers", "1"]
    outcome = CliRunner().invoke(app, words)
    assert outcome.exit_code == 0, outcome.output
    assert "favorable" not in outcome.output
    (verdict,) = read_multiverse(tmp_path / "out").verdicts
    assert (verdict.most_favorable, verdict.least_favorable) == (None, None)


def test_a_folder_without_an_episode_has_nothing_to_report(tmp_path: Path) -> None:
    multiverse(flight("disturbances.payload.mass", [0.1, 0.2]), tmp_path)
    for file in tmp_path.rglob("*.parquet"):
        file.unlink()
    with pytest.raises(StoreError, match="no finished episode"):
        write_report(tmp_path)


def by_hand(made: dict[str, Any], falls: list[bool]) -> Multiverse:
    """Results in which both controllers fall in the same worlds."""
    same = {"env": made["env"], "scenario": "custom", "duration_s": 1.0, "rmse_m": 1.0}
    rows = [
        {"world": world, "controller": name, "fell": fell, **same}
        for name in made["controllers"]
        for world, fell in enumerate(falls)
    ]
    return Multiverse(pd.DataFrame(rows), design({**made, "worlds": len(falls)}), Path(), True, {})


def test_survival_is_drawn_at_each_choice() -> None:
    made = flight("disturbances.payload.mass", [0.1, 0.3])
    heavy = [world.factors["x"] == 0.3 for world in design({**made, "worlds": 13}).worlds]
    survival = dict(multiverse_page.parts(by_hand(made, heavy)))["Survival"][1]
    assert "tde: 100 (" in survival
    assert "tde: 0 (" in survival
    assert f"% of {heavy.count(True)}<" in survival
    assert f"% of {heavy.count(False)}<" in survival


def test_a_report_says_how_many_worlds_a_tree_takes() -> None:
    pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra multiverse)")
    made = flight("disturbances.payload.mass", [0.1, 0.3])
    factors = dict(multiverse_page.parts(by_hand(made, [True] * 3 + [False] * 5)))["Factors"]
    assert "it takes two outcomes of 5 worlds each" in factors[-1]


def test_one_world_has_a_point_of_survival() -> None:
    factors = {"x": {"path": "disturbances.payload.mass", "uniform": [0.1, 0.3], "source": "a guess"}}
    assert "% of 1<" in dict(multiverse_page.parts(by_hand({**FLIGHT, "factors": factors}, [False])))["Survival"][1]


class Broken:
    """A controller whose actions are wrong where its gain is below zero."""

    def __init__(self, env: Any, gain: float = 1.0) -> None:
        self.action = np.full(4, 0.0 if gain > 0 else np.nan)

    def predict(self, observation: Any, *_: Any, **__: Any) -> tuple[Any, None]:
        return np.broadcast_to(self.action, (*observation.shape[:-1], 4)), None


@pytest.mark.parametrize("vectorized", [False, True])
def test_a_wrong_action_names_its_controller_and_world(
    vectorized: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(registration, "_controllers", {})
    artde_gym.register_controller("broken", f"{__name__}:Broken")
    names = ["tde", "broken"]
    made = flight("gains.broken.gain", [1.0, -1.0], controllers=names, vectorized=vectorized, claims=[{"order": names}])
    bad = next(world.number for world in design(made).worlds if world.factors["x"] < 0)
    with pytest.raises(ActionError, match=rf"^action[^(]* \(broken in custom, world {bad}\) is \[nan"):
        multiverse(made, tmp_path)


@pytest.mark.parametrize("vectorized", [False, True])
def test_a_world_that_is_refused_is_named(vectorized: bool) -> None:
    made = design(flight("disturbances.payload.mass", [0.1, 9.0], vectorized=vectorized))
    points = [(number, point) for (number, _), point in made.points().items()]
    bad = next(world.number for world in made.worlds if world.factors["x"] == 9.0)
    with pytest.raises(DisturbanceError, match=rf"^payload.mass \(world {bad}\) is 9"):
        check_points(points, vectorized, lambda *_: None)


def test_the_ends_of_a_range_are_checked_whatever_worlds_are_drawn(tmp_path: Path) -> None:
    factors = {"load": {"path": "disturbances.payload.mass", "quantiles": [0.1, 0.5, 9.0], "source": "a guess"}}
    made = {**FLIGHT, "factors": factors, "worlds": 1}
    assert all(world.factors["load"] < 5.0 for world in design(made).worlds)
    with pytest.raises(DisturbanceError, match=r"^payload.mass \(world 0 with factor 'load' at 9\.0\) is 9"):
        multiverse(made, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_without_claims_there_is_no_table_of_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = multiverse(flight("disturbances.payload.mass", [0.1], claims=[]), tmp_path)
    print_multiverse(found, Console(width=100))
    assert "reverses" not in capsys.readouterr().out
    assert next(name for name, _ in multiverse_page.parts(found)) == "Survival"
