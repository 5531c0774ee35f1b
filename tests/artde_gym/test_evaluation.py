"""The harness from outside: intervals against known values, the same seeds for all, folders that survive."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console
from typer.testing import CliRunner

import artde_gym
from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError, DisturbanceError, OptionError, StoreError, UnknownNameError
from artde_gym.evaluation import Result, evaluate, read_result, statistics, thesis
from artde_gym.evaluation.console import print_result
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.tasks import Update
from artde_gym.robots.ojas.thesis import JOINTS, REPORTED
from artde_gym.robots.q450 import task as quadrotor_task
from artde_gym.scenarios import SCENARIOS
from artde_gym.studies import reproduce
from controllers import GainError

SHORT: dict[str, Any] = {"duration": 0.4, "control_period": 0.004, "actuator_inertia": "lumped"}


def short(controllers: Any = ("tde", "artde"), **kwargs: Any) -> Result:
    kwargs.setdefault("scenario", "S2")
    return evaluate(controllers, **{"episodes": 2, "env_kwargs": SHORT, **kwargs})


# ---------------------------------------------------------------- statistics


def test_wilson_interval_known_value() -> None:
    """8 of 10: 0.490 to 0.943 (Newcombe 1998's formula by hand with z = 1.959964)."""
    z, n, p = 1.959964, 10, 0.8
    center = (p + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    estimate = statistics.rate(8, 10)
    assert (estimate.low, estimate.high) == pytest.approx((center - half, center + half), abs=1e-5)
    assert statistics.rate(0, 5).low == 0
    assert statistics.rate(5, 5).high == pytest.approx(1)


@pytest.mark.once
def test_bootstrap_interval_covers_the_mean_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(200):
        estimate = statistics.mean(rng.normal(3.0, 1.0, size=40))
        inside += estimate.low <= 3.0 <= estimate.high
    assert 0.88 <= inside / 200 <= 0.99


@pytest.mark.once
def test_intervals_of_many_values_join_those_of_few() -> None:
    """Beyond `MANY` values the central limit's interval takes over from the bootstrap's."""
    rng = np.random.default_rng(0)
    theirs = rng.gamma(4.0, size=statistics.MANY)
    ours = 0.8 * theirs + 0.2 * rng.normal(size=statistics.MANY)
    more = [np.append(values, values.mean()) for values in (ours, theirs)]
    for few, many in (
        (statistics.mean(ours), statistics.mean(more[0])),
        (statistics.improvement(ours, theirs), statistics.improvement(*more)),
    ):
        assert many.n == few.n + 1 > statistics.MANY
        assert many.value == pytest.approx(few.value, rel=1e-2)
        for bound in ("low", "high"):
            assert getattr(many, bound) == pytest.approx(getattr(few, bound), abs=0.06 * (few.high - few.low))


def test_mean_of_few_and_of_broken_values() -> None:
    assert statistics.mean([2.0])[0] == 2.0
    assert np.isnan(statistics.mean([2.0]).low)
    assert statistics.mean([2.0, 2.0])[:3] == (2.0, 2.0, 2.0)
    assert statistics.mean([1.0, np.nan, 3.0, np.inf]).n == 2
    assert statistics.mean([]).n == 0
    assert statistics.win_probability([1, 2, 3], [2, 2, 2]) == 0.5


def test_comparison_pairs_by_episode_and_leaves_fallen_pairs_out() -> None:
    rows = [
        {"scenario": "S", "controller": name, "episode": i, "seed": i, "fell": fell, "duration_s": 1.0}
        | {"time_to_fall_s": 0.5 if fell else np.nan, "rmse_deg": error}
        for name, values in {"a": [(1.0, 0), (2.0, 0), (9.0, 1)], "b": [(2.0, 0), (4.0, 0), (1.0, 0)]}.items()
        for i, (error, fell) in enumerate(values)
    ]
    table = Result(pd.DataFrame(rows)).compare("a", "b")
    row = table.loc[("S", "rmse_deg")]
    assert row["pairs"] == 2
    assert row["difference"] == -1.5
    assert row["percent"] == pytest.approx(-50.0)
    assert row["win_probability"] == 1.0
    assert table.loc[("S", "fell")]["difference"] == pytest.approx(1 / 3)
    with pytest.raises(UnknownNameError, match="'c'"):
        Result(pd.DataFrame(rows)).compare("a", "c")


# ---------------------------------------------------------------- thesis


def test_thesis_values_and_the_improvements_it_claims() -> None:
    """Design: over all joints the least improvement of ARTDE's RMSE in Table 2.1 is 32.7 % and 20.1 %."""
    assert thesis.value("S1", "tde", "rmse_deg", "q4") == 3.264
    assert thesis.value("S2", "tde", "rmse_deg", "q4") is None
    for rival, least in (("tde", 0.327), ("atde", 0.201)):
        gains = [
            1 - REPORTED["S1"].values["artde"]["rmse_deg"][joint] / REPORTED["S1"].values[rival]["rmse_deg"][joint]
            for joint in JOINTS
        ]
        assert min(gains) == pytest.approx(least, abs=5e-4)


# ---------------------------------------------------------------- evaluate


@pytest.mark.once
def test_same_seed_same_disturbances_whatever_the_controller() -> None:
    episodes: Any = short(episodes=3).episodes
    drawn = [name for name in episodes if name.startswith("disturbance.")]
    assert len(drawn) > 5
    tde, artde = (episodes[episodes["controller"] == name].set_index("episode")[drawn] for name in ("tde", "artde"))
    pd.testing.assert_frame_equal(tde, artde)
    assert tde["disturbance.push.0.magnitude"].nunique() == 3
    assert tde["disturbance.push.0.magnitude"].between(0.5, 5.0).all()


def test_workers_do_not_change_results() -> None:
    alone, together = short(workers=1).episodes, short(workers=2).episodes
    pd.testing.assert_frame_equal(alone, together, check_exact=True)


def test_environment_as_it_is_and_episode_seeds() -> None:
    result = short(scenario=None, disturbances={"payload": 0.5})
    assert result.scenarios == ["custom"]
    assert set(result.episodes["disturbance.payload.mass"]) == {0.5}
    assert result.episodes["seed"].tolist()[0] == episode_seed(0, 0)
    seeds = {episode_seed(seed, episode) for seed in range(20) for episode in range(20)}
    assert len(seeds) == 400


class Limp:
    """A policy object of a user's own, without `diagnostics` and without state."""

    name = "limp"

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> Any:
        return np.zeros(12), None


def make_limp(env: Any, **_: Any) -> Limp:
    return Limp()


@pytest.mark.parametrize("workers", [1, 2])
def test_policy_objects_and_registered_controllers(workers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    from artde_gym import registration

    monkeypatch.setattr(registration, "_controllers", dict(registration._controllers))
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    artde_gym.register_controller("mine", "test_evaluation:make_limp")
    import test_evaluation  # as a worker will import it

    result = short({"mine": "mine", "object": test_evaluation.Limp()}, episodes=1, workers=workers)
    table: Any = result.episodes
    mine, other = (table[table["controller"] == name].iloc[0] for name in ("mine", "object"))
    assert mine["rmse_deg"] == other["rmse_deg"] > 1.0
    assert np.isnan(mine["tde_error_rms"])


@pytest.mark.once
def test_gains_reach_the_controller() -> None:
    soft, stiff = (short(["tde"], episodes=1, gains=gains) for gains in ({"tde": {"k_p": 1.0}}, None))
    assert soft.episodes["rmse_deg"].tolist() != stiff.episodes["rmse_deg"].tolist()


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"controllers": ["tdee"]}, UnknownNameError, ["tdee", "did you mean 'tde'"]),
        ({"controllers": []}, OptionError, ["controllers"]),
        ({"controllers": ["tde", "tde"]}, OptionError, ["tde", "twice"]),
        ({"controllers": [3]}, OptionError, ["3", "predict"]),
        ({"scenario": "S9"}, UnknownNameError, ["S9", "S1-L4"]),
        ({"scenario": []}, OptionError, ["scenario"]),
        ({"gains": {"artde": {"gama_0": 1}}}, GainError, ["gama_0", "gamma_0"]),
        ({"gains": {"artde": {"gamma_0": -1}}}, GainError, ["gamma_0", "-1"]),
        ({"gains": {"atde": {}}}, UnknownNameError, ["atde"]),
        ({"episodes": 0}, OptionError, ["episodes", "0"]),
        ({"workers": 0}, OptionError, ["workers", "0"]),
        ({"seed": -1}, OptionError, ["seed", "-1"]),
        ({"record_hz": 0.0}, OptionError, ["record_hz"]),
        ({"env_kwargs": {"durration": 1}}, OptionError, ["durration", "duration"]),
        ({"env_kwargs": {"control_period": 0.0011}}, OptionError, ["control_period", "0.0011"]),
        ({"env_kwargs": {"disturbances": {}}}, OptionError, ["env_kwargs", "disturbances"]),
        ({"env_kwargs": {"speed": {1}}}, OptionError, ["env_kwargs", "JSON"]),
        ({"disturbances": {"payload": float("inf")}}, DisturbanceError, ["payload.mass", "inf"]),
    ],
)
def test_bad_arguments_are_refused_before_the_first_episode(
    arguments: dict[str, Any], error: type[Exception], words: list[str], tmp_path: Path
) -> None:
    with pytest.raises(error) as caught:
        short(arguments.pop("controllers", ("tde", "artde")), out=tmp_path / "run", **arguments)
    assert isinstance(caught.value, (ArtdeGymError, GainError))
    for word in words:
        assert word in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_scenarios_are_what_the_design_fixes() -> None:
    assert set(SCENARIOS) >= {"S1", "S2", "S1-L4", "S2-L4"}
    assert SCENARIOS["S2-L4"].kwargs == {"control_period": 0.004}
    assert "payload" not in SCENARIOS["S1"].disturbances
    assert SCENARIOS["S2"].disturbances["payload"]["mass"] == 1.3


# ---------------------------------------------------------------- store


def test_folder_holds_what_the_documentation_says(tmp_path: Path) -> None:
    result = short(out=tmp_path / "run")
    folder = tmp_path / "run"
    table = read_result(folder).episodes
    assert list(table["controller"]) == list(result.episodes["controller"])
    np.testing.assert_array_equal(table["rmse_deg_q3"], result.episodes["rmse_deg_q3"])  # to the last bit
    assert {"env", "scenario", "seed", "episode", "fell", "time_to_fall_s", "max_abs_error_deg_q6"} <= set(table)
    summary = pd.read_csv(folder / "summary.csv")
    assert {"scenario", "controller", "metric", "mean", "low", "high", "median", "n"} == set(summary)
    record = json.loads((folder / "summary.json").read_text())
    assert record["episodes"] == 4
    assert record["configuration"]["seed"] == 0
    assert record["provenance"]["packages"]["mujoco"]
    traces = np.load(folder / "traces" / "S2" / "artde-1.npz")
    assert traces["time"] == pytest.approx(0.008 * np.arange(51))  # 125 Hz is the nearest whole stride of 4 ms
    assert traces["q"].shape == (51, 12)
    assert {"policy.sigma", "policy.s", "policy.beta_0", "policy.beta_1"} <= set(traces)
    assert traces["foot_loads"].shape == (51, 2)
    assert traces["foot_loads"].sum(axis=1).mean() == pytest.approx(9.81 * (8.986 + 1.3), rel=0.05)  # it stands


def test_traces_at_full_rate_on_request(tmp_path: Path) -> None:
    short(["tde"], episodes=1, out=tmp_path, record_hz=float("inf"))
    assert np.load(tmp_path / "traces" / "S2" / "tde-0.npz")["q"].shape == (101, 12)


def test_interruption_keeps_episodes_and_the_same_call_continues(tmp_path: Path) -> None:
    whole = short(episodes=3, out=tmp_path / "whole")

    def interrupt(update: Update) -> None:
        if update.finished == 4:
            raise KeyboardInterrupt

    part = short(episodes=3, out=tmp_path / "part", on_progress=interrupt)
    assert not part.complete
    assert len(part.episodes) == 3
    assert len(pd.read_csv(tmp_path / "part" / "episodes.csv")) == 3
    assert (tmp_path / "part" / "summary.csv").exists()

    seen: list[Update] = []
    resumed = short(episodes=3, out=tmp_path / "part", on_progress=seen.append)
    assert sum(update.ended for update in seen) == 3
    assert resumed.complete
    pd.testing.assert_frame_equal(resumed.episodes, whole.episodes, check_exact=True, check_dtype=False)
    assert (tmp_path / "part" / "episodes.csv").read_bytes() == (tmp_path / "whole" / "episodes.csv").read_bytes()


def test_a_row_cut_off_by_a_crash_is_run_again(tmp_path: Path) -> None:
    whole = short(out=tmp_path)
    path = tmp_path / "episodes.csv"
    good = path.read_bytes()
    path.write_bytes(good[:-40])
    resumed = short(out=tmp_path)
    assert path.read_bytes() == good
    pd.testing.assert_frame_equal(resumed.episodes, whole.episodes, check_exact=True, check_dtype=False)


def test_a_folder_with_other_results_is_refused(tmp_path: Path) -> None:
    short(["tde"], episodes=1, out=tmp_path / "run")
    before = (tmp_path / "run" / "episodes.csv").read_bytes()
    with pytest.raises(StoreError, match=r"other results.*seed"):
        short(["tde"], episodes=1, seed=1, out=tmp_path / "run")
    assert (tmp_path / "run" / "episodes.csv").read_bytes() == before
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(StoreError, match="other files"):
        short(["tde"], episodes=1, out=tmp_path / "mine")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "summary.json").write_text("{")
    with pytest.raises(StoreError, match="readable"):
        short(["tde"], episodes=1, out=tmp_path / "broken")


# ---------------------------------------------------------------- command line


def test_command_prints_ours_beside_the_thesis(tmp_path: Path) -> None:
    arguments = ["evaluate", "--scenario", "S1", "--episodes", "1", "--env-kwargs", json.dumps(SHORT)]
    outcome = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "run"), "--workers", "1"])
    assert outcome.exit_code == 0, outcome.output
    for word in (
        "S1: walk without payload",
        "Table 2.1",
        "RMS error (deg)",
        "RMS torque (Nm)",
        "3.264",
        "-36.5",
        "no fall",
    ):
        assert word in outcome.output
    listing = CliRunner().invoke(app, ["list"]).output
    for word in (
        "BipedWalk-Payload-v0",
        "S2-L4",
        "artde-robust",
        "computed-torque",
        "bullet, mujoco, batch",
        "wind.scale",
    ):
        assert word in listing


@pytest.mark.bullet
def test_reproduce_runs_both_robots_in_both_engines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("S1", "Q1"):
        monkeypatch.setitem(SCENARIOS._entries, name, dataclasses.replace(SCENARIOS[name], kwargs={"duration": 0.2}))
    arguments = ["reproduce", "--scenario", "S1,Q1", "--episodes", "1", "--workers", "1", "--out", str(tmp_path)]
    outcome = CliRunner().invoke(app, [*arguments, "--engine", "both"])
    assert outcome.exit_code == 0, outcome.output
    for word in (
        "S1: walk",
        "Table 2.1",
        "Q1: infinity",
        "Table 3.1",
        "no controller crashes",
        "geometric",
        "confirmed",
    ):
        assert word in outcome.output
    for engine in ("bullet", "mujoco"):
        assert set(pd.read_csv(tmp_path / engine / "biped" / "claims.csv")["scenario"]) == {"S1"}
        assert set(pd.read_csv(tmp_path / engine / "quadrotor" / "claims.csv")["scenario"]) == {"Q1"}
    assert CliRunner().invoke(app, [*arguments, "--robot", "biped"]).output.count("Table 3.1") == 0
    assert run_command("reproduce", "--robot", "bipedal").returncode == 2


@pytest.mark.once
def test_the_ablation_is_as_stiff_as_artde_was_in_the_same_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("S1", "S2"):
        monkeypatch.setitem(SCENARIOS._entries, name, dataclasses.replace(SCENARIOS[name], kwargs=SHORT))
    without = reproduce("biped", tmp_path, scenarios=["S1", "S2"], episodes=2)
    assert "tde+kd" not in without.result.controllers
    assert not without.claims["claim"].str.contains("tde+kd", regex=False).any()
    found = reproduce("biped", tmp_path, scenarios=["S1", "S2"], episodes=2, ablation=True)  # adds to what is there
    assert found.claims["claim"].str.contains("tde+kd", regex=False).sum() == 2
    gains = {}
    for name in ("S1", "S2"):
        mean = found.result.values(name, "artde", "robust_gain_mean").mean()
        record = json.loads((tmp_path / "ablation" / name / "summary.json").read_text())
        gains[name] = record["configuration"]["gains"]["tde+kd"]["c"]
        assert gains[name] == mean
        own: dict[str, Any] = {"gains": {"tde+kd": {"c": mean}}, "env_kwargs": {"engine": "mujoco"}}
        again = evaluate(["tde+kd"], scenario=name, episodes=2, **own)
        assert again.values(name, "tde+kd", "rmse_deg").tobytes() == (
            found.result.values(name, "tde+kd", "rmse_deg").tobytes()
        )
    assert gains["S1"] != gains["S2"]
    with pytest.raises(OptionError, match="the ablation takes its gain"):
        reproduce("biped", tmp_path / "other", scenarios=["S1"], controllers=["tde"], ablation=True)
    with pytest.raises(OptionError, match="ablation=True"):
        reproduce("biped", tmp_path / "other", scenarios=["S1"], controllers=["tde", "tde+kd"])
    assert not (tmp_path / "other").exists()


@pytest.mark.once
def test_one_command_evaluates_both_robots(tmp_path: Path) -> None:
    arguments = ["evaluate", "--scenario", "S1,Q1", "--controllers", "tde,artde", "--episodes", "1", "--workers", "1"]
    arguments += ["--env-kwargs", json.dumps({"duration": 1.4}), "--out", str(tmp_path / "run")]
    outcome = CliRunner().invoke(app, arguments)
    assert outcome.exit_code == 0, outcome.output
    for word in ("Table 2.1", "RMS error (deg)", "Table 3.1", "RMS error (m)", "peak (deg)"):
        assert word in outcome.output
    assert "peak (m)" not in outcome.output  # the flight ends before the drop


def test_a_recovery_that_never_came_is_counted() -> None:
    rows = [
        {"scenario": "custom", "controller": "artde", "env": "QuadInfinity-Payload-v0", "episode": i, "seed": i}
        | {"fell": False, "time_to_fall_s": np.nan, "duration_s": 1.0, "recovery_time_s_drop": time}
        | {"peak_error_m_drop": 0.25}
        for i, time in enumerate((1.0, 2.0, np.inf))
    ]
    tracking = quadrotor_task.METRICS_SPEC
    for row in rows:
        row |= {
            f"{metric}_{tracked.unit}_{axis}": 0.1
            for metric in ("rmse", "max_abs_error")
            for tracked in tracking.errors
            for axis in tracked.axes
        }
        row |= {f"rms_{effort.name}_{effort.unit}_{axis}": 0.1 for effort in tracking.efforts for axis in effort.axes}
        row["rmse_m"] = 0.1
    console = Console(record=True, width=100)
    print_result(Result(pd.DataFrame(rows)), console)
    text = console.export_text()
    assert "2/3 (21..94 %)" in text
    assert "2.00" in text  # the median, with never as the largest
    assert "0.2500" in text


def run_command(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "artde_gym.cli", *arguments], capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["evaluate", "--controllers", "tdee"], ["tdee", "did you mean 'tde'"]),
        (["evaluate", "--gains", "{"], ["--gains", "JSON"]),
        (["evaluate", "--env", "BipedRun-v0"], ["BipedRun"]),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(arguments: list[str], words: list[str], tmp_path: Path) -> None:
    outcome = run_command(*arguments, "--out", str(tmp_path / "run"))
    assert outcome.returncode == 2
    assert "Traceback" not in outcome.stderr
    assert len(outcome.stderr.strip().splitlines()) == 1
    for word in words:
        assert word in outcome.stderr


def workers_of(pid: int) -> list[int]:
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [int(child) for child in children]


def alive(pid: int) -> bool:
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().split(")")[1].split()[0]
    except FileNotFoundError:
        return False


def test_workers_end_with_a_parent_that_was_killed(tmp_path: Path) -> None:
    arguments = ["evaluate", "--scenario", "S2", "--controllers", "tde", "--episodes", "500", "--workers", "2"]
    process = subprocess.Popen(
        [sys.executable, "-m", "artde_gym.cli", *arguments, "--out", str(tmp_path / "run")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    workers: list[int] = []
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and len(workers) < 3:  # two and multiprocessing's resource tracker
        time.sleep(0.1)
        workers = workers_of(process.pid)
    time.sleep(3.0)  # into their first episodes
    process.kill()
    process.wait()
    while time.monotonic() < deadline and any(map(alive, workers)):
        time.sleep(0.1)
    assert not any(map(alive, workers))


def test_ctrl_c_keeps_every_finished_episode(tmp_path: Path) -> None:
    """A real interrupt to a real process group, workers included."""
    arguments = ["evaluate", "--scenario", "S2", "--controllers", "tde", "--episodes", "500", "--workers", "2"]
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "artde_gym.cli",
            *arguments,
            "--env-kwargs",
            json.dumps(SHORT),
            "--out",
            str(tmp_path / "run"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # background jobs are born ignoring it
    )
    table = tmp_path / "run" / "episodes.csv"
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and (not table.exists() or table.read_text().count("\n") < 4):
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    assert "Interrupted" in output
    rows = pd.read_csv(table)
    assert 3 <= len(rows) < 500
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["episodes"] == len(rows)
