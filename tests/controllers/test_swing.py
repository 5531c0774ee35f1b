"""The swing term and the control of a load: their mathematics, their policies, and flights with a load on a cable."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.errors import OptionError
from artde_gym.registration import tuning_space
from artde_gym.robots.q450.sling import OBSERVATION
from controllers.laws.errors import GainError
from controllers.laws.swing import Cable, swing_gains, swing_term

pytestmark = pytest.mark.once

ID = "QuadSling-Payload-v0"
SLUNG = ["tde+swing", "atde+swing", "artde+swing", "geometric-load"]


def make(n: int, **kwargs: Any) -> Any:
    return gym.make_vec(ID, n, "vector_entry_point", engine="numpy", **kwargs).unwrapped


@pytest.mark.parametrize("k_p", [4.0, 10.0, 60.0])
@pytest.mark.parametrize("k_d", [2.0, 5.0, 15.0])
@pytest.mark.parametrize("square", [5.0, 19.62, 60.0])
def test_the_gains_place_a_double_pair(k_p: float, k_d: float, square: float) -> None:
    """The closed loop of vehicle error, its rate, and a pendulum that its acceleration drives."""
    one, two = (float(gain) for gain in swing_gains(k_p, k_d, np.array(square)))
    loop = np.array(
        [[0, 1, 0, 0], [-k_p, -k_d, one, two], [0, 0, 0, 1], [k_p, k_d, -square - one, -two]]
    )  # states: position, velocity, rho, its rate; the path is zero
    found = np.poly(loop)
    frequency = (k_p * square) ** 0.25
    damping = k_d * square / (4 * frequency**3)
    pair = np.array([1.0, 2 * damping * frequency, frequency**2])
    np.testing.assert_allclose(found, np.polymul(pair, pair), rtol=1e-9)
    assert np.roots(found).real.max() < 0


def test_a_load_that_leans_as_the_reference_asks_and_one_that_is_gone_need_no_term() -> None:
    acceleration, jerk = np.array([0.4, -0.2, 0.0]), np.array([0.1, 0.05, 0.0])
    length = 0.5
    square = 9.81 / length
    r = np.array([-0.4 / square, 0.2 / square, 0.0])
    r[2] = -np.sqrt(length**2 - r @ r)
    cable = Cable(r, np.array([-0.1 / square, -0.05 / square, 0.0]), np.array(True))
    np.testing.assert_allclose(swing_term(10.0, 5.0, cable, acceleration, jerk), 0.0, atol=1e-12)
    swung = cable._replace(vector=r + np.array([0.1, 0.0, 0.0]))
    assert swing_term(10.0, 5.0, swung, acceleration, jerk)[0] != 0
    assert not swing_term(10.0, 5.0, swung._replace(held=np.array(False)), acceleration, jerk).any()
    axes = swing_term((10.0, 20.0, 1.0), [5.0, 8.0, 1.0], swung, acceleration, jerk)
    assert axes[0] == swing_term(10.0, 5.0, swung, acceleration, jerk)[0]
    assert axes[1] == swing_term(20.0, 8.0, swung, acceleration, jerk)[1]


@pytest.mark.parametrize("name", SLUNG)
def test_a_batch_is_a_loop_to_the_bit(name: str) -> None:
    env = make(5, disturbances={"payload": {"mass": 0.3, "cable": {"uniform": [0.3, 1.0]}}, "wind": 1.0})
    policy = controllers.make(name, env)
    observations, _ = env.reset(seed=0)
    state, alone = None, [None] * 5
    rng = np.random.default_rng(0)
    for step in range(12):
        seen = observations + rng.normal(0.0, 1e-3, observations.shape)
        seen[step % 5, OBSERVATION["cable_held"]] = 0.0
        actions, state = policy.predict(seen, state)
        for i in range(5):
            action, alone[i] = policy.predict(np.ascontiguousarray(seen[i]), alone[i])
            assert action.tobytes() == np.ascontiguousarray(actions[i]).tobytes()
        observations, *_ = env.step(actions)


@pytest.mark.parametrize("name", SLUNG[:3])
def test_without_a_load_the_swing_term_is_its_law_alone(name: str) -> None:
    env = make(2, disturbances={"payload": {"mass": 0.3, "position": [0, 0, -0.05]}})
    own, base = (controllers.make(one, env) for one in (name, name.removesuffix("+swing")))
    observations, _ = env.reset(seed=0)
    a = b = None
    for _ in range(10):
        first, a = own.predict(observations, a)
        second, b = base.predict(observations, b)
        assert (first == second).all()
        observations, *_ = env.step(first)
    assert own.diagnostics(a).keys() == base.diagnostics(b).keys()


@pytest.mark.parametrize("name", SLUNG)
def test_a_law_for_a_cable_needs_one(name: str) -> None:
    with gym.make("QuadInfinity-Payload-v0") as env, pytest.raises(OptionError, match=r"observes a cable.*QuadSling"):
        controllers.make(name, env)


def test_gains_are_checked_and_tuned() -> None:
    env = make(1)
    with pytest.raises(GainError, match="load_k_d_p is 0"):
        controllers.make("geometric-load", env, load_k_d_p=0.0)
    assert controllers.make("tde+swing", env, preset="slung").gains.position.m_bar == 1.6
    for name in SLUNG:
        for gain in tuning_space(name, env).values():
            assert gain.low <= gain.initial <= gain.high


def swings(name: str, mass: float, cable: float, **gains: Any) -> tuple[np.ndarray, np.ndarray]:
    """Swing (rad) and the load's error (m) of a flight whose load is kicked at 1 s."""
    push = {"body": "payload", "magnitude": 4.0 * mass, "direction": [1, 2, 0], "start": 1.0, "duration": 0.2}
    env = make(1, disturbances={"payload": {"mass": mass, "cable": cable}, "push": push}, duration=6.0)
    policy = controllers.make(name, env, **gains)
    observation, _ = env.reset(seed=0)
    state, seen = None, []
    for _ in range(399):
        action, state = policy.predict(observation, state)
        observation, _, terminated, _, info = env.step(action)
        seen.append((info["swing"][0], info["load_error"][0]))
        assert not terminated.any()
    swing, error = np.array(seen).T
    return swing, error


@pytest.mark.parametrize(("mass", "cable"), [(0.1, 1.0), (0.5, 0.3)])
def test_the_swing_term_calms_what_a_tight_loop_leaves_swinging(mass: float, cable: float) -> None:
    """A swing after a kick of 0.8 m/s: calm within five seconds, whatever mass and length."""
    damped, _ = swings("tde+swing", mass, cable)
    assert damped.max() > np.radians(8)
    assert damped[-20:].max() < np.radians(1.5)
    tight, _ = swings("tde", mass, cable, preset="tuned")
    assert tight[-20:].max() > 3 * damped[-20:].max()


def test_the_control_of_the_load_brings_it_back() -> None:
    swing, error = swings("geometric-load", 0.35, 0.5)
    assert swing[-60:].max() < np.radians(2)
    assert error[-60:].max() < 0.06


@pytest.mark.parametrize("name", ["tde+swing", "geometric-load"])
@pytest.mark.parametrize(("mass", "cable"), [(0.2, 0.8), (0.5, 0.4)])
def test_tuned_gains_keep_the_load_nearer_than_the_default(name: str, mass: float, cable: float) -> None:
    _, default = swings(name, mass, cable)
    _, tuned = swings(name, mass, cable, preset="tuned")
    assert np.sqrt(np.mean(tuned**2)) < np.sqrt(np.mean(default**2))
