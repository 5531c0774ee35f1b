"""Whole grids of the frontier: rates against counts by hand, half points of known curves, levels side by side."""

from __future__ import annotations

import dataclasses
import importlib
import json
import math
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError, OptionError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.statistics import rate
from artde_gym.evaluation.tasks import Update
from artde_gym.report import frontier_page
from artde_gym.studies import Frontier, frontier
from artde_gym.studies.frontier.axis import Axis, Harder
from artde_gym.studies.frontier.console import print_frontier
from artde_gym.studies.frontier.half import COLUMNS, half_difference, half_point, half_text
from artde_gym.studies.frontier.result import direction_note, rising_note
from artde_gym.studies.frontier.standard import standard_test
from artde_gym.studies.frontier.table import LEVEL_COLUMNS, frontier_of
from artde_gym.studies.reproduce.claims import outlasts
from controllers import GainError

TASKS = importlib.import_module("artde_gym.evaluation.tasks")
PUSH, WALK = "BipedPush-v0", "BipedWalk-Payload-v0"
GRID = [float(value) for value in range(20, 62, 2)]
SHORT: dict[str, Any] = {"duration": 0.3, "actuator_inertia": "lumped"}


def steps(edges: list[float], grid: list[float] = GRID) -> np.ndarray:
    """Seeds that survive every level up to an edge of their own."""
    return np.array([[float(value <= edge) for value in grid] for edge in edges])


# ---------------------------------------------------------------- half points of known curves


def test_a_sharp_step_lies_between_its_levels() -> None:
    """All seeds survive 36 and none 38: the grid says no more than that."""
    assert half_point(steps([36.0] * 20), GRID) == (37.0, 36.0, 38.0, 20)


@pytest.mark.once
def test_the_interval_covers_the_true_half_point() -> None:
    """Edges scatter about 41 with a standard deviation of 4: about 95 % of the intervals contain 41."""
    rng = np.random.default_rng(0)
    estimates = [half_point(steps(rng.normal(41.0, 4.0, 20).tolist()), GRID) for _ in range(40)]
    assert np.mean([estimate.value for estimate in estimates]) == pytest.approx(41.0, abs=0.5)
    assert sum(estimate.low <= 41.0 <= estimate.high for estimate in estimates) >= 36
    for estimate in estimates:
        assert estimate.low <= estimate.value <= estimate.high


@pytest.mark.parametrize(
    ("edge", "value", "text"), [(99.0, math.inf, "> 60 (60..> 60)"), (0.0, -math.inf, "< 20 (< 20..20)")]
)
def test_beyond_the_grid(edge: float, value: float, text: str) -> None:
    estimate = half_point(steps([edge] * 9), GRID)
    assert estimate.value == value
    row = dict(zip(("half", "low", "high"), estimate[:3], strict=True))
    assert half_text(row, Axis("grf_pulse", "magnitude", "N", 20.0, 60.0, 2.0, "larger")) == text


def test_smaller_is_harder() -> None:
    """Friction: survived down to 0.4, no more at 0.35."""
    grid = [0.5, 0.45, 0.4, 0.35, 0.3]
    table = np.array([[1.0, 1.0, 1.0, 0.0, 0.0]] * 5)
    assert half_point(table, grid) == (pytest.approx(0.375), 0.35, 0.4, 5)
    assert half_point(0 * table, grid).value == math.inf
    assert half_point(0 * table + 1, grid).value == -math.inf


def test_survival_that_rises_again_is_levelled() -> None:
    """1, 0, 1, 0 becomes 1, 1/2, 1/2, 0, which stays at one half from 22 to 24 N."""
    assert half_point([[1.0, 0.0, 1.0, 0.0]] * 4, [20.0, 22.0, 24.0, 26.0])[:3] == (23.0, 20.0, 26.0)


def test_survival_that_rises_to_the_hardest_level_has_no_half_point() -> None:
    """With the wrong end as the harder one, 0, 0, 1, 1 would read as "survives everything"."""
    wrong, right = [[0.0, 0.0, 1.0, 1.0]] * 5, [[1.0, 1.0, 0.0, 0.0]] * 5
    grid = [0.03, 0.05, 0.07, 0.09]
    estimate = half_point(wrong, grid)
    assert np.isnan(estimate[:3]).all()
    assert np.isnan(half_difference(right, wrong, grid)[:3]).all()
    row = dict(zip(("half", "low", "high"), estimate[:3], strict=True))
    assert half_text(row, Axis("gains", "m_bar", "kg m^2", 0.03, 0.09, 0.02, "larger")) == "none, since survival rises"
    assert half_point(right, grid[::-1]).value == pytest.approx(0.06)


@pytest.mark.parametrize(("harder", "asked"), [("larger", "--harder smaller"), ("smaller", "")])
def test_a_hardest_level_that_is_survived_more_often_raises_a_question(harder: Harder, asked: str) -> None:
    varied = Axis("gains", "m_bar", "kg m^2", 0.03, 0.05, 0.02, harder)
    rows: list[dict[str, Any]] = [
        {
            "value": value,
            "controller": "tde",
            "episodes": 5,
            "survived": 5 * rate,
            "rate": rate,
            "low": 0.0,
            "high": 1.0,
        }
        for value, rate in [(0.03, 0.0), (0.05, 1.0)]
    ]
    assert asked in (note := direction_note(frontier_of(varied, ["tde"], rows, 0.9, None, True)))
    assert bool(note) == bool(asked)


@pytest.mark.parametrize(("survived", "said"), [(6, "tde from 50 to 60 N"), (2, "")])
def test_a_rise_between_levels_is_told(survived: int, said: str) -> None:
    """Of 6 walks 6, 0 and then 6 again: intervals 0..39 and 61..100 %; 2 of 6, 10..70 %, may be chance."""
    varied = Axis("grf_pulse", "magnitude", "N", 40.0, 60.0, 10.0, "larger")
    rows = [
        dict(zip(LEVEL_COLUMNS, (value, "tde", 6, count, *rate(count, 6)[:3]), strict=True))
        for value, count in ((40.0, 6), (50.0, 0), (60.0, survived))
    ]
    found = frontier_of(varied, ["tde"], rows, 0.9, None, complete=True)
    assert rising_note(found) == ""  # a bisection stops at the first level that is not survived
    half = pd.DataFrame([("tde", 45.0, 40.0, 50.0, 6)], columns=["controller", "half", "low", "high", "episodes"])
    note = rising_note(dataclasses.replace(found, half=half))
    assert said in note
    assert bool(note) == bool(said)


def test_episodes_that_were_not_run_count_for_nothing() -> None:
    whole = steps([30.0] * 3)
    part = np.vstack([whole, [1.0] * 4 + [math.nan] * 17])
    assert half_point(part, GRID)[:3] == half_point(whole, GRID)[:3]


def test_a_single_episode_has_no_interval_and_none_has_no_half_point() -> None:
    grid, one = [1.0, 2.0, 3.0], [[1.0, 1.0, 0.0]]
    half, low, high, count = half_point(one, grid)
    assert (half, count) == (2.5, 1)
    assert np.isnan([low, high]).all()
    assert half_point([*one, [1.0, math.nan, math.nan]], grid)[3] == 1  # the fewest of a level
    assert half_text({"half": half, "low": low, "high": high}, M_BAR) == "2.5"
    gap = half_difference(one, [[1.0, 0.0, 0.0]], grid)
    assert (gap.value, gap.n, np.isnan(gap[1:3]).all()) == (1.0, 1, True)
    verdict = outlasts(("artde", "tde"))(found({"artde": [40.0], "tde": [30.0]}))
    assert (verdict.outcome, verdict.measured) == ("undecided", "artde beyond tde by +10 N")
    for none in ([], np.empty((0, 3)), [[1.0, 0.0, math.nan]]):
        assert np.isnan(half_point(none, grid)[:3]).all()
        assert half_point(none, grid).n == 0


@pytest.mark.parametrize(
    ("half", "low", "step", "text"),
    [
        (1001.0, 1000.0, 2.0, "1001 (1000..1002)"),
        (41.2345, 40.0, 2.0, "41.2 (40..42)"),
        (0.0123, 0.01, 0.01, "0.0123 (0.01..0.02)"),
        (99999.5, 99999.0, 1.0, "99999.5 (99999..100000)"),
    ],
)
def test_a_half_point_has_the_digits_of_its_grid(half: float, low: float, step: float, text: str) -> None:
    varied = Axis("gains", "k_p", "1", low, low + step, step, "larger")
    assert half_text({"half": half, "low": low, "high": low + step}, varied) == text


def test_numbers_of_a_fine_grid_are_not_rounded_away() -> None:
    half = half_point([[0.0, 1.0, 1.0, 0.0, 0.0, 0.0]] * 3, M_BAR.levels)
    assert half.value == 0.1  # not 0.100000000000015
    fine = Axis("gains", "m_bar", "kg m^2", 0.02, 0.06, 0.002, "larger")
    grid = dataclasses.replace(found({"artde": [40.0] * 3, "tde": [30.0] * 3}), axis=fine)
    assert outlasts(("artde", "tde"))(grid).measured == "artde beyond tde by +0.01 (+0.008..+0.012) kg m^2"


def test_differences_are_paired() -> None:
    """Each seed survives 6 N more under the first: the seeds' own scatter of 10 N drops out of the difference."""
    edges = np.random.default_rng(1).uniform(28, 42, 30)
    gap = half_difference(steps((edges + 6).tolist()), steps(edges.tolist()), GRID)
    assert gap.value == pytest.approx(6.0, abs=1.0)
    assert 0.0 <= gap.low <= 6.0 <= gap.high <= 12.0
    same = half_difference(steps(edges.tolist()), steps(edges.tolist()), GRID)
    assert same.low < 0.0 == same.value < same.high
    both = half_difference(steps([99.0] * 4), steps([99.0] * 4), GRID)
    assert math.isnan(both.value)


# ---------------------------------------------------------------- what a report says of a curve

M_BAR = Axis("gains", "m_bar", "kg m^2", 0.01, 0.21, 0.04, "larger")


def printed_by(grid: Frontier) -> str:
    console = Console(width=200)
    with console.capture() as printed:
        print_frontier(grid, console)
    return printed.get()


def test_an_interrupted_grid_says_between_how_many_episodes_it_has() -> None:
    grid = curves(M_BAR, {"tde": [2, 0, 0, 0, 0, 0]}, episodes=2)
    grid.levels.loc[3:, "episodes"] = 1
    assert "of 1 to 2 seeded episodes" in printed_by(grid)


def test_without_a_whole_grid_there_is_no_heading_of_half_points() -> None:
    grid = curves(M_BAR, {"tde": [3, 3]})
    assert "Half of" not in printed_by(grid)
    assert not any("Half points" in part for part in frontier_page.parts(grid))


def curves(varied: Axis, survived: dict[str, list[int]], episodes: int = 3) -> Frontier:
    """A grid in which so many of the episodes survive the levels, easiest first; the last levels may be missing."""
    rows = [
        dict(zip(LEVEL_COLUMNS, (value, name, episodes, count, *rate(count, episodes)[:3]), strict=True))
        for name, counts in survived.items()
        for value, count in zip(varied.levels, counts, strict=False)
    ]
    whole = {name: counts for name, counts in survived.items() if len(counts) == len(varied.levels)}
    tables = {name: [[i < count for count in counts] for i in range(episodes)] for name, counts in whole.items()}
    half = pd.DataFrame([(name, *half_point(table, varied.levels)) for name, table in tables.items()], columns=COLUMNS)
    return dataclasses.replace(frontier_of(varied, list(survived), rows, 0.9, None, whole == survived), half=half)


@pytest.mark.parametrize(
    ("survived", "headline"),
    [
        (
            {"tde": [0, 3, 3, 0, 0, 0]},
            "No controller survives the easiest level of gains.m_bar, 0.01 kg m^2, in 90 % of the episodes.",
        ),
        ({"tde": [3, 3], "artde": [2]}, "No frontier of gains.m_bar is found yet."),
        ({"tde": [3, 0], "artde": [3]}, "tde goes farthest so far in gains.m_bar: 0.01 kg m^2 (artde open)."),
        ({"tde": [3, 0, 0, 0, 0, 0]}, "tde goes farthest in gains.m_bar: 0.01 kg m^2."),
    ],
)
def test_headline_is_no_more_than_the_levels_say(survived: dict[str, list[int]], headline: str) -> None:
    assert frontier_page.answer(curves(M_BAR, survived))[0] == headline


@pytest.mark.parametrize(
    ("survived", "rises"),
    [
        ([0, 3, 3, 0, 0, 0], "from 0.01 to 0.05"),  # of 3 episodes: no intervals are disjoint
        ([3, 1, 2, 0, 0, 0], "from 0.05 to 0.09"),
        ([3, 2, 3, 1, 1, 0], ""),
        ([1, 0, 1, 0, 0, 0], ""),
    ],
)
def test_a_rise_across_one_half_is_told(survived: list[int], rises: str) -> None:
    grid = curves(M_BAR, {"tde": survived})
    note = f"Survival rises, which half points hide: tde {rises} kg m^2." if rises else ""
    assert rising_note(grid) == note
    assert ([line for line in frontier_page.answer(grid)[1] if "rises" in line] == [note]) == bool(rises)
    assert ("rises" in printed_by(grid)) == bool(rises)


# ---------------------------------------------------------------- claims on grids


def found(edges: dict[str, list[float]]) -> Frontier:
    """A grid in which each seed of a controller survives up to its edge."""
    rows = [
        {"controller": name, "episode": episode, "scenario": str(i), "fell": value > edge}
        for name, own in edges.items()
        for episode, edge in enumerate(own)
        for i, value in enumerate(GRID)
    ]
    varied = Axis("grf_pulse", "magnitude", "N", 20.0, 60.0, 2.0, "larger")
    whole = frontier_of(varied, list(edges), [], 0.9, None, complete=True)
    return Frontier(whole.table, whole.levels, varied, 0.9, episodes=pd.DataFrame(rows))


@pytest.mark.parametrize(
    ("edges", "outcome"),
    [
        ({"tde": 36.0, "atde": 38.0, "artde": 42.0}, "holds"),
        ({"tde": 36.0, "atde": 36.0, "artde": 42.0}, "undecided"),
        ({"tde": 40.0, "atde": 36.0, "artde": 42.0}, "does not hold"),
        ({"tde": 99.0, "atde": 99.0, "artde": 99.0}, "undecided"),
    ],
)
def test_who_survives_more(edges: dict[str, float], outcome: str) -> None:
    verdict = outlasts(("artde", "atde", "tde"))(found({name: [edge] * 20 for name, edge in edges.items()}))
    assert verdict.outcome == outcome
    assert "artde beyond atde by " in verdict.measured


def test_an_unknown_gap_is_no_number_and_a_number_has_no_unit() -> None:
    verdict = outlasts(("artde", "tde"))(found({"artde": [99.0] * 3, "tde": [99.0] * 3}))
    assert (verdict.outcome, verdict.measured) == ("undecided", "artde beyond tde by an unknown amount")
    share = Axis("grf_pulse", "share", "1", 20.0, 60.0, 2.0, "larger")
    grid = dataclasses.replace(found({"artde": [40.0] * 3, "tde": [30.0] * 3}), axis=share)
    assert outlasts(("artde", "tde"))(grid).measured == "artde beyond tde by +10 (+8..+12)"


def test_who_survives_more_needs_all_of_them() -> None:
    verdict = outlasts(("artde", "atde", "tde"))(found({"artde": [30.0], "tde": [30.0]}))
    assert (verdict.outcome, verdict.measured) == ("not measured", "no whole grid of atde")


# ---------------------------------------------------------------- the real thing


@pytest.mark.once
def test_rates_of_a_grid_are_those_of_its_episodes(tmp_path: Path) -> None:
    """Payloads that four rotors lift, hardly lift, and do not lift; counted by hand in the table of episodes."""
    grid: dict[str, Any] = {"low": 1.0, "high": 2.0, "tolerance": 0.25, "episodes": 6, "seed": 3, "grid": True}
    kwargs: dict[str, Any] = {"env_kwargs": {"duration": 2.0}, "vectorized": True, "out": tmp_path / "run"}
    whole = frontier(["tde", "artde"], "QuadInfinity-Payload-v0", "payload.mass", **grid, **kwargs)
    assert whole.complete
    assert whole.half is not None
    episodes = pd.read_csv(tmp_path / "run" / "grid" / "episodes.csv")
    assert len(episodes) == 2 * 5 * 6
    assert len(whole.levels) == 10
    for row in whole.levels.to_dict(orient="records"):
        own = episodes[
            (episodes["controller"] == row["controller"]) & (episodes["disturbance.payload.mass"] == row["value"])
        ]
        survived = own["fell"].tolist().count(False)
        assert (row["episodes"], row["survived"]) == (6, survived)
        assert (row["rate"], row["low"], row["high"]) == pytest.approx(rate(survived, 6)[:3])
    assert whole.levels["rate"].iloc[0] == 1.0 > whole.levels["rate"].iloc[-1]
    again = frontier(["tde", "artde"], "QuadInfinity-Payload-v0", "payload.mass", **grid, **kwargs)
    assert again.half is not None
    pd.testing.assert_frame_equal(again.half, whole.half)
    read, _ = frontier_page.read_frontier(tmp_path / "run")
    assert read.half is not None
    assert read.half["half"].tolist() == whole.half["half"].tolist()
    assert any("Half points" in part for part in frontier_page.parts(read))


@pytest.mark.parametrize("vary", ["payload.mass", "gains.k_p_p"])
def test_an_interrupted_grid_goes_on(vary: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After the first controller, or level, is finished; the whole is that of a grid without an interruption."""
    span = {"payload.mass": (0.5, 2.1, 1.6), "gains.k_p_p": (8.0, 10.0, 2.0)}[vary]
    options: dict[str, Any] = dict(zip(("low", "high", "tolerance"), span, strict=True))
    options |= {"episodes": 2, "grid": True, "vectorized": True, "env_kwargs": {"duration": 1.0}}
    names, env_id = ["tde", "artde"], "QuadInfinity-Payload-v0"
    monkeypatch.setattr(TASKS, "CHUNK", 4)  # one controller's
    ended: list[float] = []

    def interrupt(value: float, update: Update) -> None:
        if len(ended) > 0:
            raise KeyboardInterrupt
        ended.extend([value] * update.ended)

    def stop(_value: float, _update: Update) -> None:
        raise KeyboardInterrupt

    nothing = frontier(names, env_id, vary, out=tmp_path / "run", on_progress=stop, **options)
    assert (nothing.complete, len(nothing.levels)) == (False, 0)
    part = frontier(names, env_id, vary, out=tmp_path / "run", on_progress=interrupt, **options)
    assert not part.complete
    assert 0 < len(part.levels) < 4
    whole = frontier(names, env_id, vary, out=tmp_path / "run", **options)
    assert whole.complete
    pd.testing.assert_frame_equal(whole.levels, frontier(names, env_id, vary, **options).levels)


@pytest.mark.once
def test_levels_side_by_side_are_each_level_alone() -> None:
    """To the bit: nothing of an episode depends on what runs beside it."""
    kwargs: dict[str, Any] = {"duration": 2.6, "control_period": 0.004}
    pulse = {"shape": "double_hump", "duration": 1.0}
    options: dict[str, Any] = {"episodes": 2, "seed": 5, "vectorized": True, "env_kwargs": kwargs}
    grid = frontier(
        ["artde"],
        WALK,
        "grf_pulse.magnitude",
        low=20,
        high=60,
        tolerance=40,
        grid=True,
        disturbances={"grf_pulse": pulse},
        **options,
    )
    assert grid.episodes is not None
    for i, value in enumerate((20.0, 60.0)):
        pulsed = {"grf_pulse": {**pulse, "magnitude": value}}
        alone = evaluate(["artde"], WALK, disturbances=pulsed, record_hz=10.0, **options).episodes
        beside = grid.episodes[grid.episodes["scenario"] == str(i)]
        for column in ("seed", "fell", "rmse_deg", "robust_gain_mean", "reward"):
            assert beside[column].tolist() == alone[column].tolist()


@pytest.mark.parametrize("wrong", [3, "payload", [{}], [{}, {}, {}], [3, {}]])
def test_disturbances_of_a_vector_are_a_mapping_or_one_for_each(wrong: Any) -> None:
    env = gym.make_vec(WALK, 2, vectorization_mode="vector_entry_point", engine="mujoco", duration=0.3)
    with pytest.raises(ArtdeGymError):
        env.reset(seed=0, options={"disturbances": wrong})


@pytest.mark.once
def test_grid_of_the_ground_force_is_the_thesis_force_in_a_scenario() -> None:
    for name, payload in (("S1", False), ("S2", True)):
        disturbances, arguments = standard_test(PUSH, "grf_pulse.magnitude", {}, name)
        assert disturbances["grf_pulse"] == {"shape": "double_hump", "duration": 1.0, "trigger": "contact"}
        assert ("payload" in disturbances) == payload
        assert arguments == {"duration": 20.0}
    assert standard_test(PUSH, "grf_pulse.magnitude", {"duration": 9.0}, "S2-L4")[1] == {
        "control_period": 0.004,
        "duration": 9.0,
    }
    with pytest.raises(OptionError, match="one of the robot in BipedPush-v0"):
        standard_test(PUSH, "grf_pulse.magnitude", {}, "Q1")
    with pytest.raises(UnknownNameError, match="S9"):
        standard_test(PUSH, "grf_pulse.magnitude", {}, "S9")
    with pytest.raises(OptionError, match="disturbances"):
        frontier(["tde"], PUSH, "grf_pulse.magnitude", scenario="S1", disturbances={})


def test_gains_are_varied(tmp_path: Path) -> None:
    options: dict[str, Any] = {"episodes": 1, "disturbances": {}, "env_kwargs": SHORT, "low": 0.03, "high": 0.05}
    folder = tmp_path / "run"
    whole = frontier(["tde", "pid"], PUSH, "gains.m_bar", tolerance=0.01, grid=True, out=folder, **options)
    assert whole.levels["value"].tolist() == [0.03, 0.03, 0.04, 0.04, 0.05, 0.05]
    record = json.loads((folder / "levels" / "0.04" / "summary.json").read_text())
    assert record["configuration"]["gains"] == {"tde": {"m_bar": 0.04}, "pid": {"m_bar": 0.04}}
    assert whole.axis.unit == "kg m^2"
    found = frontier(["tde"], PUSH, "gains.m_bar", tolerance=0.02, **options)
    assert found.table["relation"].tolist() == ["<="]
    with pytest.raises(GainError, match="gamma"):
        frontier(["tde"], PUSH, "gains.gamma", tolerance=0.01, **options)


def test_command_with_scenarios_and_figures(tmp_path: Path) -> None:
    arguments = ["frontier", "--vary", "grf_pulse.magnitude", "--grid", "--scenario", "S1,S2", "--controllers", "tde"]
    arguments += ["--low", "20", "--high", "60", "--tolerance", "40", "--episodes", "2", "--workers", "1"]
    arguments += ["--env-kwargs", json.dumps(SHORT), "--out", str(tmp_path / "run")]
    outcome = CliRunner().invoke(app, [*arguments, "--figure", str(tmp_path / "curve.svg")])
    assert outcome.exit_code == 0, outcome.output
    for word in ("falls at (N)", "of 2 seeded", "0/2", "tde: > 60", "S2"):
        assert word in outcome.output
    for name in ("S1", "S2"):
        drawn = (tmp_path / f"curve-{name}.svg").read_text()
        assert drawn.startswith("<svg")
        assert "tde: half at &gt; 60 (60..&gt; 60) N" in drawn
        assert "wanted" not in drawn  # of a bisection
        assert (tmp_path / "run" / name / "half.csv").exists()
