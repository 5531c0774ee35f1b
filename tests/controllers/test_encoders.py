"""Velocities from encoder angles: the estimator by itself, and policies behind it."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.info import fall_reason
from controllers import GainError
from controllers.laws.tracking import JointInput
from controllers.laws.velocity_estimate import estimate, estimate_init

pytestmark = pytest.mark.once

PERIOD = 0.001


def signals(q: np.ndarray) -> JointInput:
    zero = np.zeros_like(q)
    return JointInput(q, zero, zero, zero, zero, zero)


def test_ramp_is_followed_with_the_time_constant_of_the_filter() -> None:
    """qd_hat of a ramp of slope v from rest is v (1 - p^k), p = exp(-2 pi f L)."""
    cutoff, slope = 20.0, 3.0
    memory = estimate_init(signals(np.zeros(1)), PERIOD)
    for k in range(1, 101):
        seen, memory = estimate(cutoff, memory, signals(np.array([slope * PERIOD * k])), PERIOD)
        assert seen.qd[0] == pytest.approx(slope * (1 - math.exp(-2 * math.pi * cutoff * PERIOD * k)))


def test_batch_equals_loop() -> None:
    q = np.random.default_rng(0).normal(size=(5, 3, 12))

    def run(path: np.ndarray) -> np.ndarray:
        memory = estimate_init(signals(path[0]), PERIOD)
        seen = signals(path[0])
        for angles in path:
            seen, memory = estimate(30.0, memory, signals(angles), PERIOD)
        return seen.qd

    together = run(q)
    for item in range(3):
        assert together[item].tobytes() == run(q[:, item]).tobytes()
    assert run(q.astype(np.float32)).dtype == np.float32


def walk(name: str, duration: float, **kwargs: Any) -> dict[str, Any]:
    env = gym.make(
        "BipedWalk-Payload-v0", duration=duration, disturbances={"encoder_bits": 12}, disable_env_checker=True
    )
    policy, state = controllers.make(name, env, **kwargs), None
    observation, info = env.reset(seed=0)
    over = False
    while not over:
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        over = terminated or truncated
    return info


@pytest.mark.parametrize("name", ["tde", "artde-robust"])
def test_twelve_bits_are_survivable_behind_the_estimator(name: str) -> None:
    assert not fall_reason(walk(name, duration=5.5, velocity_cutoff_hz=60.0))


def test_twelve_bits_without_an_estimator_are_not() -> None:
    assert fall_reason(walk("tde", duration=5.5))


@pytest.mark.parametrize("cutoff", [0.0, -5.0, 500.0, float("nan"), float("inf")])
def test_cutoff_is_between_zero_and_half_the_sampling_rate(cutoff: float) -> None:
    env = gym.make("BipedWalk-Payload-v0", duration=0.5, disable_env_checker=True)
    with pytest.raises(GainError, match="velocity_cutoff_hz"):
        controllers.make("tde", env, velocity_cutoff_hz=cutoff)
