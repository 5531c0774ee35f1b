"""A multiverse from outside: designs, samples, the very episodes of `evaluate`, kills, claims and commands."""

from __future__ import annotations

import copy
import json
import math
import os
import shlex
import signal
import subprocess
import sys
import time
from typing import Any
from xml.etree import ElementTree

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest
from typer.testing import CliRunner

import controllers
from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError, MissingDependencyError, OptionError, StoreError, UnknownNameError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.side_by_side import SideBySide
from artde_gym.evaluation.store import parse_table
from artde_gym.report import write_report
from artde_gym.studies import multiverse, read_multiverse
from artde_gym.studies.multiverse.claims import WorldTable, ordered, pattern, smaller, survives
from artde_gym.studies.multiverse.deciding import rank_correlations, what_decides
from artde_gym.studies.multiverse.design import MATCHED, design, load, standard_designs
from artde_gym.studies.multiverse.factor import Factor, sample
from artde_gym.studies.multiverse.verdict import verdict_of

pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra sweep)")
pytest.importorskip("yaml", reason="pyyaml is not installed (extra sweep)")

BIPED: dict[str, Any] = {
    "scenario": "S1",
    "env_kwargs": {"duration": 1.2, "engine": "mujoco"},
    "set": {"disturbances.grf_pulse.shape": "double_hump"},
    "controllers": ["tde", "artde"],
    "matched": "artde",
    "vectorized": True,
    "worlds": 4,
    "seed": 11,
    "factors": {
        "force": {"path": "disturbances.grf_pulse.share", "quantiles": [0.0, 0.3, 0.5], "source": "a guess"},
        "period": {"path": "env_kwargs.control_period", "choice": [0.003, 0.004], "unit": "s", "source": "a guess"},
        "ahead": {"path": "disturbances.payload.position.0", "uniform": [-0.03, 0.03], "source": "a guess"},
        "payload": {"path": "disturbances.payload.mass", "uniform": [0.5, 2.0], "source": "a guess"},
        "mass": {"path": "disturbances.mass_scale.factor", "uniform": [0.9, 1.1], "source": "a guess"},
        "gamma": {
            "path": ["gains.artde.gamma_0", "gains.artde.gamma_1"],
            "log_uniform": [100.0, 2000.0],
            "source": "a guess",
        },
    },
    "claims": [{"smaller error": ["artde", "tde"]}, {"survives": [MATCHED, "artde"]}],
}
QUADROTOR: dict[str, Any] = {
    "scenario": "Q1",
    "env_kwargs": {"duration": 2.0},
    "controllers": ["tde", "artde"],
    "matched": "artde",
    "vectorized": True,
    "worlds": 3,
    "seed": 11,
    "factors": {
        "wind": {"path": "disturbances.wind.scale", "uniform": [0.0, 2.0], "source": "a guess"},
        "measurement": {"path": "env_kwargs.measurement", "choice": ["ideal", "mocap"], "source": "a guess"},
        "delay": {"path": "disturbances.action_delay.steps", "choice": [0, 1], "source": "a guess"},
    },
    "claims": [{"order": ["tde", "artde"]}],
}
ONE = {"x": {"path": "env_kwargs.speed", "uniform": [0.1, 0.2], "source": "a guess"}}
SMALL: dict[str, Any] = {"env": "BipedWalk-Payload-v0", "controllers": ["tde", "artde"], "factors": ONE, "worlds": 2}


@pytest.fixture(scope="module")
def biped(tmp_path_factory) -> Any:
    return multiverse(BIPED, tmp_path_factory.mktemp("biped"))


@pytest.fixture(scope="module")
def quadrotor(tmp_path_factory) -> Any:
    return multiverse(QUADROTOR, tmp_path_factory.mktemp("quadrotor"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nonsense": 1}, "key of the design is 'nonsense'"),
        ({"factors": {}}, "factors is {}"),
        ({"factors": {"x": {"path": "env_kwargs.speed", "uniform": [0.1, 0.2]}}}, "source of factor 'x' is None"),
        ({"factors": {"x": {**ONE["x"], "uniform": [0.2, 0.1]}}}, "factor 'x'.uniform is"),
        ({"factors": {"x": {**ONE["x"], "choice": [1]}}}, "exactly one of"),
        ({"factors": {"x": {**ONE["x"], "pth": 1}}}, "did you mean 'path'"),
        ({"factors": {"x": {**ONE["x"], "path": "speed"}}}, "path is 'speed'"),
        ({"factors": {"x": ONE["x"], "y": ONE["x"]}}, "set by two factors"),
        ({"factors": {"x": {"path": "env_kwargs.speed", "quantiles": [2.0, 1.0], "source": "a"}}}, "ascending order"),
        ({"controllers": ["tde", "atdee"]}, "did you mean 'atde'"),
        ({"controllers": ["tde", "tde"]}, "is given twice"),
        ({"matched": "atde"}, "matched is 'atde'"),
        ({"claims": [{"survives": ["tde"]}]}, "a list of two controllers"),
        ({"claims": [{"survives": ["tde", "pid"]}]}, "controller of the claim"),
        ({"claims": [{"wins": ["tde", "artde"]}]}, "one of the keys survives"),
        ({"worlds": 0}, "worlds is 0"),
        ({"vectorized": "batches"}, "vectorized is 'batches'"),
        ({"env": None}, "neither env nor scenario"),
        ({"figure": ["x", "x"]}, "factor of the figure 'x' is given twice"),
        ({"matched": "tde"}, "matched 'tde' has no adaptive gain"),
        ({"matched": "tde", "vectorized": True}, "matched 'tde' has no adaptive gain"),
        ({"figure": ["y"]}, "one or two of the factors: x"),
        ({"figure": [["x"]]}, "one or two of the factors: x"),
        ({"set": {"disturbances.payload.mass": 1.0}}, "needs a scenario"),
        (
            {"disturbances": {}, "set": {"disturbances.payload.position.3": 1.0}},
            "component in disturbances.payload.position.3 is '3'",
        ),
        ({"disturbances": {}, "set": {"disturbances.payload.mass.0": 1.0}}, "none: it is one value"),
    ],
)
def test_a_wrong_design_is_refused_in_one_line_before_anything_is_written(tmp_path, change, message):
    with pytest.raises(ArtdeGymError) as caught:
        multiverse({**SMALL, **change}, tmp_path / "out")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_what_an_environment_refuses_shows_before_the_first_episode(tmp_path):
    factors = {"payload": {"path": "disturbances.payload.mass", "uniform": [4.0, 50.0], "source": "too much"}}
    for vectorized in (False, True):
        with pytest.raises(
            ArtdeGymError, match=r"payload.mass \(world 0 with factor 'payload' at 50.0\) is .*; allowed: .*5"
        ):
            multiverse(
                {**SMALL, "disturbances": {}, "factors": factors, "vectorized": vectorized}, tmp_path / str(vectorized)
            )
        assert not (tmp_path / str(vectorized)).exists()


def test_an_unknown_design_names_the_standard_ones():
    with pytest.raises(OptionError, match=r"arm, ojas, q450.*did you mean 'ojas'"):
        load("ojass")


@pytest.mark.parametrize("robot", sorted(standard_designs()))
def test_standard_designs_are_whole(robot):
    found = load(robot, worlds=3)
    assert len(found.points()) == 3 * len(found.controllers)
    assert all(len(factor.source) > 20 for factor in found.factors)
    assert {name for claim in found.claims for name in claim.controllers} <= set(found.labels)


@pytest.mark.once
def test_a_sample_fills_each_factor_evenly_and_the_first_worlds_stay():
    factors = [
        Factor.of("flat", {"path": "gains", "uniform": [2.0, 4.0], "source": "a"}),
        Factor.of("log", {"path": "env", "log_uniform": [0.01, 100.0], "source": "a"}),
        Factor.of("halves", {"path": "scenario", "quantiles": [0.0, 0.45, 0.6], "source": "a"}),
        Factor.of("kind", {"path": "disturbances", "choice": ["a", "b", "c", "d"], "source": "a"}),
    ]
    worlds = sample(factors, 256, seed=5)
    columns = {factor.name: [world[factor.name] for world in worlds] for factor in factors}
    # a scrambled Sobol sequence has one point in each of n equal parts of every axis
    for part, name in ((np.array(columns["flat"]) / 2 - 1, "flat"), (np.log10(columns["log"]) / 4 + 0.5, "log")):
        assert sorted((part * 256).astype(int).tolist()) == list(range(256)), name
    halves = np.array(columns["halves"])
    assert (halves < 0.45).sum() == 128
    assert 0.0 <= halves.min() < halves.max() <= 0.6
    assert {columns["kind"].count(word) for word in "abcd"} == {64}
    assert sample(factors, 37, seed=5) == worlds[:37]
    assert sample(factors, 1, seed=5) == worlds[:1]
    assert sample(factors, 37, seed=6) != worlds[:37]


@pytest.mark.once
def test_worlds_side_by_side_are_those_of_evaluate_one_at_a_time(biped, quadrotor):
    """Each row is what its printed command gives, in the batch and (for the biped) in the single environment."""
    for found in (biped, quadrotor):
        assert found.complete
        assert sorted(found.episodes["controller"].unique()) == ["artde", MATCHED, "tde"]
        for world in (0, 2):
            lines = found.command(world)
            assert len(lines) == 2  # the second pass has one of its own
            for line in lines:
                for _, other in run_again(line).iterrows():
                    name = MATCHED if line == lines[1] else str(other["controller"])
                    same_episode(episode(found, world, name), other)


@pytest.mark.once
def test_worlds_of_a_batch_are_those_of_single_environments(biped):
    line = biped.command(1, ("artde",))[0].replace(" --vectorized", "")
    same_episode(episode(biped, 1, "artde"), run_again(line).iloc[0])


def episode(found: Any, world: int, controller: str) -> Any:
    rows = found.episodes[(found.episodes["world"] == world) & (found.episodes["controller"] == controller)]
    assert len(rows) == 1
    return rows.iloc[0]


def test_the_command_line_reproduces_a_world(biped, tmp_path):
    words = shlex.split(biped.command(3, (MATCHED,))[0])
    assert words[0] == "artde-gym"
    outcome = CliRunner().invoke(app, [*words[1:], "--out", str(tmp_path / "again"), "--workers", "1"])
    assert outcome.exit_code == 0, outcome.output
    again = parse_table((tmp_path / "again/episodes.csv").read_text(), ("controller",))
    row = episode(biped, 3, MATCHED)
    assert row["rmse_deg"] == again["rmse_deg"][0]
    assert row["duration_s"] == again["duration_s"][0]


def run_again(line: str) -> pd.DataFrame:
    """The episode of a printed command."""
    words = [word for word in shlex.split(line)[2:] if word != "--vectorized"]
    given = dict(zip(words[::2], words[1::2], strict=True))
    read = {name: json.loads(given.get(f"--{name}", "{}")) for name in ("env-kwargs", "gains")}
    return evaluate(
        given["--controllers"].split(","),
        given["--env"],
        scenario=given["--scenario"],
        episodes=int(given["--episodes"]),
        seed=int(given["--seed"]),
        vectorized="--vectorized" in line,
        env_kwargs=read["env-kwargs"],
        gains=read["gains"],
        disturbances=json.loads(given["--disturbances"]),
    ).episodes


def same_episode(row: Any, other: Any) -> None:
    """Equal to the last bit, in all that both tell but the label of the second pass."""
    for name in set(row.index) & set(other.index) - {"controller"}:
        mine: Any = row[name]
        theirs: Any = other[name]
        assert mine == theirs or (pd.isna(mine) and pd.isna(theirs)), name


@pytest.mark.once
def test_the_second_pass_has_the_mean_gain_of_the_same_world(biped, quadrotor):
    for found, gains in ((biped, {""}), (quadrotor, {"_p", "_q"})):
        table = found.episodes.set_index(["world", "controller"])
        for world in range(len(found.design.worlds)):
            for suffix in gains:
                mean = table.loc[(world, "artde"), f"robust_gain_mean{suffix}"]
                assert table.loc[(world, MATCHED), f"gains.c{suffix}"] == mean
        assert table.xs("tde", level=1)["robust_gain_mean" + min(gains)].isna().all()


def test_the_second_pass_keeps_the_gains_that_are_given_to_it():
    given = {"tde+kd": {"m_bar": 0.08, "c": 1.0}}
    point = design({**SMALL, "gains": given, "matched": "artde"}).matched_point(0, {"c": 0.3})
    assert point.gains == {"m_bar": 0.08, "c": 0.3}


@pytest.mark.once
def test_results_depend_neither_on_workers_nor_on_the_order_of_runs(biped, tmp_path):
    fewer = multiverse({**BIPED, "worlds": 2}, tmp_path)
    assert len(fewer.episodes) == 6
    more = multiverse(BIPED, tmp_path, workers=2)  # goes on with two more worlds
    pd.testing.assert_frame_equal(by_cell(more.episodes), by_cell(biped.episodes), check_exact=True)
    with pytest.raises(StoreError, match="of 12 belong to another"):
        multiverse({**BIPED, "worlds": 2}, tmp_path)


def by_cell(episodes: pd.DataFrame) -> pd.DataFrame:
    return episodes.sort_values("cell").reset_index(drop=True).drop(columns="scenario")


def test_an_interrupted_run_goes_on(tmp_path, biped):
    def interrupt(what: str, update: Any) -> None:
        if what == "episodes" and update.ended:
            raise KeyboardInterrupt

    first = multiverse(BIPED, tmp_path, on_progress=interrupt)
    assert not first.complete
    assert 0 < len(first.episodes) < 12
    assert all(verdict.decided <= 4 for verdict in read_multiverse(tmp_path).verdicts)
    whole = multiverse(BIPED, tmp_path)
    assert whole.complete
    pd.testing.assert_frame_equal(by_cell(whole.episodes), by_cell(biped.episodes), check_exact=True)


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL")
def test_killed_and_continued_equals_undisturbed(tmp_path, biped):
    script = (
        "import json, sys; from artde_gym.studies import multiverse; multiverse(json.loads(sys.argv[1]), sys.argv[2])"
    )
    for kill in (True, False):
        process = subprocess.Popen([sys.executable, "-c", script, json.dumps(BIPED), str(tmp_path / "out")])
        while kill and process.poll() is None and not list((tmp_path / "out").glob("episodes/*.parquet")):
            time.sleep(0.02)
        if kill:
            os.kill(process.pid, signal.SIGKILL)
        assert process.wait() == (-signal.SIGKILL if kill else 0)
    whole = read_multiverse(tmp_path / "out")
    assert whole.complete
    pd.testing.assert_frame_equal(by_cell(whole.episodes), by_cell(biped.episodes), check_exact=True)


FALLS = {"tde": [1, 1, 0, 1, 0], "atde": [1, 0, 0, 0, 1], "artde": [1, 0, 0, 1, 0]}
ERRORS = {"tde": [9.0, 2.0, 3.0, 4.0, 1.0], "atde": [9.0, 2.0, 2.0, 5.0, 9.0], "artde": [9.0, 1.0, 1.0, 5.0, 1.0]}


def by_hand() -> pd.DataFrame:
    """Episodes of five worlds, written by hand."""
    return pd.DataFrame(
        {
            "world": world,
            "controller": name,
            "fell": bool(fell),
            "duration_s": 10.0 - 5 * fell - world / 10,
            "rmse_deg": ERRORS[name][world],
        }
        for name, falls in FALLS.items()
        for world, fell in enumerate(falls)
    )


@pytest.mark.parametrize(
    ("claim", "holds", "tie", "reverses"),
    [
        (survives("artde", "tde"), 1, 4, 0),
        (survives("atde", "tde"), 2, 2, 1),
        (smaller("artde", "tde"), 1, 1, 0),
        (ordered("tde", "atde", "artde"), 1, 2, 2),
        (pattern({"tde": True, "artde": False}), 1, 4, 0),
        (pattern({"tde": True, "atde": False}), 2, 2, 1),
    ],
    ids=lambda value: getattr(value, "text", None),
)
def test_claims_are_counted_by_hand(claim, holds, tie, reverses):
    found = verdict_of(claim, WorldTable(by_hand(), "rmse_deg", claim.controllers))
    assert [found.count("holds"), found.count("tie"), found.count("reverses")] == [holds, tie, reverses]
    assert found.decided == holds + tie + reverses
    assert found.share("holds").value == holds / found.decided
    assert found.p_value == binomtest(holds, holds + reverses).pvalue
    interval = binomtest(holds, found.decided).proportion_ci(0.95, method="wilson")
    assert (found.share("holds").low, found.share("holds").high) == (interval.low, interval.high)


def test_the_ends_of_a_claim_are_the_worlds_of_the_largest_margins():
    found = verdict_of(survives("atde", "tde"), WorldTable(by_hand(), "rmse_deg", ("atde", "tde")))
    assert found.most_favorable in (1, 3)  # where tde alone falls
    assert found.least_favorable == 4
    smaller_error = verdict_of(smaller("atde", "tde"), WorldTable(by_hand(), "rmse_deg", ("atde", "tde")))
    assert (smaller_error.decided, smaller_error.most_favorable) == (1, 2)
    nothing = verdict_of(smaller("atde", "tde"), WorldTable(by_hand().iloc[:0], "rmse_deg", ("atde", "tde")))
    assert (nothing.decided, nothing.most_favorable) == (0, None)
    assert math.isnan(nothing.p_value)


def test_a_world_counts_once_all_of_its_controllers_have_run():
    table = WorldTable(by_hand().iloc[:7], "rmse_deg", ("tde", "atde"))
    assert table.worlds == [0, 1]


@pytest.mark.once
def test_the_factor_that_decides_is_found():
    pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra multiverse)")
    rng = np.random.default_rng(0)
    factors = rng.uniform(size=(200, 4))
    classes = np.where(factors[:, 2] > 0.6, "holds", "tie").tolist()
    found = what_decides(factors, classes)
    assert found is not None
    assert found.accuracy > 0.95 > found.baseline
    assert int(found.importance.argmax()) == 2
    assert found.tree.factor == 2
    assert found.tree.threshold == pytest.approx(0.6, abs=0.03)
    assert found.tree.counts == (classes.count("holds"), classes.count("tie"))
    noise = what_decides(factors, rng.permutation(classes).tolist())
    assert noise is not None
    assert noise.accuracy < noise.baseline + 0.05
    assert what_decides(factors, ["tie"] * 197 + ["holds"] * 3) is None


@pytest.mark.parametrize("size", [1e-300, 1.0, 1e300])
def test_factors_of_any_size_decide(size):
    pytest.importorskip("sklearn")
    factors = np.random.default_rng(0).uniform(size=(60, 2)) * [1.0, size]
    found = what_decides(factors, ["a" if x > 0.5 * size else "b" for x in factors[:, 1]])
    assert found is not None
    assert found.accuracy > 0.95
    assert found.tree.factor == 1
    assert found.tree.threshold == pytest.approx(0.5 * size, rel=0.1)


def test_without_scikit_learn_everything_else_works(monkeypatch, biped, tmp_path):
    for name in ("sklearn", "sklearn.tree", "sklearn.inspection", "sklearn.model_selection"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MissingDependencyError, match=r"artde-gym\[multiverse\]"):
        what_decides(np.zeros((20, 1)), ["holds"] * 20)
    file = tmp_path / "design.yaml"
    file.write_text(json.dumps(BIPED))
    words = ["--out", str(biped.folder), "--workers", "1", "--report", "--figure", str(tmp_path / "claims.svg")]
    outcome = CliRunner().invoke(app, ["multiverse", "--design", str(file), *words])
    assert outcome.exit_code == 0, f"{outcome.output} {outcome.exception!r}"
    assert "scikit-learn" in outcome.output
    drawing = ElementTree.parse(tmp_path / "claims.svg").getroot()
    written = {element.text for element in drawing.iter() if element.tag.endswith("text")}
    assert {f"{verdict.claim.text} ({verdict.decided})" for verdict in biped.verdicts if verdict.decided} <= written
    assert (biped.folder / "report.html").stat().st_size > 10_000


def test_the_record_says_that_the_engine_is_the_default(quadrotor):
    assert quadrotor.provenance["engines"] == {"numpy": "default"}


@pytest.mark.once
def test_rank_correlations_find_a_monotone_factor():
    rng = np.random.default_rng(1)
    factors = rng.uniform(size=(300, 2))
    found, chance = rank_correlations(factors, np.exp(3 * factors[:, 0]))
    assert found[0] == pytest.approx(1.0)
    assert abs(found[1]) < chance < 0.2


def test_a_report_shows_every_claim_and_a_command(biped):
    text = write_report(biped.folder).read_text()
    for claim in biped.design.claims:
        assert claim.text in text
    assert "artde-gym evaluate" in text
    assert "<svg" in text
    assert "(nan" not in text


@pytest.mark.once
@pytest.mark.parametrize(
    ("env_id", "suffixes"),
    [("ArmTrack-Payload-v0", ("",)), ("BipedWalk-Payload-v0", ("",)), ("QuadInfinity-Payload-v0", ("_p", "_q"))],
)
def test_policies_side_by_side_do_what_each_does_alone(env_id, suffixes):
    env: Any = gym.make_vec(env_id, 6, vectorization_mode="vector_entry_point", engine=ENGINE[env_id])
    rng = np.random.default_rng(0)
    rates = [{f"gamma_0{suffix}": rate for suffix in suffixes} for rate in (50.0, 200.0)]
    stiff = [{f"c{suffix}": c for suffix in suffixes} for c in (0.1, 0.3)]
    made = [
        *(controllers.make("artde", env, **gains) for gains in rates),
        *(controllers.make("tde+kd", env, **gains) for gains in stiff),
        controllers.make("artde-robust", env),
        controllers.make("tde", env),
    ]
    together = SideBySide(
        made, ["artde", "artde", "tde+kd", "tde+kd", "artde-robust", "tde"], env.unwrapped.action_layout.size
    )
    assert len(together.parts) == 4
    observation, _ = env.reset(seed=3)
    state: Any = None
    alone: list[Any] = [None] * 6
    start = np.ones(6, np.bool_)
    for _ in range(20):
        action, state = together.predict(observation, state=state, episode_start=start)
        for i, policy in enumerate(made):
            one, alone[i] = policy.predict(observation[i : i + 1], state=alone[i], episode_start=start[i : i + 1])
            assert (action[i] == one[0]).all()
        whole: Any
        for (whole, rows), own in zip(together.parts, state.policies, strict=True):
            for place, i in enumerate(np.arange(6)[rows]):
                told, expected = whole.diagnostics(own), made[i].diagnostics(alone[i])
                assert told.keys() == expected.keys()
                assert all((told[name][place] == expected[name][0]).all() for name in told)
        start = np.zeros(6, np.bool_)
        observation = env.step(action)[0] + rng.normal(size=observation.shape) * 1e-3
    env.close()


ENGINE = {"ArmTrack-Payload-v0": "mujoco", "BipedWalk-Payload-v0": "mujoco", "QuadInfinity-Payload-v0": "numpy"}


def test_each_environment_of_a_vector_may_have_disturbances_of_its_own():
    env: Any = gym.make_vec("BipedWalk-Payload-v0", 3, vectorization_mode="vector_entry_point", engine="mujoco")
    rows = [{"payload": 1.0}, {"friction": 0.5, "mass_scale": 1.1}, {}]
    env.reset(seed=0, options={"disturbances": rows})
    assert [set(sampled) for sampled in env.unwrapped.sampled_disturbances] == [set(row) for row in rows]
    env.reset(seed=0)  # they stay
    assert env.unwrapped.sampled_disturbances[0]["payload"]["mass"] == 1.0
    env.reset(seed=0, options={"disturbances": {"payload": 2.0}})
    assert [one["payload"]["mass"] for one in env.unwrapped.sampled_disturbances] == [2.0] * 3
    with pytest.raises(OptionError, match="a list of 3, one for each environment"):
        env.reset(options={"disturbances": rows[:2]})
    env.close()


def test_other_folders_are_no_multiverse(tmp_path):
    with pytest.raises(StoreError, match="artde-gym multiverse"):
        read_multiverse(tmp_path)


def test_designs_are_left_alone():
    before = copy.deepcopy(BIPED)
    design(BIPED)
    assert before == BIPED


def test_a_metric_that_nobody_measures_is_refused():
    with pytest.raises(UnknownNameError, match="did you mean 'rmse_deg'"):
        verdict_of(smaller("artde", "tde", "rmse_dg"), WorldTable(by_hand(), "rmse_deg", ("artde", "tde")))
