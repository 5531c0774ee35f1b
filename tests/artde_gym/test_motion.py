"""Motion in traces and replays made of it: what was simulated, to the rounding of the format."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from typer.testing import CliRunner

import artde_gym
import controllers
from artde_gym.cli import app
from artde_gym.errors import OptionError, RobotError, StoreError, UnknownNameError
from artde_gym.evaluation import Result, evaluate
from artde_gym.evaluation.environments import single
from artde_gym.evaluation.replay import replay_folder, worst_median_best
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.takes import Take
from artde_gym.kit import PAYLOAD, ROBOTS
from artde_gym.motion import page
from artde_gym.motion.motion import FORCE, JOINT, PLACE, SHOWN, TURN, Motion, Pose
from artde_gym.motion.packing import Packed
from artde_gym.motion.scene import Scene, scene_of
from artde_gym.robots.ojas.model import ojas
from artde_gym.scenarios import SCENARIOS

ROOT = Path(__file__).parents[2]
VIEWER = ROOT / "scripts/viewer"
QUADROTOR = "QuadInfinity-Payload-v0"
SHORT = {"duration": 0.9}


class Rest:
    """A policy of a user's own, which does nothing."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.zeros(4), None


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights") / "run"
    evaluate(["tde", "artde"], QUADROTOR, episodes=4, seed=2, out=folder, env_kwargs=SHORT)
    return folder


@given(arrays.arrays(np.int64, (7, 2), elements=st.integers(-16000, 16000)), st.integers(-(2**29), 2**29))
def test_packed_columns_come_back_to_half_a_unit(whole, far):
    columns = (whole + 0.4) * [1e-4, 0.5] + [far * 1e-4, 0.0]
    packed = Packed.of(columns, [1e-4, 0.5])
    assert np.abs(packed.columns() - columns).max() <= 0.25 + 1e-9
    assert np.abs(packed.columns() - columns)[:, 0].max() <= 0.5e-4 + 1e-9


def test_numbers_that_are_none_are_packed_as_something():
    packed = Packed.of([[np.nan], [np.inf], [-np.inf], [1.0]], [1.0])
    assert np.isfinite(packed.columns()).all()


def test_a_motion_comes_back_from_traces():
    turning: list[Any] = [(0.0, 0.0, np.sin(a / 2), np.cos(a / 2)) for a in np.linspace(0.0, 7.0, 30)]
    flipped: list[Any] = [tuple(-x for x in quat) if i % 2 else quat for i, quat in enumerate(turning)]
    payload = [None, *[(0.1 * i, 2.0, 1.0 - 0.06 * i) for i in range(29)]]
    poses = [Pose((5.0 + i, 0.0, 1.0), flipped[i], [0.1 * i, -i], payload[i], [i]) for i in range(30)]
    motion = Motion.of(poses, 0.02)
    back = Motion.read(motion.traces())
    assert back is not None
    assert back.period == 0.02
    for name, unit in (("q", JOINT), ("payload", PLACE), ("loads", FORCE)):
        np.testing.assert_allclose(getattr(back, name), getattr(motion, name), rtol=0, atol=0.51 * unit)
    np.testing.assert_allclose(back.base[:, :3], motion.base[:, :3], rtol=0, atol=0.51 * PLACE)
    assert (np.abs((back.base[:, 3:] * turning).sum(axis=1)) > 1 - TURN).all()
    assert np.abs(np.diff(back.base[:, 3:], axis=0)).max() < 0.2  # no flips
    there = np.isfinite(back.payload[:, 0])
    assert list(there) == [False, *[1.0 - 0.06 * i >= -0.3 for i in range(29)]]  # it falls through the ground
    assert Motion.read({"time": np.zeros(3)}) is None


@pytest.mark.once
def test_a_long_motion_is_thinned_for_a_page():
    poses = [Pose((0.0, 0.0, i / 1e4), (0.0, 0.0, 0.0, 1.0)) for i in range(2 * SHOWN + 1)]
    motion = Motion.of(poses, 0.01).thinned()
    assert motion.period == pytest.approx(0.03)
    assert len(motion.base) <= SHOWN
    np.testing.assert_allclose(motion.base[:, 2], 3e-4 * np.arange(len(motion.base)), atol=1e-9)


@pytest.mark.once
@pytest.mark.parametrize(("scenario", "control_period"), [("S2", 0.004), ("Q1", 0.015)])
def test_traces_hold_what_the_engine_says(tmp_path, engine_name, scenario, control_period):
    kwargs = {"duration": 0.3, "engine": engine_name, "control_period": control_period}
    evaluate(["tde"], scenario=scenario, episodes=1, out=tmp_path, env_kwargs=kwargs)
    found = Motion.read(np.load(tmp_path / f"traces/{scenario}/tde-0.npz"))
    assert found is not None
    entry = SCENARIOS[scenario]
    env = single(entry.env_id, json.dumps({**kwargs, "disturbances": dict(entry.disturbances)}))
    policy = controllers.make("tde", env)
    observation, info = env.reset(seed=episode_seed(0, 0))
    state, over, stride, engine = None, False, round(found.period / control_period), env.unwrapped.engine
    seen: list[Any] = []
    while True:
        if round(info["time_s"] / control_period) % stride == 0:
            seen.append((engine.state(), engine.payload_position(), engine.foot_loads()))
        if over:
            break
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        over = terminated or truncated
    assert 1 / 70 < found.period < 1 / 50
    for i, (state, payload, loads) in enumerate(seen):
        np.testing.assert_allclose(found.base[i, :3], state.position, rtol=0, atol=0.51 * PLACE)
        sign = np.sign(found.base[i, 3:] @ state.quat_xyzw)
        np.testing.assert_allclose(sign * found.base[i, 3:], state.quat_xyzw, rtol=0, atol=0.51 * TURN)
        np.testing.assert_allclose(found.q[i], state.q, rtol=0, atol=0.51 * JOINT)
        np.testing.assert_allclose(found.payload[i], payload, rtol=0, atol=0.51 * PLACE)
        np.testing.assert_allclose(found.loads[i], loads, rtol=0, atol=0.51 * FORCE)
    assert len(seen) == len(found.base) > 15


def test_the_worst_the_median_and_the_best_are_shown(flights):
    rows = pd.read_csv(flights / "episodes.csv")
    errors = {number: float(rows.loc[rows["episode"] == number, "rmse_m"].mean()) for number in range(4)}
    order = sorted(errors, key=lambda number: errors[number])
    (figure,) = replay_folder(flights).figures
    found = {episode["rank"]: episode["number"] for episode in figure["episodes"]}
    assert found == {"worst": order[-1], "median": order[1], "best": order[0]}
    assert [run["name"] for run in figure["episodes"][0]["runs"]] == ["tde", "artde"]
    assert worst_median_best([4]) == {4: ""}
    assert worst_median_best([4, 2]) == {2: "worst", 4: "best"}
    (figure,) = replay_folder(flights, controllers=["artde"], episode=2).figures
    assert [(one["number"], len(one["runs"])) for one in figure["episodes"]] == [(2, 1)]


def test_a_result_shows_itself(flights):
    result = Result(pd.read_csv(flights / "episodes.csv"), flights)
    shown = result.replay(controllers=["tde"])._repr_html_()
    assert shown.startswith('<iframe sandbox="allow-scripts"')
    assert shown.count("<") == 2  # the page is an attribute of the frame
    with pytest.raises(OptionError, match="folder None holds no result; store with"):
        Result(result.episodes).replay()


def test_what_a_folder_does_not_have_is_refused(flights, tmp_path):
    refused: tuple[tuple[dict[str, Any], type[Exception]], ...] = (
        ({"scenario": "S9"}, UnknownNameError),
        ({"controllers": ["nobody"]}, UnknownNameError),
        ({"controllers": ["tde"] * 5}, OptionError),
        ({"controllers": []}, OptionError),
        ({"episode": 9}, OptionError),
    )
    for arguments, error in refused:
        with pytest.raises(error):
            replay_folder(flights, **arguments)
    with pytest.raises(StoreError):
        replay_folder(tmp_path)
    unfinished = shutil.copytree(flights, tmp_path / "unfinished")
    (unfinished / "episodes.csv").unlink()
    with pytest.raises(StoreError, match="has no finished episode"):
        replay_folder(unfinished)


@pytest.mark.parametrize(("option", "value"), [("--seed", "5"), ("--engine", "mujoco"), ("--gains", "{}")])
def test_an_option_without_effect_on_a_folder_is_refused(flights, tmp_path, option, value):
    answer = CliRunner().invoke(app, ["replay", str(flights), option, value, "--out", str(tmp_path / "x.html")])
    assert isinstance(answer.exception, OptionError)
    assert answer.exception.field == option


def test_an_old_folder_is_run_again_and_what_does_not_repeat_is_said(flights, tmp_path):
    old = tmp_path / "old"
    shutil.copytree(flights, old)
    shutil.rmtree(old / "traces")
    new, again = (replay_folder(folder, controllers=["tde"], episode=1) for folder in (flights, old))
    assert again.notes == ()
    assert again.figures == new.figures
    table = pd.read_csv(old / "episodes.csv", dtype=str, keep_default_na=False)
    table.assign(duration_s="0.6").to_csv(old / "episodes.csv", index=False)
    (note,) = replay_folder(old, controllers=["tde"]).notes
    assert re.search(r"tde .* did not repeat: it ended at 0.900 s.*, while .* ended at 0.600 s", note)
    out = tmp_path / "x.html"
    answer = CliRunner().invoke(app, ["replay", str(old), "--controllers", "tde", "--out", str(out)])
    assert "did not repeat" in answer.output
    assert "did not repeat" in out.read_text()


@pytest.mark.parametrize("env_id", ["BipedPush-v0", "ArmTrack-Payload-v0", QUADROTOR, "QuadSling-Payload-v0"])
def test_a_batch_is_run_again_one_by_one_and_other_physics_are_said(tmp_path, env_id):
    flies = env_id.startswith("Quad")
    arguments: Any = {"env_kwargs": {"duration": 0.6}, "disturbances": {"wind": 3.0} if flies else {}}
    evaluate(["tde"], env_id, episodes=2, out=tmp_path, vectorized=True, **arguments)
    shown = replay_folder(tmp_path)
    assert len(shown.figures[0]["episodes"]) == 1
    if flies:
        (note,) = shown.notes
        assert re.search(r"did not repeat: .* rmse_m .* \(it ran in NumPy, and again in \w+\)", note)
    else:
        assert shown.notes == ()  # bit for bit the same in MuJoCo


def test_an_episode_of_ones_own_policy():
    shown = artde_gym.replay({"mine": Rest()}, QUADROTOR, env_kwargs={"duration": 1.5}, disturbances={})
    ((run,),) = ([*episode["runs"]] for episode in shown.figures[0]["episodes"])
    assert run["fall"] == "ground"  # it drops like a stone
    assert run["end"] < 1.5
    assert run["series"][0]["label"] == "error (m)"


def test_the_command_of_a_folder_and_of_a_new_run(flights, tmp_path):
    out = tmp_path / "a" / "flight.html"
    answer = CliRunner().invoke(app, ["replay", str(flights), "--episode", "3", "--out", str(out)])
    assert answer.exit_code == 0, answer.output
    assert json.loads(re.findall(r'json">(.*?)</script>', out.read_text())[0])["episodes"][0]["number"] == 3
    arguments = ["--env", QUADROTOR, "--env-kwargs", '{"duration": 0.3}', "--controllers", "tde,pid"]
    answer = CliRunner().invoke(app, ["replay", *arguments, "--out", str(out)])
    assert answer.exit_code == 0, answer.output
    both = CliRunner().invoke(app, ["replay", str(flights), *arguments])
    assert isinstance(both.exception, OptionError)


def test_pushes_drops_and_falls_are_events(tmp_path):
    push = {"body": "body", "magnitude": 3.0, "direction": [0.0, 2.0, 0.0], "start": 0.2, "duration": 0.1}
    late = {**push, "start": 5.0}
    disturbances = {"push": [push, late], "payload": {"mass": 0.35, "detach_time": 0.4}}
    shown = artde_gym.replay(["tde"], QUADROTOR, env_kwargs=SHORT, disturbances=disturbances)
    (run,) = shown.figures[0]["episodes"][0]["runs"]
    assert run["pushes"] == [{"site": "body", "force": [0.0, 3.0, 0.0], "start": 0.2, "end": pytest.approx(0.3)}]
    assert run["events"] == [[0.4, "payload of 0.35 kg dropped"]]


def test_a_hostile_name_stays_a_name():
    name = '</script><img src=x onerror="alert(1)">&amp;'
    text = artde_gym.replay({name: Rest()}, QUADROTOR, env_kwargs={"duration": 0.1}, disturbances={}).html
    assert "<img" not in text
    assert json.loads(re.findall(r'json">(.*?)</script>', text)[0])["episodes"][0]["runs"][0]["name"] == name


def test_json_of_a_page_has_no_nan():
    assert page.json_text({"a": [np.nan, 1.5, np.inf], "b": {"c": None}}) == '{"a":[null,1.5,null],"b":{"c":null}}'


def test_a_page_is_small_and_asks_for_nothing():
    assert len(page.viewer()) + len(page.style()) < 350e3
    text = artde_gym.replay(["tde"], QUADROTOR, env_kwargs={"duration": 0.1}, disturbances={}).html
    assert not re.search(r"(src|href)=\"?https?:", text)
    assert "default-src 'none'" in text
    assert "three.js authors, MIT license" in text


@pytest.mark.once
def test_a_minute_of_walking_is_small():
    kwargs = {"engine": "mujoco", "duration": 9.0}
    shown = artde_gym.replay(["artde"], scenario="S1-L4", env_kwargs=kwargs)
    (run,) = shown.figures[0]["episodes"][0]["runs"]
    motion, samples = run["motion"], run["motion"]["samples"]
    walking = len(motion["data"]) / (samples - 2.0 / motion["period"])  # it stands for 2 s
    assert walking * SHOWN + len(page.json_text(run["series"])) < 40e3


def test_every_robot_has_a_scene_and_a_spec_needs_none(monkeypatch):
    for name, kit in ROBOTS.items():
        scene = scene_of(name, {})
        assert {*kit.sites} - {PAYLOAD} == {*scene.sites}  # a payload is no part of the robot
        assert scene.path is not None
        json.dumps(scene.text())
    bare = Scene.of(ojas())
    assert [body.joint for body in bare.bodies if body.joint is not None] == list(range(12))
    assert all(body.parent is None or body.parent < i for i, body in enumerate(bare.bodies))


@pytest.mark.once
def test_footholds_are_where_the_feet_land():
    scene = scene_of("ojas", {"speed": 0.1, "step_duration": 1.0, "duration": 6.0})
    xs = sorted(x for x, y in scene.footholds if y > 0)
    assert len(scene.footholds) == 2 * len(xs)  # both feet stand at both ends
    assert (
        np.diff(xs) == pytest.approx([0.1] + [0.2] * (len(xs) - 2) if len(xs) > 2 else [0.1], abs=1e-3) or len(xs) > 1
    )


def test_a_robot_that_says_nothing_of_its_looks_is_named(monkeypatch):
    kit = dataclasses.replace(ROBOTS["q450"], name="bare", scene=None, model=lambda: object())
    monkeypatch.setitem(ROBOTS._entries, "bare", kit)
    with pytest.raises(RobotError, match="bare"):
        scene_of("bare", {})


def test_an_environment_without_poses_has_no_replay():
    with pytest.raises(OptionError, match="pose"):
        Take("tde", {"env": "Mine-v0"}, {"time": np.zeros(2)}).motion  # noqa: B018


def test_the_viewer_is_made_of_these_sources():
    names = ["build.mjs", "package-lock.json", "package.json", *(f"src/{path.name}" for path in VIEWER.glob("src/*"))]
    digest = hashlib.sha256()
    for name in sorted(names):
        digest.update(f"{name}\n".encode() + (VIEWER / name).read_bytes())
    built = page.VIEWER.read_text(encoding="utf-8")
    assert built.startswith(f"/* made by `make viewer` of sources {digest.hexdigest()} */"), "run `make viewer`"
    assert "SPDX-License-Identifier: MIT" in built
    assert "three.js authors" in (page.ASSETS / "three.LICENSE.txt").read_text()


def test_a_load_on_a_cable_hangs_from_its_hook_under_a_raised_path():
    low, high = (scene_of("q450", {}, name).path for name in (QUADROTOR, "QuadSling-Payload-v0"))
    assert low is not None
    assert high is not None
    assert np.allclose(high - low, [0.0, 0.0, 1.0])
    shown = artde_gym.replay(["tde"], "QuadSling-Payload-v0", env_kwargs={"duration": 0.2, "engine": "mujoco"})
    assert shown.figures[0]["episodes"][0]["runs"][0]["hook"] == [0.0, 0.0, -0.05]
