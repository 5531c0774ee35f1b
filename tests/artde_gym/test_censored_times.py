"""Times until something happens that may never happen, pairs of episodes, and masses that change."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from scipy import stats

from artde_gym.errors import OptionError
from artde_gym.evaluation import Result, evaluate, statistics
from artde_gym.evaluation.console import print_claims, print_result
from artde_gym.evaluation.environments import single
from artde_gym.evaluation.metrics import GRAVITY, Metrics, payload_of
from artde_gym.evaluation.rollout import metrics_for
from artde_gym.robots.ojas import task as biped_task
from artde_gym.studies.reproduce.claims import repeats

NEVER, UNKNOWN = np.inf, np.nan
ENVIRONMENT = "BipedWalk-Payload-v0"


def table(times: dict[str, list[float]], **columns: Any) -> pd.DataFrame:
    """Episodes with a push, of which only the recovery times differ."""
    return pd.DataFrame([
        {"scenario": "S", "controller": name, "env": ENVIRONMENT, "seed": i, "episode": i, "fell": False}
        | {"time_to_fall_s": np.nan, "duration_s": 9.0, "recovery_time_s_push0": time, "peak_error_deg_push0": 3.0}
        | {"rmse_deg": 1.0} | columns
        for name, values in times.items()
        for i, time in enumerate(values)
    ])  # fmt: skip


# ---------------------------------------------------------------- statistics


def test_never_is_the_largest_value() -> None:
    assert statistics.win_probability([1, NEVER, NEVER], [2, 3, 4]) == pytest.approx(1 / 3)
    assert statistics.win_probability([NEVER], [NEVER]) == 0.5


@given(st.lists(st.floats(0, 100) | st.just(np.inf), min_size=6, max_size=60))
def test_median_and_its_interval_are_order_statistics(values: list[float]) -> None:
    found = statistics.median([*values, np.nan])
    assert found.n == len(values)
    assert found.value == np.median(values)
    assert found.low in values
    assert found.high in values
    assert found.low <= found.value <= found.high
    shrunk = statistics.median(np.tanh(np.array(values) / 50))  # any growing function maps the median's interval
    assert (shrunk.low, shrunk.high) == pytest.approx((np.tanh(found.low / 50), np.tanh(found.high / 50)))


@pytest.mark.once
def test_interval_of_the_median_covers_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(400):
        found = statistics.median(rng.exponential(size=25))
        inside += found.low <= np.log(2) <= found.high
    assert stats.binomtest(inside, 400, 0.95, alternative="less").pvalue > 0.01
    assert np.isnan(statistics.median([1, 2, 3, 4, 5]).low)


# ---------------------------------------------------------------- readers


def test_comparison_counts_episodes_that_never_recover() -> None:
    compared = Result(table({"a": [1, NEVER, NEVER], "b": [2, 3, 4]})).compare("a", "b").loc["S"]
    row = compared.loc["recovery_time_s_push0"]
    assert row["pairs"] == 3
    assert row["win_probability"] == pytest.approx(1 / 3)
    assert (row["a"], row["b"]) == (NEVER, 3)
    assert np.isnan(row["difference"])
    assert compared.loc["recovered_push0", "difference"] == pytest.approx(-2 / 3)


def test_unknown_is_left_out_and_a_fall_is_not() -> None:
    episodes = table({"a": [1, UNKNOWN, NEVER], "b": [2, 3, 4]})
    episodes.loc[2, "fell"] = True
    row = Result(episodes).compare("a", "b").loc["S"].loc["recovery_time_s_push0"]
    assert row["pairs"] == 2
    assert row["win_probability"] == 0.5


def test_summary_has_the_share_and_the_median_and_no_mean_of_the_lucky() -> None:
    result = Result(table({"pid": [1.0, 2.0] + [NEVER] * 17 + [UNKNOWN]}))
    summary = result.summary().loc["S"].loc["pid"]
    share = statistics.rate(2, 19)
    assert summary.loc["recovered_push0", ["mean", "low", "high", "n"]].tolist() == list(share)
    time = summary.loc["recovery_time_s_push0"]
    assert np.isnan(time["mean"])
    assert time["median"] == NEVER
    assert time["n"] == 19
    assert result.recovery("S", "pid", "push0").share == share


def test_falls_that_never_come_are_the_longest_times() -> None:
    episodes = table({"a": [1, 1, 1], "b": [1, 1, 1]})
    episodes["fell"] = [True, False, False, True, True, True]
    episodes["time_to_fall_s"] = [1.0, np.nan, np.nan, 2.0, 3.0, 4.0]
    row = Result(episodes).compare("a", "b").loc["S"].loc["time_to_fall_s"]
    assert row["pairs"] == 3
    assert row["win_probability"] == pytest.approx(1 / 3)


def test_console_shows_share_and_median() -> None:
    console = Console(record=True, width=120)
    frame = table({"pid": [1.0, 2.0] + [NEVER] * 17 + [UNKNOWN], "tde": [1.0] * 20})
    tracking = biped_task.METRICS_SPEC
    names = [
        f"{metric}_{t.unit}_{axis}" for metric in ("rmse", "max_abs_error") for t in tracking.errors for axis in t.axes
    ]
    names += [f"rms_{effort.name}_{effort.unit}_{axis}" for effort in tracking.efforts for axis in effort.axes]
    print_result(Result(frame.assign(**dict.fromkeys(names, 1.0))), console)
    text = console.export_text()
    assert "2/19 (3..31 %)" in text
    assert "never" in text
    assert "20/20" in text


def test_a_fall_after_a_push_is_never() -> None:
    layout = biped_task.OBSERVATION
    for count, expected in ((90, NEVER), (120, NEVER), (40, UNKNOWN)):  # settled, but it falls: in the push, or later
        fields = {field.name: np.zeros((count, 1, field.size)) for field in layout.fields}
        metrics = Metrics(biped_task.METRICS_SPEC, layout, 0.01, [9.0], [{"push0": (0.5, 1.0)}])
        metrics.add(0, fields, None)
        found = metrics.rows(np.array([True]))[0]["recovery_time_s_push0"]
        np.testing.assert_equal(found, expected)
        np.testing.assert_equal(metrics.rows()[0]["recovery_time_s_push0"], UNKNOWN)


# ---------------------------------------------------------------- pairs


def test_pairs_are_of_one_seed() -> None:
    a, b = table({"a": [1, 2, 3]}), table({"b": [4, 5, 6]}).assign(seed=[100, 0, 2])
    result = Result(pd.concat([a, b], ignore_index=True))
    ours, theirs = result.pairs("S", "a", "b", "recovery_time_s_push0")
    assert (ours.tolist(), theirs.tolist()) == ([1, 3], [5, 6])
    strangers = Result(pd.concat([a, b.assign(seed=[7, 8, 9])], ignore_index=True))
    assert set(strangers.compare("a", "b")["pairs"]) == {0}


def test_pairs_have_the_same_disturbances() -> None:
    a = table({"a": [1, 2, 3]}).assign(**{"disturbance.payload.mass": [1.0, 2.0, 3.0]})
    b = table({"b": [1, 2, 3]}).assign(**{"disturbance.payload.mass": [1.0, 2.5, 3.0]})
    assert Result(pd.concat([a, b])).compare("a", "b").loc[("S", "rmse_deg"), "pairs"] == 2
    b["disturbance.wind.strength"] = [np.nan, np.nan, 1.0]
    assert Result(pd.concat([a, b])).compare("a", "b").loc[("S", "rmse_deg"), "pairs"] == 1


def test_an_episode_that_is_there_twice_is_refused() -> None:
    episodes = table({"a": [1, 2]})
    with pytest.raises(OptionError, match="seed 0 of a in S has two episodes"):
        Result(pd.concat([episodes, episodes]))


def test_a_claim_over_two_scenarios_pairs_by_seed() -> None:
    names = [f"rmse_deg_{joint}" for joint in ("q1", "q2")]
    parts = [table({"artde": [1.0] * 8}).assign(scenario=s, **dict.fromkeys(names, 1.0)) for s in ("A", "B")]
    same = repeats("A", "B", "rmse_deg", ("q1", "q2"), 15.0)(Result(pd.concat(parts)))
    assert same.outcome == "holds"
    parts[1]["seed"] += 100
    other = repeats("A", "B", "rmse_deg", ("q1", "q2"), 15.0)(Result(pd.concat(parts)))
    assert other.outcome == "not measured"


# ---------------------------------------------------------------- mass


@pytest.mark.parametrize(
    ("payload", "extra"),
    [
        ({"attach_time": 0.0, "detach_time": 2.0**62}, 2.0),
        ({"attach_time": 0.5, "detach_time": 2.0**62}, 1.0),
        ({"attach_time": 0.0, "detach_time": 0.25}, 0.5),
        ({"attach_time": 0.6, "detach_time": 0.4}, 0.0),
        ({"attach_time": 5.0, "detach_time": 9.0}, 0.0),
    ],
)
def test_cost_of_transport_weighs_what_is_there(payload: dict[str, float], extra: float) -> None:
    """At a constant speed the mean mass over the distance is that over time."""
    layout, count = biped_task.OBSERVATION, 1000
    fields = {field.name: np.zeros((count, 1, field.size)) for field in layout.fields}
    fields["base_velocity"][..., 0] = 0.5
    fields["tau_applied"][..., 0], fields["qd"][..., 0] = 3.0, 1.0
    load = payload_of({"payload": {"mass": 2.0, **payload}})
    metrics = Metrics(biped_task.METRICS_SPEC, layout, 0.001, [9.0], [{}], payloads=[load])
    metrics.add(0, fields, None)
    row = metrics.rows()[0]
    assert row["cost_of_transport"] == pytest.approx(row["energy_j"] / (GRAVITY * (9.0 + extra) * 0.5))


def test_cost_of_transport_knows_what_was_drawn() -> None:
    """The same motion at the same power costs less by as much as the robot is heavier."""
    env = single(ENVIRONMENT, json.dumps({"duration": 2.0})).unwrapped
    fields = {field.name: np.zeros((1000, 1, field.size)) for field in env.observation_layout.fields}
    fields["base_velocity"][..., 0] = 0.5
    fields["tau_applied"][..., 0], fields["qd"][..., 0] = 3.0, 1.0

    def cost(**disturbances: Any) -> float:
        env.reset(seed=0, options={"disturbances": disturbances})
        metrics = metrics_for(env, [env.sampled_disturbances], ())
        metrics.add(0, fields, None)
        return metrics.rows()[0]["cost_of_transport"]

    mass = env.nominal_robot.mass
    assert cost(payload={"mass": 4.0, "attach_time": 1.0, "detach_time": 0.5}) == cost()
    assert cost(payload=1.3) == pytest.approx(cost() * mass / (mass + 1.3))
    assert cost(mass_scale=1.1) == pytest.approx(cost() / 1.1)
    assert cost(mass_scale=1.1, payload=1.3) == pytest.approx(cost() * mass / (1.1 * mass + 1.3))


# ---------------------------------------------------------------- print


def test_every_column_is_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    result = Result(table({"a": [1.0, 2.0, 3.0], "b": [2.0, 3.0, 4.0]}))
    for frame in (result.compare("a", "b"), result.summary(), result.compare("a", "b").loc[["S"]]):
        text = str(frame)
        assert "..." not in text
        assert all(str(name) in text for name in frame)


@pytest.mark.parametrize("width", [60, 80, 140])
def test_claims_are_readable_in_a_narrow_terminal(width: int) -> None:
    claim = "ARTDE's RMSE is below TDE's on every joint by at least 29.1 %"
    verdicts = pd.DataFrame([("S1", claim, "undecided", "least: q1 +20.0 %", ">= 29.1 % printed")])
    verdicts.columns = pd.Index(["scenario", "claim", "verdict", "measured", "thesis"])
    console = Console(record=True, width=width)
    print_claims(verdicts, console)
    lines = console.export_text().splitlines()
    assert len([line for line in lines if line.strip()]) <= 7
    assert any("undecided" in line for line in lines)
    assert max(map(len, lines)) <= width


def test_episodes_of_one_call_are_all_paired() -> None:
    result = evaluate(
        ["tde", "artde"], scenario="S2", episodes=2,
        env_kwargs={"duration": 0.2, "control_period": 0.004, "actuator_inertia": "lumped"},
    )  # fmt: skip
    assert result.compare("artde", "tde").loc[("S2", "fell"), "pairs"] == 2
