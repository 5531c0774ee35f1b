"""`QuadSling-Payload-v0`: what it observes, rewards and ends with, alone and many at once, and its metrics."""

from __future__ import annotations

import json
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.metrics import Metrics
from artde_gym.robots.q450 import sling
from artde_gym.sim.factory import EngineName
from artde_gym.studies.frontier.axis import axis
from artde_gym.studies.frontier.standard import standard_for

pytestmark = pytest.mark.once

ID = "QuadSling-Payload-v0"
LAYOUT = sling.OBSERVATION
HELD: dict[str, Any] = {"payload": {"mass": 0.35, "cable": 0.6}}
HOVER = [(1.48 + 0.35) * 9.81, 0.0, 0.0, 0.0]


def single(**kwargs: Any) -> Any:
    return gym.make(ID, disable_env_checker=True, **kwargs).unwrapped


def vector(n: int, **kwargs: Any) -> Any:
    return gym.make_vec(ID, n, "vector_entry_point", **{"engine": "numpy", **kwargs}).unwrapped


def fields(observation: np.ndarray) -> dict[str, np.ndarray]:
    return LAYOUT.split(observation)


def test_the_load_hangs_at_rest_until_it_is_pushed_and_released(engine_name: EngineName) -> None:
    push = {"body": "payload", "magnitude": 2.0, "start": 0.3}
    env = single(engine=engine_name, disturbances={"payload": {**HELD["payload"], "detach_time": 0.9}, "push": push})
    observation, info = env.reset(seed=0)
    assert fields(observation)["cable"].tolist() == pytest.approx([0.0, 0.0, -0.6])
    assert info["load_hangs"] is True
    told = []
    for _ in range(80):
        observation, _, _, _, info = env.step(HOVER)
        told.append(info)
        now = fields(observation)
        if info["load_hangs"]:
            r = now["cable"]
            assert np.linalg.norm(r) == pytest.approx(0.6, abs=1e-4)
            assert info["swing"] == pytest.approx(np.arctan2(np.hypot(r[0], r[1]), -r[2]))
            assert now["cable_held"] == 1.0
        else:
            assert not observation[-7:].any()
            assert (info["load_error"], info["swing"], info["cable_impulse"]) == (0.0, 0.0, 0.0) or info[
                "payload_dropped"
            ]
    assert [one["load_hangs"] for one in told].index(False) == round(0.9 / 0.015) - 1 + 1
    assert told[10]["swing"] < 1e-3 < 0.1 < max(one["swing"] for one in told)
    assert told[10]["cable_impulse"] == pytest.approx(0.35 * 9.81 * 0.015, rel=1e-3)
    assert told[10]["load_error"] == pytest.approx(np.linalg.norm(env._plan[11, :3] - (0, 0, 1.6)), rel=0.05)


def test_the_terms_of_the_load_are_what_the_page_says(engine_name: EngineName) -> None:
    push = {"body": "payload", "magnitude": 3.0, "start": 0.0}
    env = single(engine=engine_name, disturbances={**HELD, "push": push})
    env.reset(seed=0)
    reward, info = 0.0, {}
    for _ in range(30):
        _, reward, _, _, info = env.step(HOVER)
    terms = {name: info[f"reward_{name}"] for name in sling.REWARD_SCALES}
    assert terms["load"] == pytest.approx(np.exp(-100 * info["load_error"] ** 2))
    assert terms["swing"] == pytest.approx(1 - np.cos(info["swing"]))
    assert reward == pytest.approx(0.015 * sum(sling.REWARD_SCALES[name] * value for name, value in terms.items()))
    assert info["swing"] > 0.05


def test_a_load_on_the_ground_ends_the_flight(engine_name: EngineName) -> None:
    for env in (
        single(engine=engine_name, disturbances={"payload": {"mass": 0.35, "cable": 1.4}}),
        vector(1, disturbances={"payload": {"mass": 0.35, "cable": 1.4}}),
    ):
        env.reset(seed=0)
        ended, info = False, {}
        for _ in range(100):
            _, _, terminated, _, info = env.step(np.reshape([15.0, 0.0, 0.0, 0.0], env.action_space.shape))
            ended = bool(np.all(terminated))
            if ended:
                break
        assert ended
        assert np.all(info["fell_load"])
        assert not np.any(info["fell_ground"])


VARIED: dict[str, Any] = {
    "payload": {
        "mass": {"uniform": [0.1, 0.5]},
        "cable": {"choice": [0.0, 0.3, 1.0]},
        "detach_time": {"uniform": [0.3, 0.7]},
    },
    "push": {"body": "payload", "magnitude": {"uniform": [0.0, 4.0]}, "direction": [1, 1, 0], "start": 0.1},
    "wind": {"choice": [0.0, 2.0]},
    "sensor_noise": {"position": {"choice": [0.0, 0.002]}, "velocity": 0.01},
    "cable_delay": {"choice": [0, 3]},
}


def logs(n: int, seeds: list[int], **kwargs: Any) -> list[bytes]:
    env = vector(n, disturbances=VARIED, duration=0.75, **kwargs)
    observations, info = env.reset(seed=seeds)
    seen = [b""] * n
    for _ in range(60):
        told = [
            b"".join(np.asarray(v[i]).tobytes() for k, v in sorted(info.items()) if k in sling.TOLD) for i in range(n)
        ]
        seen = [log + observations[i].tobytes() + told[i] for i, log in enumerate(seen)]
        observations, rewards, _, _, info = env.step(np.tile([17.0, 0.002, -0.001, 0.0], (n, 1)))
        seen = [log + rewards[i].tobytes() for i, log in enumerate(seen)]
    return seen


@pytest.mark.parametrize("kwargs", [{}, {"dtype": "float32", "measurement": "mocap"}])
def test_batch_is_loop_to_the_bit(kwargs: dict[str, Any]) -> None:
    seeds = [5, 3, 8, 1, 9, 2]
    assert logs(6, seeds, **kwargs) == [logs(1, [seed], **kwargs)[0] for seed in seeds]


def test_single_and_vector_tell_the_same(engine_name: EngineName) -> None:
    disturbances = {**HELD, "push": {"body": "payload", "magnitude": 2.0, "direction": [1, 2, 0], "start": 0.1}}
    one, many = single(engine=engine_name, disturbances=disturbances), vector(1, disturbances=disturbances)
    a, b = one.reset(seed=4), many.reset(seed=4)
    for _ in range(30):
        a, b = one.step(HOVER), many.step([HOVER])
    np.testing.assert_allclose(b[0][0], a[0], atol=2e-3)
    for name in (*sling.TOLD, *(f"reward_{term}" for term in sling.REWARD_SCALES)):
        assert b[-1][name][0] == pytest.approx(a[-1][name], abs=5e-3)
    assert set(a[-1]) == {name for name in b[-1] if not name.startswith("_")}


def test_a_delayed_cable_is_that_of_some_samples_ago() -> None:
    push = {"body": "payload", "magnitude": 2.0, "start": 0.0}
    prompt, late = (
        vector(2, disturbances={**HELD, "push": push, **extra}) for extra in ({}, {"cable_delay": {"steps": 4}})
    )
    seen: list[list[np.ndarray]] = [[prompt.reset(seed=0)[0]], [late.reset(seed=0)[0]]]
    for _ in range(20):
        for log, env in zip(seen, (prompt, late), strict=True):
            log.append(env.step(np.tile(HOVER, (2, 1)))[0])
    now, then = np.array(seen)
    assert (then[4:, :, -7:] == now[:-4, :, -7:]).all()
    assert (then[:4, :, -7:] == now[:1, :, -7:]).all()
    assert (then[..., :-7] == now[..., :-7]).all()


def test_noise_disturbs_a_cable_that_is_held() -> None:
    quiet, noisy = (
        vector(3, disturbances={"payload": {**HELD["payload"], "detach_time": 0.1}, **extra})
        for extra in ({}, {"sensor_noise": {"position": 0.01, "velocity": 0.1}})
    )
    a, b = quiet.reset(seed=0)[0], noisy.reset(seed=0)[0]
    difference = (b - a)[:, LAYOUT["cable"]]
    assert 1e-3 < np.abs(difference).max() < 0.06
    assert not np.allclose(difference, (b - a)[:, LAYOUT["position"]])
    for env in (quiet, noisy):
        seen = [env.step(np.tile(HOVER, (3, 1)))[0] for _ in range(10)]
        assert not seen[-1][:, -7:].any()


# -------------------------------------------------------------------------------------------- scenarios and evaluation


def test_a_frontier_of_this_environment_is_its_own() -> None:
    test = standard_for(ID)
    assert test is not None
    assert test.scenario == "Q-sling"
    assert axis(ID, "payload.cable").levels[-1] == 1.3
    other = standard_for("QuadInfinity-Payload-v0")
    assert other is not None
    assert other.scenario == "Q1"
    assert "payload.cable" not in other.ranges


def test_what_is_watched_is_measured_alike_one_by_one_and_many_at_once() -> None:
    def run(vectorized: bool, **kwargs: Any) -> Any:
        disturbances = {
            "payload": {**HELD["payload"], "detach_time": 1.5},
            "push": {"body": "payload", "magnitude": 1.4, "start": 0.2},
        }
        return evaluate(
            ["geometric"],
            ID,
            disturbances=disturbances,
            episodes=1,
            vectorized=vectorized,
            env_kwargs={"duration": 1.8, **kwargs},
        ).episodes.iloc[0]

    one, many = run(False, engine="mujoco"), run(True)
    for column in (
        "rms_swing_deg",
        "max_swing_deg",
        "peak_swing_deg_push0",
        "rms_load_error_m",
        "max_cable_impulse_ns",
    ):
        assert one[column] == pytest.approx(many[column], rel=0.02)
    assert one["max_swing_deg"] > 3
    assert "recovery_time_s_push0_cable_impulse" not in one


def test_a_swing_that_ends_before_it_settles_never_settled() -> None:
    """The load swings by 10 degrees and is let go (NaN), or calms down to 1 degree first."""
    n, period = 400, 0.015
    events = [{"push0": (1.0, 1.2)}] * 2
    metrics = Metrics(sling.METRICS_SPEC, LAYOUT, period, [1.0, 1.0], events)
    swing = np.full((n, 2), np.radians(10.0))
    swing[200:, 1] = np.radians(1.0)
    hangs = np.ones((n, 2), bool)
    hangs[300:] = False
    observations = np.zeros((n, 2, LAYOUT.size))
    observations[..., LAYOUT["rot_body_to_world"]] = np.eye(3).ravel()
    told = {"swing": swing, "load_hangs": hangs, "load_error": 0 * swing, "cable_impulse": 0 * swing}
    for first in range(0, n, 70):
        part = slice(first, first + 70)
        metrics.add(first, {**LAYOUT.split(observations[part]), **{k: v[part] for k, v in told.items()}}, {})
    never, settled = metrics.rows()
    assert never["recovery_time_s_push0_swing"] == np.inf
    assert settled["recovery_time_s_push0_swing"] == pytest.approx(200 * period - 1.2)
    assert never["rms_swing_deg"] == pytest.approx(10.0)
    assert settled["max_swing_deg"] == pytest.approx(10.0)
    assert never["recovery_time_s_push0_load_error"] == 0.0


@pytest.mark.parametrize("name", ["Q-sling", "Q-sling-calm", "Q-sling-gale", "Q-sling-late"])
def test_scenarios_fly(name: str) -> None:
    env = vector(2, duration=45.0)
    observations, _ = env.reset(seed=1, options={"scenario": name})
    policy = controllers.make("geometric", env)
    action, _ = policy.predict(observations)
    observations, *_ = env.step(action)
    assert env.observation_space.contains(observations)
    drawn = env.sampled_disturbances[0]
    assert json.loads(json.dumps(drawn))["push"][0]["body"] == "payload"
    speed = drawn["push"][0]["magnitude"] * drawn["push"][0]["duration"] / drawn["payload"]["mass"]
    assert speed == pytest.approx(0.8, rel=0.06)


def test_engines_fly_as_the_vector_does_for_45_seconds(engine_name: EngineName) -> None:
    """Kick and release included; under the swing term, which damps what would make them part."""
    given = {
        "payload": {"mass": 0.35, "cable": 0.5, "detach_time": 35.0},
        "push": {"body": "payload", "magnitude": 1.4, "direction": [1, 1, 0], "start": 20.0},
    }

    def flown(env: Any) -> np.ndarray:
        policy = controllers.make("tde+swing", env)
        observation, _ = env.reset(seed=0)
        state, seen = None, []
        for _ in range(2999):
            action, state = policy.predict(observation, state)
            observation, *_ = env.step(action)
            now = fields(np.ravel(observation))
            seen.append(np.concatenate([now["position"], now["position"] + now["cable"]]))
        return np.array(seen)

    many = flown(vector(1, disturbances=given, duration=45.0))
    alone = flown(single(engine=engine_name, disturbances=given, duration=45.0))
    assert np.linalg.norm((alone - many)[:, :3], axis=1).max() < 1e-3
    assert np.linalg.norm((alone - many)[:2300, 3:], axis=1).max() < 1e-3
