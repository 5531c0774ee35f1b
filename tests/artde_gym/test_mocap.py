"""Motion capture fused with inertial sensors: exact without noise, stationary and consistent with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from artde_gym.disturbances import mocap
from artde_gym.disturbances.mocap import Mocap, tracking_gains

pytestmark = pytest.mark.once

ID = "QuadInfinity-Payload-v0"
Pilot = Callable[[np.ndarray], np.ndarray]
WINDY: dict[str, Any] = {"wind": 2.0}


def seen_and_true(pilot: Pilot, steps: int, num_envs: int = 32, **kwargs: Any) -> tuple[np.ndarray, np.ndarray]:
    """Observations of vehicles in the wind under motion capture, and their true states; (steps, n, 41)."""
    env: Any = gym.make_vec(ID, num_envs=num_envs, engine="numpy", disturbances=WINDY, measurement="mocap", **kwargs)
    observation, _ = env.reset(seed=0)
    seen, true = [observation], [env._truth()]
    for _ in range(steps):
        observation, *_ = env.step(pilot(observation))
        seen.append(observation)
        true.append(env._truth())
    return np.array(seen), np.array(true)


def attitude_error(seen: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Small rotation vectors from the true to the seen attitude (..., 3)."""
    a, b = (each[..., 6:15].reshape(*each.shape[:-1], 3, 3) for each in (true, seen))
    skew = np.swapaxes(a, -1, -2) @ b
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def test_without_noise_it_sees_the_truth(pilot: Pilot, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GYROSCOPE_NOISE", "ACCELEROMETER_NOISE", "POSITION_NOISE", "ATTITUDE_NOISE"):
        monkeypatch.setattr(mocap, name, 1e-15)
    seen, true = seen_and_true(pilot, 200, num_envs=3)
    np.testing.assert_allclose(seen[..., :3], true[..., :3], rtol=0, atol=2e-5)  # v is not quite linear in a period
    np.testing.assert_allclose(seen[..., 3:6], true[..., 3:6], rtol=0, atol=2e-4)
    assert np.abs(attitude_error(seen, true)).max() < 2e-4
    np.testing.assert_allclose(seen[..., 15:18], true[..., 15:18], rtol=0, atol=1e-12)


@pytest.mark.parametrize("period", [0.005, 0.015, 0.03])
def test_errors_are_small_stationary_and_without_bias(pilot: Pilot, period: float) -> None:
    seen, true = seen_and_true(pilot, round(4.0 / period), control_period=period)
    assert np.array_equal(seen[0, :, :15], true[0, :, :15])  # it has settled before the start
    assert np.array_equal(seen[..., 18:], true[..., 18:])
    settled = round(1.0 / period)
    position, velocity = (seen - true)[settled:, :, 0:3], (seen - true)[settled:, :, 3:6]
    rates, attitude = (seen - true)[settled:, :, 15:18], attitude_error(seen, true)[settled:]
    assert 5e-5 < position.std() < mocap.POSITION_NOISE
    assert 5e-4 < velocity.std() < 5e-3
    assert 1e-4 < attitude.std() < mocap.ATTITUDE_NOISE
    assert rates.std() == pytest.approx(mocap.GYROSCOPE_NOISE, rel=0.05)
    for error in (position, velocity, attitude, rates):
        assert np.abs(error.mean(axis=(0, 1))).max() < 0.25 * error.std()
        early, late = np.array_split(error, 2)
        assert late.std() == pytest.approx(early.std(), rel=0.3)
    rot = seen[..., 6:15].reshape(-1, 3, 3)
    np.testing.assert_allclose(rot @ rot.swapaxes(1, 2), np.tile(np.eye(3), (len(rot), 1, 1)), atol=1e-12)


@pytest.mark.parametrize("index", [0.01, 0.05, 0.3, 2.0])
def test_gains_are_those_of_the_stationary_kalman_filter(index: float) -> None:
    transition, kick = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[0.5], [1.0]])
    process, measured = index**2 * kick @ kick.T, np.array([[1.0, 0.0]])
    covariance = solve_discrete_are(transition.T, measured.T, process + 1e-15 * np.eye(2), np.eye(1))
    gain = covariance @ measured.T / (measured @ covariance @ measured.T + 1.0)
    np.testing.assert_allclose(tracking_gains(index), gain[:, 0], rtol=1e-5)


@pytest.mark.parametrize("period", [0.005, 0.015])
def test_frames_come_sixty_times_a_second(period: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """A vehicle that stands still, seen by perfect inertial sensors: only a frame takes the estimate off its course."""
    monkeypatch.setattr(mocap, "ACCELEROMETER_NOISE", 1e-6)
    monkeypatch.setattr(mocap, "GYROSCOPE_NOISE", 1e-6)
    sensor, keys = Mocap(1, period, np.float64), np.array([7], dtype=np.uint64)
    frames = 0
    place, speed = np.zeros((3, 1)), np.zeros((3, 1))
    for sample in range(round(3.0 / period) + 1):
        position, velocity, rates, rot = (
            np.zeros((3, 1)),
            np.zeros((3, 1)),
            np.zeros((3, 1)),
            np.eye(3)[..., None].copy(),
        )
        sensor.measure(position, velocity, rot, rates, np.array([sample]), keys)
        frames += bool(np.abs(position - place - period * speed).max() > 1e-9)
        place, speed = position, velocity
    assert frames == 180


def test_one_vehicle_sees_what_the_same_one_among_many_sees(pilot: Pilot) -> None:
    arguments: dict[str, Any] = {"disturbances": WINDY, "measurement": "mocap"}
    alone: Any = gym.make(ID, disable_env_checker=True, **arguments)
    many: Any = gym.make_vec(ID, num_envs=2, engine="numpy", **arguments)
    a, b = alone.reset(seed=3)[0], many.reset(seed=[9, 3])[0][1]
    for _ in range(60):
        action = pilot(a)
        a, b = alone.step(action)[0], many.step(np.tile(action, (2, 1)))[0][1]
    noise = np.abs(b[:18] - many._truth()[1, :18])
    assert noise[:3].max() > 2e-5
    np.testing.assert_allclose(a[:18], b[:18], rtol=0, atol=1e-4)  # the same errors, on nearly the same flight
