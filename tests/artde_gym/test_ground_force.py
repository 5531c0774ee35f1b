"""The ground reaction pulse: its triggers, its size, and many robots at once as the single one."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.ground import AIRBORNE, GrfPulses
from artde_gym.errors import DisturbanceError, UnknownNameError
from artde_gym.robots.ojas.model import TOTAL_MASS, ojas
from artde_gym.scenarios import SCENARIOS, scenario

pytestmark = pytest.mark.once

ID = "BipedWalk-Payload-v0"
DT = 0.001  # s, of the physics
SWING = round(AIRBORNE / DT)
HUMPS: dict[str, Any] = {"shape": "double_hump", "duration": 0.4}
BRISK: dict[str, Any] = {"step_duration": 0.6, "duration": 6.0}  # the first foot lands after 2.6 s


def pulse_of(entry: dict[str, Any]) -> dict[str, Any]:
    return Disturbances.parse({"grf_pulse": entry}, ()).sample(np.random.default_rng(0))["grf_pulse"]


def forces(entry: dict[str, Any], plan: list[float], loads: list[float]) -> np.ndarray:
    """Force on the left foot at each step of a plan, whatever its loads."""
    pulses = GrfPulses(1, np.array(plan), DT)
    pulses.begin(0, pulse_of(entry), ojas())
    steps = enumerate(loads)
    return np.array([pulses.forces(np.array([[load, 50.0]]), np.array([step]))[0, 0] for step, load in steps])


def test_a_foot_that_its_own_pulse_lifts_starts_no_other() -> None:
    entry = {"magnitude": 44.0, "duration": 0.1}
    plan = [0.5] * 10 + [0.0] * 400 + [1.0] * 1600
    calm = [40.0] * 10 + [0.0] * 400 + [40.0] * 1600
    lifted = [40.0] * 10 + [0.0] * 400 + [40.0] * 100 + ([0.0] * (2 * SWING) + [40.0] * 100) * 2 + [40.0] * 300
    once = forces(entry, plan, calm)
    np.testing.assert_array_equal(forces(entry, plan, lifted), once)
    assert np.count_nonzero(once) == 99  # one half sine of 0.1 s


def test_the_plan_triggers_whatever_the_ground_says() -> None:
    entry = {"magnitude": 30.0, "duration": 0.2, "trigger": "plan"}
    plan = [0.5] * 10 + [0.0] * 300 + [0.5] * 300
    early = forces(entry, plan, [40.0] * 10 + [0.0] * 260 + [40.0] * 340)
    never = forces(entry, plan, [0.0] * 610)
    np.testing.assert_array_equal(early, never)
    expected = np.zeros(610)
    expected[310:510] = 30.0 * np.sin(np.pi * DT * np.arange(200) / 0.2)
    np.testing.assert_allclose(early, expected, atol=1e-12)


def test_a_share_is_one_of_the_weight_as_specified() -> None:
    plan, loads = [0.5] * 10 + [0.0] * 300 + [0.5] * 500, [40.0] * 10 + [0.0] * 300 + [40.0] * 500
    weight = TOTAL_MASS * 9.81
    assert weight == pytest.approx(88.15, abs=0.01)
    share = forces({"share": 0.45, **HUMPS}, plan, loads)
    np.testing.assert_allclose(share, forces({"magnitude": 0.45 * weight, **HUMPS}, plan, loads), rtol=1e-12)
    assert share.any()


@pytest.mark.parametrize("given", [{}, HUMPS, {"magnitude": 1.0, "share": 0.1}])
def test_exactly_one_size_is_given(given: dict[str, Any]) -> None:
    with pytest.raises(DisturbanceError, match=r"grf_pulse is .*allowed: exactly one of magnitude, share"):
        Disturbances.parse({"grf_pulse": given}, ())
    assert "magnitude" not in pulse_of({"share": 0.1})
    assert pulse_of(pulse_of({"share": 0.1})) == pulse_of({"share": 0.1})


@pytest.mark.parametrize("period", [0.001, 0.004])
def test_many_robots_walk_as_the_single_one_to_the_bit(period: float) -> None:
    """Through landings, with triggers, sizes and robots without a pulse side by side."""
    pulse = {"share": {"choice": [0.0, 0.2, 0.3]}, "duration": {"uniform": [0.2, 0.5]}, "shape": "double_hump"}
    kick = {"body": "left_foot", "magnitude": 5.0, "direction": [0, 1, 1], "start": 2.5, "duration": 0.1}
    for trigger in ("contact", "plan"):
        given = {"grf_pulse": {**pulse, "trigger": trigger}, "push": [kick]}
        kwargs: dict[str, Any] = {"control_period": period, "disturbances": given, **BRISK}
        steps = round(2.75 / period)
        env = gym.make_vec(ID, num_envs=3, vectorization_mode="vector_entry_point", engine="mujoco", **kwargs)
        together = _walk(env, [1, 2, 3], steps)
        for row, seed in enumerate([1, 2, 3]):
            alone = _walk(gym.make(ID, disable_env_checker=True, engine="mujoco", **kwargs).unwrapped, seed, steps)
            np.testing.assert_array_equal(together[:, row], alone)


def _walk(env: Any, seed: Any, steps: int) -> np.ndarray:
    policy, state = controllers.make("tde", env), None
    observation, _ = env.reset(seed=seed)
    seen = [observation]
    for _ in range(steps):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        seen.append(observation)
    env.close()
    return np.array(seen)


def test_the_pulse_changes_the_walk_from_the_landing_on() -> None:
    kwargs: dict[str, Any] = {"engine": "mujoco", "control_period": 0.004, **BRISK}
    walks = []
    for given in ({}, {"grf_pulse": {"share": 0.3, "trigger": "plan", **HUMPS}}):
        env = gym.make(ID, disable_env_checker=True, disturbances=given, **kwargs).unwrapped
        walks.append(_walk(env, 0, 680))
    (changed,) = np.nonzero((walks[0] != walks[1]).any(axis=1))
    assert 0.004 * changed[0] == pytest.approx(2.6, abs=0.01)


def test_scenarios_with_the_thesis_force_say_what_they_are() -> None:
    for base in ("S1", "S2", "S3"):
        assert "omits the thesis' ground force" in scenario(base).text
        for percent in (33, 45, 50):
            entry = scenario(f"{base}-GRF{percent}")
            pulse = entry.disturbances["grf_pulse"]
            assert pulse == {"shape": "double_hump", "share": percent / 100, "duration": 1.0, "trigger": "contact"}
            assert {k: v for k, v in entry.disturbances.items() if k != "grf_pulse"} == scenario(base).disturbances
            assert (entry.env_id, entry.phases) == (scenario(base).env_id, scenario(base).phases)
            fitted = "fitted to the thesis' falls in MuJoCo" in entry.text
            assert fitted == (percent == 45)
    assert "S1-GRF" not in SCENARIOS
    with pytest.raises(UnknownNameError, match="S1-GRF33"):
        scenario("S1-GRF")
