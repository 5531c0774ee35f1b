"""The frontier: bisection against known survival functions, paths and refusals, and a tiny run of the real thing."""

from __future__ import annotations

import functools
import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.disturbances import DISTURBANCES, Disturbances
from artde_gym.errors import ArtdeGymError, DisturbanceError, OptionError, StoreError, UnknownNameError
from artde_gym.evaluation import statistics
from artde_gym.evaluation.tasks import Update
from artde_gym.kit import ROBOTS
from artde_gym.palette import OTHERS, STYLES, styles
from artde_gym.report.frontier_page import survival_chart
from artde_gym.scenarios import scenario as find_scenario
from artde_gym.studies import Frontier, frontier
from artde_gym.studies.frontier.axis import Axis, axis
from artde_gym.studies.frontier.bisection import search
from artde_gym.studies.frontier.result import value_text
from artde_gym.studies.frontier.standard import standard_for, standard_test
from artde_gym.studies.frontier.table import LEVEL_COLUMNS, TABLE_COLUMNS, frontier_of
from controllers import GainError

PUSH = "BipedPush-v0"
QUADROTOR = "QuadInfinity-Payload-v0"
SVG = "{http://www.w3.org/2000/svg}"
SITES = ("torso", "chest", "left_arm", "left_foot", "right_foot")
SHORT: dict[str, Any] = {"duration": 0.3, "control_period": 0.004, "actuator_inertia": "lumped"}
TINY: dict[str, Any] = {"low": 1.0, "high": 2.0, "tolerance": 0.5, "episodes": 1, "disturbances": {}}


def tiny(controllers: Any = ("tde",), **kwargs: Any) -> Frontier:
    return frontier(controllers, PUSH, "payload.mass", **{**TINY, "env_kwargs": SHORT, **kwargs})


def grid(low: float, high: float, tolerance: float, harder: Any = "larger") -> Axis:
    return Axis("push", "magnitude", "N", low, high, tolerance, harder)


rate = functools.cache(statistics.rate)


def known(varied: Axis, edges: dict[str, float], runs: list[float] | None = None, episodes: int = 20) -> Frontier:
    """A frontier of controllers that survive up to (down to) their edge and fall in all episodes beyond."""
    rows: list[dict[str, Any]] = []

    def run(level: int, names: list[str]) -> dict[str, bool]:
        value = varied.levels[level]
        if runs is not None:
            runs.append(value)
        survived = {n: value <= edges[n] if varied.harder == "larger" else value >= edges[n] for n in names}
        for name, ok in survived.items():
            share = rate(episodes * ok, episodes)
            rows.append(dict(zip(LEVEL_COLUMNS, (value, name, episodes, episodes * ok, *share[:3]), strict=True)))
        return survived

    search(len(varied.levels), list(edges), run)
    return frontier_of(varied, list(edges), rows, 0.9, None, complete=True)


# ---------------------------------------------------------------- bisection


@given(
    low=st.floats(-100, 100),
    span=st.floats(0.1, 100),
    parts=st.floats(1, 300),
    edge=st.floats(-0.2, 1.2),
    harder=st.sampled_from(["larger", "smaller"]),
)
def test_bracket_holds_the_step_and_is_no_wider_than_the_tolerance(
    low: float, span: float, parts: float, edge: float, harder: Any
) -> None:
    varied = grid(low, low + span, span / parts, harder)
    step = low + edge * span
    runs: list[float] = []
    row = known(varied, {"a": step}, runs).table.iloc[0]
    assert len(runs) == len(set(runs)) <= 2 + math.ceil(math.log2(len(varied.levels)))
    if row["relation"] == "=":
        assert row["low"] <= step <= row["high"]
        assert 0 < row["high"] - row["low"] <= varied.tolerance * (1 + 1e-4)
        assert row["frontier"] == row["low" if harder == "larger" else "high"]
    elif row["relation"] in (">=", "<="):
        assert (step >= varied.high) if harder == "larger" else (step <= varied.low)
        assert row["frontier"] == (varied.high if harder == "larger" else varied.low)
    else:
        assert (step < varied.low) if harder == "larger" else (step > varied.high)


@given(edges=st.lists(st.integers(-2, 62), min_size=1, max_size=6))
def test_every_level_runs_once_for_all_that_need_it(edges: list[int]) -> None:
    runs: list[float] = []
    named = {f"c{i}": float(edge) for i, edge in enumerate(edges)}
    together = known(grid(0, 60, 2), named, runs)
    assert len(runs) == len(set(runs))
    for name, edge in named.items():
        alone = known(grid(0, 60, 2), {name: edge}).table.iloc[0]
        mine = together.table[together.table["controller"] == name].iloc[0]
        pd.testing.assert_series_equal(mine, alone, check_names=False)


@pytest.mark.parametrize(
    ("harder", "edge", "relation", "value", "text"),
    [
        ("larger", 29.0, "=", 28.0, "28 N"),
        ("larger", 99.0, ">=", 60.0, ">= 60 N"),
        ("larger", -1.0, "<", 0.0, "< 0 N"),
        ("smaller", 29.0, "=", 30.0, "30 N"),
        ("smaller", -1.0, "<=", 0.0, "<= 0 N"),
        ("smaller", 99.0, ">", 60.0, "> 60 N"),
    ],
)
def test_frontier_and_both_ends_of_the_range(harder: Any, edge: float, relation: str, value: float, text: str) -> None:
    found = known(grid(0, 60, 2, harder), {"a": edge})
    row = found.table.iloc[0]
    assert (row["relation"], row["frontier"]) == (relation, value)
    assert value_text(row.to_dict(), "N") == text
    if relation == "=":
        assert (row["low"], row["high"]) == (28.0, 30.0)
        survived, failed = ("low", "high") if harder == "larger" else ("high", "low")
        assert row[f"{survived}_rate"] == 1
        assert row[f"{failed}_rate"] == 0
        assert row[f"{survived}_rate_from"] == pytest.approx(statistics.rate(20, 20).low)
    else:
        assert np.isnan(row["low"]) != np.isnan(row["high"])


def test_survival_that_rises_again_is_shown_as_it_is() -> None:
    outcomes = search(9, ["a"], lambda level, names: {"a": level in (0, 1, 2, 5, 6)})
    assert outcomes == {"a": {0: True, 8: False, 4: False, 2: True, 3: False}}


# ---------------------------------------------------------------- paths


@pytest.mark.parametrize(
    ("env_id", "robot", "sites", "joints", "duration"),
    [
        (PUSH, "ojas", SITES, [f"left_q{i}" for i in range(1, 7)], 12.0),
        (QUADROTOR, "q450", ["body"], ["front_left"], 20.0),
    ],
)
def test_every_default_is_an_axis_and_every_level_of_it_is_in_the_grammar(
    env_id: str, robot: str, sites: Any, joints: list[str], duration: float
) -> None:
    standard = standard_for(env_id)
    assert standard is not None
    for path, default in standard.ranges.items():
        varied = axis(env_id, path)
        assert varied.path == path
        assert varied.harder == default.harder
        assert {varied.levels[0], varied.levels[-1]} == {default.low, default.high}
        assert np.abs(np.diff(varied.levels)).max() <= default.tolerance * (1 + 1e-5)
        given_, arguments = standard_test(env_id, path, {})
        assert arguments == {"duration": default.duration or duration}
        for value in varied.levels:
            disturbances, _ = varied.place(value, given_, arguments)
            Disturbances.parse(disturbances, sites, joints, robot)


def test_standard_test_is_the_same_but_for_what_is_varied() -> None:
    def test(path: str, env_id: str = PUSH) -> dict[str, Any]:
        return standard_test(env_id, path, {})[0]

    assert test("friction.coefficient")["payload"]["mass"] == 1.3
    assert [push["body"] for push in test("slope.pitch_deg")["push"]] == ["torso"]
    assert test("slope.pitch_deg")["friction"] == {"uniform": [0.7, 0.9]}
    (push,) = test("push.magnitude")["push"]
    assert (push["body"], push["duration"], push["start"]) == ("chest", 0.2, {"uniform": [5.0, 7.0]})
    assert [push["body"] for push in test("push.duration")["push"]] == ["torso"]  # its magnitude is the scenario's
    assert test("wind.scale", QUADROTOR)["payload"]["detach_time"] == 35.0
    assert "push" not in test("wind.scale", QUADROTOR)
    assert test("push.magnitude", QUADROTOR)["push"][0]["body"] == "body"
    (loss,) = test("actuator_effectiveness.factor", QUADROTOR)["actuator_effectiveness"]
    assert loss == {"joint": "front_left", "start": {"uniform": [6.0, 16.0]}}
    with pytest.raises(OptionError, match="duration is 6"):
        standard_test(PUSH, "push.magnitude", {"duration": 6})
    with pytest.raises(OptionError, match="an environment of artde_gym"):
        standard_test("CartPole-v1", "push.magnitude", {})


def test_a_scenario_keeps_a_pulse_of_which_other_than_the_size_is_varied() -> None:
    """A varied size completes the standard test's pulse, which replaces the scenario's."""
    pulse = find_scenario("S2-GRF45").disturbances["grf_pulse"]
    assert standard_test(PUSH, "grf_pulse.duration", {}, "S2-GRF45")[0]["grf_pulse"] == pulse
    assert "share" not in standard_test(PUSH, "grf_pulse.magnitude", {}, "S2-GRF45")[0]["grf_pulse"]
    options: dict[str, Any] = {**TINY, "disturbances": None, "env_kwargs": SHORT, "scenario": "S2-GRF45"}
    assert frontier(["tde"], PUSH, "grf_pulse.duration", **options).complete


@pytest.mark.once
def test_same_draws_at_every_level() -> None:
    varied = axis(PUSH, "push.magnitude")
    drawn = []
    for value in (varied.low, varied.high):
        disturbances, _ = varied.place(value, *standard_test(PUSH, varied.path, {}))
        sampled = Disturbances.parse(disturbances, SITES).sample(np.random.default_rng(3))
        assert sampled["push"][0].pop("magnitude") == value
        drawn.append(sampled)
    assert drawn[0] == drawn[1]


def test_place_leaves_the_rest_alone() -> None:
    given_: dict[str, Any] = {"payload": {"uniform": [1, 2]}, "push": {"magnitude": 3.0, "start": 1.0}, "friction": 0.8}
    magnitude = axis(PUSH, "push.magnitude")
    placed, arguments = magnitude.place(7.0, given_, {"speed": 0.1})
    assert placed == {**given_, "push": [{"magnitude": 7.0, "start": 1.0}]}
    assert arguments == {"speed": 0.1}
    two, _ = magnitude.place(7.0, {"push": [{"start": 1.0}, {"start": 2.0, "magnitude": 1.0}]}, {})
    assert [push["magnitude"] for push in two["push"]] == [7.0, 7.0]
    placed, _ = axis(PUSH, "payload.detach_time", 0, 9, 1).place(4.0, given_, {})
    assert placed["payload"] == {"mass": {"uniform": [1, 2]}, "detach_time": 4.0}
    assert axis(PUSH, "control_period").place(0.004, given_, {}) == (given_, {"control_period": 0.004})
    with pytest.raises(OptionError, match="no 'push' to vary"):
        magnitude.place(7.0, {"push": []}, {})


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"path": "push.magnitud"}, UnknownNameError, ["vary", "did you mean 'push.magnitude'"]),
        ({"path": "push.direction"}, UnknownNameError, ["push.direction"]),
        ({"path": "push.body"}, UnknownNameError, ["push.body"]),
        ({"path": "actuator_inertia"}, UnknownNameError, ["actuator_inertia"]),
        ({"path": "observe_ground_force"}, UnknownNameError, ["observe_ground_force"]),
        ({"path": "push.duration"}, OptionError, ["low", "push.duration"]),
        ({"path": "push.magnitude", "low": 60.0}, OptionError, ["low", "60", "below high"]),
        ({"path": "push.magnitude", "low": math.nan}, OptionError, ["low", "nan", "finite"]),
        ({"path": "push.magnitude", "low": "1"}, OptionError, ["low", "'1'", "finite"]),
        ({"path": "push.magnitude", "high": 501.0}, OptionError, ["high", "501", "0 to 500"]),
        ({"path": "push.magnitude", "tolerance": 0.0}, OptionError, ["tolerance", "0.0"]),
        ({"path": "push.magnitude", "tolerance": 61.0}, OptionError, ["tolerance", "60"]),
        ({"path": "push.magnitude", "harder": "bigger"}, OptionError, ["harder", "bigger", "'larger'"]),
        ({"path": "action_delay.steps", "tolerance": 0.5}, OptionError, ["tolerance", "0.5", "whole multiple of 1"]),
        ({"path": "control_period", "high": 0.0105}, OptionError, ["high", "0.0105", "whole multiple of 0.001"]),
        ({"path": "wind.scale"}, UnknownNameError, ["wind.scale", "push.magnitude"]),
    ],
)
def test_bad_axes_are_refused(arguments: dict[str, Any], error: type[ArtdeGymError], words: list[str]) -> None:
    with pytest.raises(error) as caught:
        axis(PUSH, **arguments)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(("env_id", "robot"), [(PUSH, "ojas"), (QUADROTOR, "q450")])
def test_paths_follow_the_grammar(env_id: str, robot: str) -> None:
    for kind in DISTURBANCES.values():
        for parameter in kind.parameters:
            known = kind.honored_by(robot) and parameter in kind.parameters_for(robot)
            if parameter.size == 1 and not known:
                with pytest.raises(UnknownNameError, match=kind.name):
                    axis(env_id, f"{kind.name}.{parameter.name}")
            elif parameter.size == 1:
                high = parameter.low + min(parameter.high - parameter.low, 10.0)
                span = high - parameter.low
                step = 1.0 if parameter.integer else span
                path = f"{kind.name}.{parameter.name}"
                assert axis(env_id, path, parameter.low, high, step).unit == parameter.unit


# ---------------------------------------------------------------- a tiny run


def test_folder_continuation_and_refusal(tmp_path: Path) -> None:
    folder = tmp_path / "run"

    def interrupt(value: float, update: Update) -> None:
        if value == 2.0:
            raise KeyboardInterrupt

    part = tiny(["tde", "artde"], out=folder, on_progress=interrupt)
    assert not part.complete
    assert part.levels["value"].tolist() == [1.0, 1.0]
    assert part.table["relation"].tolist() == ["", ""]
    assert not json.loads((folder / "frontier.json").read_text())["complete"]

    seen: list[tuple[float, Update]] = []
    found = tiny(["tde", "artde"], out=folder, on_progress=lambda *news: seen.append(news))
    assert found.complete
    assert {value for value, update in seen if update.ended} == {2.0}
    assert found.table["relation"].tolist() == [">=", ">="]  # 0.3 s of standing topples nobody
    assert found.levels["value"].tolist() == [1.0, 1.0, 2.0, 2.0]
    table, levels = pd.read_csv(folder / "frontier.csv"), pd.read_csv(folder / "levels.csv")
    assert list(table) == TABLE_COLUMNS
    pd.testing.assert_frame_equal(levels, found.levels, check_dtype=False)
    episodes = pd.read_csv(folder / "levels" / "2" / "episodes.csv")
    assert episodes["disturbance.payload.mass"].tolist() == [2.0, 2.0]
    record = json.loads((folder / "frontier.json").read_text())
    assert record["complete"]
    assert record["configuration"]["axis"]["tolerance"] == 0.5
    assert record["provenance"]["packages"]["mujoco"]

    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for other in ({"seed": 1}, {"tolerance": 0.25}, {"survival": 0.5}):
        with pytest.raises(StoreError, match="other results"):
            tiny(["tde", "artde"], out=folder, **other)
    assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"controllers": ["tdee"]}, UnknownNameError, ["tdee", "did you mean 'tde'"]),
        ({"controllers": []}, OptionError, ["controllers"]),
        ({"controllers": ["tde", "tde"]}, OptionError, ["tde", "twice"]),
        ({"survival": 0.0}, OptionError, ["survival", "0.0"]),
        ({"episodes": 0}, OptionError, ["episodes", "0"]),
        ({"gains": {"atde": {}}}, UnknownNameError, ["gains", "atde"]),
        ({"disturbances": {"friction": -1}}, DisturbanceError, ["friction", "-1"]),
        ({"disturbances": 3}, OptionError, ["disturbances", "3"]),
        ({"disturbances": {"payload": {1}}}, OptionError, ["disturbances", "JSON"]),
        ({"env_kwargs": {"durration": 1}}, OptionError, ["durration", "did you mean 'duration'"]),
        ({"env_kwargs": {"disturbances": {}}}, OptionError, ["env_kwargs", "disturbances"]),
        ({"vary": "speed", "low": 0.1, "high": 9.0}, OptionError, ["speed", "9"]),
        ({"vary": "gains.m_bar", "low": 0.0, "high": 0.06, "tolerance": 0.03}, GainError, ["m_bar", "0"]),
        ({"vary": "grf_pulse.duration", "disturbances": None}, OptionError, ["share", "pass `disturbances`, or a"]),
        (
            {"vary": "gains.m_bar", "gains": {"tde": {"m_bar": 0.05}}},
            OptionError,
            ["gain of 'tde'", "m_bar", "is varied"],
        ),
        ({"vary": "duration", "low": 0.2, "high": 0.3, "tolerance": 0.1}, OptionError, ["env_kwargs", "duration"]),
    ],
)
def test_bad_arguments_leave_no_folder_behind(
    arguments: dict[str, Any], error: type[Exception], words: list[str], tmp_path: Path
) -> None:
    def refuse(value: float, update: Update) -> None:
        raise AssertionError("an episode was begun")

    given_ = {"controllers": ["tde"], "vary": "payload.mass", **TINY, "env_kwargs": SHORT, **arguments}
    with pytest.raises(error) as caught:
        frontier(env_id=PUSH, out=tmp_path / "run", on_progress=refuse, **given_)
    for word in words:
        assert word in str(caught.value)
    assert not (tmp_path / "run").exists()


@pytest.mark.once
def test_quadrotors_in_batches(tmp_path: Path) -> None:
    """Four rotors lift 3.4 kg at most, the vehicle included: 0.5 kg are carried and 2.1 kg are not."""
    kwargs: dict[str, Any] = {"low": 0.5, "high": 2.1, "tolerance": 1.6, "episodes": 3, "env_kwargs": {"duration": 2.0}}
    found = frontier(["artde"], QUADROTOR, "payload.mass", vectorized=True, out=tmp_path / "run", **kwargs)
    row = found.table.iloc[0]
    assert row["relation"] == "="
    assert row["low_rate"] == 1.0
    assert row["high_rate"] == 0.0
    assert not list((tmp_path / "run").rglob("*.npz"))


def test_command(tmp_path: Path) -> None:
    arguments = ["frontier", "--vary", "control_period", "--controllers", "tde", "--episodes", "1", "--workers", "1"]
    arguments += ["--low", "0.002", "--high", "0.003", "--disturbances", "{}", "--out", str(tmp_path / "run")]
    kwargs = {"duration": 0.3, "actuator_inertia": "lumped"}
    outcome = CliRunner().invoke(app, [*arguments, "--env-kwargs", json.dumps(kwargs)])
    assert outcome.exit_code == 0, outcome.output
    for word in ("Frontier of control_period", "largest value", ">= 0.003", "100 % (21..100)", "Written to"):
        assert word in outcome.output
    assert ElementTree.fromstring((tmp_path / "run" / "frontier.svg").read_text()).tag == f"{SVG}svg"
    assert set((tmp_path / "run" / "levels").iterdir()) == {tmp_path / "run" / "levels" / n for n in ("0.002", "0.003")}


# ---------------------------------------------------------------- figure


@pytest.mark.parametrize("harder", ["larger", "smaller"])
def test_figure_of_every_outcome(harder: Any) -> None:
    names = {"tde": 20.0, "atde": 99.0, "artde": -9.0, "artde-robust": 31.0, "mine": 31.0}
    found = known(grid(0, 60, 2, harder), names)
    drawn = ElementTree.fromstring(survival_chart(found, legend=True).file())
    texts = ["".join(text.itertext()) for text in drawn.iter(f"{SVG}text")]
    assert len(names) == len([text for text in texts if text.partition(":")[0] in names])
    for row in found.table.to_dict(orient="records"):
        assert f"{row['controller']}: {value_text(row, found.axis.unit)}" in texts
    intervals = [part for part in drawn.iter(f"{SVG}path") if part.get("class") == "interval"]
    assert len(intervals) == len(found.levels)


def test_looks_are_fixed_and_tell_controllers_apart() -> None:
    assert styles(["artde", "tde"])["tde"] == styles(["tde"])["tde"] == STYLES["tde"]
    everything = [*STYLES.values(), *OTHERS]
    assert len({look.color for look in everything}) == len({look.marker for look in everything}) == len(everything)
    assert styles(["mine"]) == {"mine": styles(["tde", "mine"])["mine"]}
    many = styles(f"c{i}" for i in range(len(OTHERS)))
    assert len(set(many.values())) == len(OTHERS)
    assert len(styles(f"c{i}" for i in range(20))) == 20


@pytest.mark.parametrize(
    ("path", "low", "high", "harder"),
    [("torque_limit.limit", 5.0, 40.0, "smaller"), ("rotor_inertia.inertia", 0.01, 0.1, "larger")],
)
def test_what_is_harder_where_the_standard_test_does_not_say(path: str, low: float, high: float, harder: str) -> None:
    assert axis("BipedPush-v0", path, low, high, 0.01 * high).harder == harder


def test_kinds_and_standard_tests_agree_on_what_is_harder() -> None:
    for kit in ROBOTS.values():
        for path, default in kit.frontier.ranges.items() if kit.frontier is not None else ():
            kind, _, name = path.partition(".")
            for parameter in DISTURBANCES[kind].parameters if kind in DISTURBANCES else ():
                if parameter.name == name:
                    assert parameter.smaller_is_harder == (default.harder == "smaller"), path
