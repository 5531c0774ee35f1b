"""Rotors of the Q450: mixing, and the lag against SciPy's exact solution."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from artde_gym.multibody.lag import lag_shares
from artde_gym.robots.q450 import model as q450
from artde_gym.robots.q450.rotors import Rotors

pytestmark = pytest.mark.once

STEP = 0.001
STEPS = 15
HOVER = [3.6, 3.7, 3.8, 3.5]


def exact(start: np.ndarray, target: np.ndarray, constant: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Thrusts after `steps` and their means over each step, from the matrix exponential of lag and integral."""
    generator = np.array([[-1 / constant, 0.0, 1 / constant], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    integrals, end = [np.zeros_like(start)], start
    for step in range(1, steps + 1):
        end, integral, _ = expm(generator * step * STEP) @ np.array([start, np.zeros_like(start), target])
        integrals.append(integral)
    return end, np.diff(integrals, axis=0) / STEP


def test_mixer_follows_from_the_places_and_spins_of_the_rotors() -> None:
    for rotor, (place, spin) in enumerate(zip(q450.ROTOR_PLACES, q450.SPIN, strict=True)):
        thrust = np.eye(4)[rotor]
        force = np.array([0.0, 0.0, 1.0])
        moment = np.cross(place, force) + spin * q450.TORQUE_PER_THRUST * force
        np.testing.assert_allclose(q450.MIXER @ thrust, [1.0, *moment], atol=1e-15)
        assert np.hypot(*place[:2]) == pytest.approx(q450.ARM)
    assert sorted(q450.SPIN) == [-1, -1, 1, 1]


def test_elementwise_mixing_is_the_matrix() -> None:
    thrusts = np.random.default_rng(0).uniform(0, 8.5, (4, 50))
    wrenches = np.array(q450.wrench(*thrusts))
    np.testing.assert_allclose(wrenches, q450.MIXER @ thrusts, atol=1e-14)
    np.testing.assert_allclose(q450.thrusts(*wrenches), thrusts, atol=1e-12)
    np.testing.assert_allclose(q450.ALLOCATION @ q450.MIXER, np.eye(4), atol=1e-14)


def test_bounds_of_the_wrench_are_what_the_rotors_give_one_at_a_time() -> None:
    corners = np.array(np.meshgrid(*[[0.0, q450.MAX_THRUST]] * 4)).reshape(4, -1)
    wrenches = q450.MIXER @ corners
    np.testing.assert_allclose(wrenches.max(axis=1), q450.MAX_WRENCH, rtol=1e-12)
    np.testing.assert_allclose(wrenches.min(axis=1), q450.MIN_WRENCH, rtol=1e-12)


def test_heights_of_the_rotors_of_a_tilted_vehicle() -> None:
    row = np.array([0.3, -0.2, np.sqrt(1 - 0.13)])
    expected = [0.6 + row @ place for place in q450.ROTOR_PLACES]
    np.testing.assert_allclose(q450.rotor_heights(0.6, row[0], row[1]), expected, rtol=1e-14)


@pytest.mark.parametrize("constant", [0.035, 0.2, 0.002])
def test_lag_is_exact(constant: float) -> None:
    sampled = {} if constant == q450.ROTOR_LAG else {"motor_lag": {"time_constant": constant}}
    rotors = Rotors(sampled, HOVER, STEP, STEPS)
    start = np.array(HOVER)
    for period, wrench in enumerate(([20.0, 0.1, -0.2, 0.01], [10.0, 0.0, 0.0, 0.0])):
        target = q450.ALLOCATION @ wrench
        end, means = exact(start, target, constant, STEPS)
        np.testing.assert_allclose(rotors.advance(wrench, period * STEPS), means, rtol=0, atol=1e-12)
        np.testing.assert_allclose(rotors.thrusts, end, rtol=0, atol=1e-12)
        start = end


def test_without_lag_rotors_obey_at_once() -> None:
    rotors = Rotors({"motor_lag": {"time_constant": 0.0}}, HOVER, STEP, STEPS)
    means = rotors.advance([20.0, 0.1, -0.2, 0.01], 0)
    np.testing.assert_allclose(means, np.tile(q450.ALLOCATION @ [20.0, 0.1, -0.2, 0.01], (STEPS, 1)), atol=1e-12)
    assert lag_shares(0.0, 0.01) == (1.0, 1.0)


def test_each_rotor_is_limited_by_itself() -> None:
    rotors = Rotors({"motor_lag": {"time_constant": 0.0}}, HOVER, STEP, STEPS)
    wanted = q450.ALLOCATION @ [30.0, 2.0, 0.0, 0.0]
    assert wanted.max() > q450.MAX_THRUST
    np.testing.assert_allclose(rotors.advance([30.0, 2.0, 0.0, 0.0], 0)[0], np.clip(wanted, 0.0, q450.MAX_THRUST))
    np.testing.assert_allclose(rotors.advance([-1e9, 0.0, 0.0, 0.0], STEPS)[0], 0.0)


def test_commands_come_late_by_whole_periods() -> None:
    rotors = Rotors({"action_delay": {"steps": 2}, "motor_lag": {"time_constant": 0.0}}, HOVER, STEP, STEPS)
    wrenches = [[10.0 + period, 0.0, 0.0, 0.0] for period in range(5)]
    got = [rotors.advance(wrench, period * STEPS)[0].sum() for period, wrench in enumerate(wrenches)]
    np.testing.assert_allclose(got, [sum(HOVER), sum(HOVER), 10.0, 11.0, 12.0])


@pytest.mark.parametrize("start", [0.0, 0.004, 0.015, 0.02])
def test_losses_begin_at_their_time_and_multiply(start: float) -> None:
    losses: list[dict[str, Any]] = [
        {"joint": "rear_left", "factor": 0.5, "start": start},
        {"joint": "rear_left", "factor": 0.5, "start": 0.025},
        {"joint": "front_right", "factor": 0.0, "start": start},
    ]
    rotors = Rotors({"actuator_effectiveness": losses}, HOVER, STEP, STEPS)
    wrench = [16.0, 0.0, 0.0, 0.0]
    means = np.concatenate([rotors.advance(wrench, 0), rotors.advance(wrench, STEPS)])
    value = np.array(HOVER)
    for step, mean in enumerate(means):
        left = np.ones(4)
        if step >= round(start / STEP):
            left *= [1.0, 0.5, 1.0, 0.0]
        if step >= 25:
            left *= [1.0, 0.5, 1.0, 1.0]
        value, (expected,) = exact(value, 4.0 * left, q450.ROTOR_LAG, 1)
        np.testing.assert_allclose(mean, expected, rtol=0, atol=1e-12)
