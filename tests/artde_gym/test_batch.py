"""Episodes in batches: as one environment at a time has them, whatever the chunks and the workers."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest
from gymnasium.envs.registration import EnvSpec
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import ActionError, DisturbanceError, OptionError
from artde_gym.evaluation import Result, evaluate
from artde_gym.evaluation.tasks import Update, chunks_of
from artde_gym.motion.motion import KEY

TASKS = importlib.import_module("artde_gym.evaluation.tasks")
QUADROTOR = "QuadInfinity-Payload-v0"
WINDY: dict[str, Any] = {
    "payload": {"mass": {"uniform": [0.33, 0.37]}, "position": [0.01, 0.0, -0.1], "detach_time": 1.0},
    "push": [{"body": "body", "magnitude": {"uniform": [0.5, 2.0]}, "start": 0.5}],
    "wind": 1.0,
    "ground_effect": 1.0,
    "initial_position": {"offset": [{"uniform": [-0.005, 0.005]}] * 3},
}
FAILING = {"actuator_effectiveness": [{"joint": "front_left", "start": {"uniform": [0.2, 2.0]}}]}
"""A rotor stops at some time; some of the vehicles crash before the end."""
TOLERANCES = {"_m": 5e-4, "_deg": 0.05, "rms_thrust": 0.01, "rms_torque": 1e-3, "recovery_time": 0.02}


def fly(vectorized: bool = True, disturbances: Any = WINDY, duration: float = 1.6, **kwargs: Any) -> Result:
    kwargs = {"controllers": ["artde"], "episodes": 7, "env_kwargs": {"duration": duration}, **kwargs}
    return evaluate(kwargs.pop("controllers"), QUADROTOR, vectorized=vectorized, disturbances=disturbances, **kwargs)


def same(one: Result, other: Result) -> None:
    pd.testing.assert_frame_equal(one.episodes, other.episodes, check_exact=True, check_dtype=False)


def signals_of(path: Path) -> dict[str, Any]:
    """Read traces, but for the motion, which single environments alone leave."""
    stored = np.load(path)
    return {name: stored[name] for name in stored.files if not name.startswith(KEY)}


@pytest.mark.once
def test_batch_is_single_within_the_physics() -> None:
    single: Any
    batch: Any
    single, batch = (fly(vectorized, episodes=4).episodes for vectorized in (False, True))
    assert set(single) == set(batch)
    drawn = [name for name in single if name.startswith("disturbance.")]
    assert len(drawn) > 15
    pd.testing.assert_frame_equal(
        single[[*drawn, "seed"]], batch[[*drawn, "seed"]], check_exact=True, check_dtype=False
    )
    assert single["disturbance.payload.mass"].nunique() == 4
    compared = 0
    for name in single.columns.difference(drawn):
        for part, tolerance in TOLERANCES.items():
            if part in name:
                np.testing.assert_allclose(batch[name], single[name], rtol=0, atol=tolerance, err_msg=name)
                compared += 1
    assert compared > 20
    assert single["rmse_m"].min() > 1e-3
    assert np.isfinite(single["peak_error_m_drop"]).all()
    np.testing.assert_allclose(batch["energy_j"], single["energy_j"], rtol=1e-3)
    np.testing.assert_allclose(batch["reward"], single["reward"], rtol=1e-3)


@pytest.mark.once
def test_crashes_are_those_of_single() -> None:
    single: Any
    batch: Any
    single, batch = (fly(vectorized, FAILING, controllers=["pid"]).episodes for vectorized in (False, True))
    assert 0 < single["fell"].sum() < 7
    assert single["fell"].tolist() == batch["fell"].tolist()
    assert single["fall_reason"].tolist() == batch["fall_reason"].tolist()
    np.testing.assert_allclose(batch["time_to_fall_s"], single["time_to_fall_s"], atol=0.031)
    np.testing.assert_allclose(batch["rmse_m_x"], single["rmse_m_x"], atol=2e-3)


@pytest.mark.once
def test_bipeds_in_batches_are_single_ones_to_the_bit(tmp_path: Path) -> None:
    """Metrics and signals of walks that fall and of walks that do not; in the same engine nothing may differ."""
    ahead = {"magnitude": {"uniform": [1.0, 250.0]}, "start": 0.1, "duration": 0.1}
    mild: dict[str, Any] = {"payload": {"mass": {"uniform": [0.5, 1.5]}}, "push": [ahead], "mass_scale": 1.02}
    for vectorized in (False, True):
        evaluate(
            ["tde", "artde"],
            "BipedPush-v0",
            episodes=5,
            disturbances=mild,
            env_kwargs={"engine": "mujoco", "duration": 1.2, "control_period": 0.002},
            out=tmp_path / ("batch" if vectorized else "single"),
            record_episodes=2,
            vectorized=vectorized,
        )
    single, batch = tmp_path / "single", tmp_path / "batch"
    assert (single / "episodes.csv").read_bytes() == (batch / "episodes.csv").read_bytes()
    fell = pd.read_csv(single / "episodes.csv")["fell"].tolist()
    assert 0 < sum(fell) < len(fell)
    assert len(list(single.glob("traces/*/*.npz"))) == 4
    for path in single.glob("traces/*/*.npz"):
        one, other = signals_of(path), signals_of(batch / path.relative_to(single))
        assert set(one) == set(other)
        for name in one:
            assert np.array_equal(one[name], other[name]), name


@pytest.mark.parametrize(
    ("disturbances", "ways"),
    [
        pytest.param(WINDY, [(1, 1), (4, 2)], id="windy"),
        pytest.param(FAILING, [(1, 1), (3, 1)], id="failing", marks=pytest.mark.once),
    ],
)
def test_chunks_and_workers_do_not_change_a_bit(
    disturbances: Any, ways: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = fly(disturbances=disturbances)
    for size, workers in ways:
        monkeypatch.setattr(TASKS, "CHUNK", size)
        same(whole, fly(disturbances=disturbances, workers=workers))


@pytest.mark.once
def test_more_episodes_leave_the_first_ones_as_they_were() -> None:
    few: Any
    many: Any
    few, many = (fly(episodes=episodes, duration=0.5).episodes for episodes in (5, 1100))  # two of the vector's fleets
    pd.testing.assert_frame_equal(few, many[:5], check_exact=True)


def test_interruption_and_continuation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TASKS, "CHUNK", 3)

    def interrupt(update: Update) -> None:
        if update.finished >= 5:
            raise KeyboardInterrupt

    whole = fly(controllers=["tde", "artde"], out=tmp_path / "whole")
    part = fly(controllers=["tde", "artde"], out=tmp_path / "part", on_progress=interrupt)
    assert not part.complete
    assert 0 < len(part.episodes) < len(whole.episodes)
    monkeypatch.setattr(TASKS, "CHUNK", 2048)  # what is left may come in other chunks
    resumed = fly(controllers=["tde", "artde"], out=tmp_path / "part")
    assert resumed.complete
    same(resumed, whole)
    assert (tmp_path / "part" / "episodes.csv").read_bytes() == (tmp_path / "whole" / "episodes.csv").read_bytes()
    assert not (tmp_path / "part" / "traces").exists()


class Raw:
    """A policy of a user: it has no diagnostics, tells float32, and writes into what it observes."""

    name = "raw"

    def predict(self, observation: Any, state: Any = None, episode_start: Any = None, **_: Any) -> Any:
        count = np.zeros(len(observation)) if state is None else np.where(episode_start, 0.0, state)
        action = np.zeros((len(observation), 4), np.float32)
        action[:, 0] = 14.7 + 0.1 * np.sin(count)
        observation[:] = np.nan
        return action, count + 1.0


SHARED: dict[str, Any] = {
    "biped": {
        "controllers": ["tde", "artde", "tde-stiff"],
        "env_id": "BipedPush-v0",
        "disturbances": {
            "payload": {"mass": {"uniform": [0.5, 1.5]}},
            "push": [{"magnitude": {"uniform": [1.0, 250.0]}, "start": 0.1, "duration": 0.1}],
        },
        "env_kwargs": {"engine": "mujoco", "duration": 0.8, "control_period": 0.002},
    },
    "quadrotor": {
        "controllers": {"pid": "pid", "mine": Raw(), "artde": "artde", "soft": "artde", "ppo": "tde+ppo"},
        "env_id": QUADROTOR,
        "disturbances": {**WINDY, **FAILING},
        "env_kwargs": {"duration": 1.6},
        "gains": {"soft": {"gamma_0_p": 0.5}},
    },
    "arm": {
        "controllers": ["tde", "artde", "pid"],
        "env_id": "ArmTrack-Payload-v0",
        "disturbances": {"payload": {"mass": {"uniform": [0.5, 1.5]}}},
        "env_kwargs": {"engine": "mujoco", "duration": 0.6},
    },
}
"""Controllers that share a vector environment, some of which end early."""


@pytest.mark.parametrize("robot", SHARED)
def test_controllers_in_one_vector_are_each_one_alone_to_the_bit(robot: str, tmp_path: Path) -> None:
    options: dict[str, Any] = {**SHARED[robot], "episodes": 4, "record_episodes": 2, "vectorized": True}
    seen: list[Update] = []
    whole = evaluate(**options, out=tmp_path / "whole", on_progress=seen.append)
    assert sum(update.ended for update in seen) == 1  # all of them ran at once
    given, gains = options.pop("controllers"), options.pop("gains", {})
    named = given if isinstance(given, dict) else {name: name for name in given}
    for name, policy in named.items():
        own = {label: values for label, values in gains.items() if label == name}
        alone = evaluate({name: policy}, **options, gains=own, out=tmp_path / name)
        one: Any = whole.episodes[whole.episodes["controller"] == name].reset_index(drop=True)
        pd.testing.assert_frame_equal(one[list(alone.episodes)], alone.episodes, check_exact=True)
        assert one.drop(columns=list(alone.episodes)).isna().all(axis=None)
        traces = Path("traces", "custom")
        assert len(list((tmp_path / name / traces).iterdir())) == 2
        for path in (tmp_path / name / traces).iterdir():
            stored, other = np.load(path), np.load(tmp_path / "whole" / traces / path.name)
            assert stored.files == other.files
            assert all(np.array_equal(stored[signal], other[signal]) for signal in stored.files)


class Counting:
    """A policy that keeps its memory to itself, in which episodes at once are not told apart, nor are their number."""

    name = "counting"

    def predict(self, observation: Any, state: Any = None, **_: Any) -> Any:
        self.calls = 0 if state is None else self.calls + 1
        thrust = 14.7 + 0.1 * np.sin(self.calls) + 0.001 * len(observation)
        return np.tile([thrust, 0.0, 0.0, 0.0], (len(observation), 1)), True


@pytest.mark.parametrize("workers", [1, 2])
def test_one_policy_under_two_names_drives_as_under_each_alone(workers: int) -> None:
    policy = Counting()
    options: dict[str, Any] = {"episodes": 3, "duration": 0.4, "workers": workers}
    whole: Any = fly(controllers={"one": policy, "tde": "tde", "two": policy}, **options).episodes
    for name in ("one", "two"):
        alone: Any = fly(controllers={name: policy}, **options).episodes
        one = whole[whole["controller"] == name].reset_index(drop=True)
        pd.testing.assert_frame_equal(one[list(alone)], alone, check_exact=True)


def test_gains_in_arrays_are_told_apart_to_the_last_bit() -> None:
    gains = {name: {"k_p_p": np.array([8.0, 8.0, last])} for name, last in (("soft", 8.0), ("hard", 8.0 + 1e-10))}
    options: dict[str, Any] = {"episodes": 2, "duration": 0.4}
    whole: Any = fly(controllers=dict.fromkeys(gains, "tde"), gains=gains, **options).episodes
    for name, own in gains.items():
        alone: Any = fly(controllers={name: "tde"}, gains={name: own}, **options).episodes
        one = whole[whole["controller"] == name].reset_index(drop=True)
        pd.testing.assert_frame_equal(one, alone, check_exact=True)


def test_workers_share_the_controllers_of_a_vector() -> None:
    options: dict[str, Any] = {**SHARED["quadrotor"], "episodes": 3, "vectorized": True}
    whole = evaluate(**options)
    for workers in (2, 3):
        seen: list[Update] = []
        same(whole, evaluate(**options, workers=workers, on_progress=seen.append))
        assert sum(update.ended for update in seen) == workers


@pytest.mark.parametrize("share", [0.35, 0.6, 0.85])
def test_a_vector_of_controllers_killed_in_the_middle_of_its_rows_goes_on(share: float, tmp_path: Path) -> None:
    options: dict[str, Any] = {**SHARED["quadrotor"], "episodes": 3, "vectorized": True, "out": tmp_path}
    evaluate(**options)
    table = tmp_path / "episodes.csv"
    whole = table.read_bytes()
    table.write_bytes(whole[: round(share * len(whole))])
    assert evaluate(**options).complete
    assert table.read_bytes() == whole


@pytest.mark.parametrize("shape", [(1,), (3,), (2, 4)])
def test_actions_of_a_wrong_shape_are_refused_beside_other_controllers(shape: tuple[int, ...]) -> None:
    class Wrong:
        name = "wrong"

        def predict(self, observation: Any, state: Any = None, **_: Any) -> Any:
            return np.zeros((len(observation), *shape)), state

    for given in ({"tde": "tde", "wrong": Wrong()}, {"wrong": Wrong(), "tde": "tde"}, {"wrong": Wrong()}):
        with pytest.raises(ActionError, match=r"shape of the actions.*\(3, 4\)"):
            fly(controllers=given, episodes=3)


def test_traces_of_the_first_episodes_on_request(tmp_path: Path) -> None:
    fly(False, out=tmp_path / "single", record_episodes=1, episodes=2, duration=0.9)
    fly(True, out=tmp_path / "batch", record_episodes=2, episodes=3, duration=0.9)
    folder = tmp_path / "batch" / "traces" / "custom"
    assert sorted(path.name for path in folder.iterdir()) == ["artde-0.npz", "artde-1.npz"]
    assert [path.name for path in (tmp_path / "single" / "traces" / "custom").iterdir()] == ["artde-0.npz"]
    single, batch = (signals_of(tmp_path / part / "traces" / "custom" / "artde-0.npz") for part in ("single", "batch"))
    assert set(single) == set(batch)
    for name in single:
        assert single[name].shape == batch[name].shape, name
    assert batch["position"].shape == (61, 3)
    assert batch["policy.attitude_error"].shape == (60, 3)  # no decision at the end
    np.testing.assert_allclose(batch["position"], single["position"], atol=5e-4)


def test_traces_end_with_the_crash(tmp_path: Path) -> None:
    result = fly(disturbances=FAILING, controllers=["pid"], out=tmp_path, record_episodes=7, record_hz=20.0)
    for episode, time in zip(result.episodes["episode"], result.episodes["duration_s"], strict=True):
        traces = np.load(tmp_path / "traces" / "custom" / f"pid-{episode}.npz")
        assert time - 0.045 < traces["time"][-1] <= time + 1e-9
        assert len(traces["time"]) == len(traces["position"])


def test_progress_counts_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TASKS, "CHUNK", 4)
    seen: list[Update] = []
    fly(on_progress=seen.append)
    ended = [update.finished for update in seen if update.ended]
    assert ended == [3, 7]
    assert {update.total for update in seen} == {7}
    assert any(0 < update.time_s < 1.6 for update in seen)


def test_chunks_cover_all_evenly() -> None:
    for episodes in (1, 7, 2048, 2049, 10_000):
        chunks = chunks_of(episodes, 2048)
        assert [i for chunk in chunks for i in chunk] == list(range(episodes))
        sizes = {len(chunk) for chunk in chunks}
        assert max(sizes) <= 2048
        assert max(sizes) - min(sizes) <= 1


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"env_id": "BipedPush-v0", "env_kwargs": {"engine": "bullet"}}, OptionError, ["engine", "bullet", "'mujoco'"]),
        ({"env_id": "BipedPush-v0", "env_kwargs": {"threads": 0}}, OptionError, ["threads", "0", ">= 1"]),
        ({"vectorized": "bach"}, OptionError, ["vectorized", "bach", "True, False"]),
        ({"record_episodes": -1}, OptionError, ["record_episodes", "-1"]),
        ({"env_kwargs": {"engine": "bullet"}}, OptionError, ["engine", "bullet", "numpy"]),
        ({"env_kwargs": {"num_envs": 3}}, OptionError, ["num_envs", "duration"]),
        ({"env_kwargs": {"dtype": "float16"}}, OptionError, ["dtype", "float16"]),
        ({"disturbances": {"wind": -1.0}}, DisturbanceError, ["wind.scale", "-1"]),
    ],
)
def test_bad_arguments_are_refused_before_the_first_episode(
    arguments: dict[str, Any], error: type[Exception], words: list[str], tmp_path: Path
) -> None:
    given = {"env_id": QUADROTOR, "vectorized": True, "out": tmp_path / "run", **arguments}
    with pytest.raises(error) as caught:
        evaluate(["artde"], episodes=1, **given)
    for word in words:
        assert word in str(caught.value)
    assert not (tmp_path / "run").exists()


def test_an_environment_without_a_vector_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = EnvSpec("Alone-v0", entry_point="artde_gym.envs.biped_walk:BipedWalkPayloadEnv")
    monkeypatch.setitem(gym.registry, "Alone-v0", alone)
    with pytest.raises(OptionError, match=rf"to be vectorized.*Alone-v0.*BipedPush-v0.*{QUADROTOR}"):
        evaluate(["tde"], "Alone-v0", episodes=1, vectorized=True)


@pytest.mark.parametrize("vectorized", [False, pytest.param(True, marks=pytest.mark.once)])
def test_command_prints_table_31_beside_ours(vectorized: bool, tmp_path: Path) -> None:
    arguments = ["evaluate", "--env", QUADROTOR, "--controllers", "tde,atde,artde,asmc", *["--vectorized"] * vectorized]
    arguments += ["--episodes", "2", "--workers", "1", "--out", str(tmp_path / "run")]
    outcome = CliRunner().invoke(app, [*arguments, "--env-kwargs", json.dumps({"duration": 0.6})])
    assert outcome.exit_code == 0, outcome.output
    for word in ("Q1: infinity", "Table 3.1", "RMS error (m)", "15.320", "psi", "all"):
        assert word in outcome.output
    assert outcome.output.count("Table 3.1") == 2  # not in Q1-calm: there was a fan in the thesis
    folder = tmp_path / "run"
    assert json.loads((folder / "summary.json").read_text())["configuration"]["vectorized"] == vectorized
    table = pd.read_csv(folder / "episodes.csv")
    assert table["scenario"].unique().tolist() == ["Q1", "Q1-calm", "Q1-gale"]
    assert len(table) == 2 * 4 * 3
