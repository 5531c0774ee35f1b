"""The time base of a law: the L that it divides by, over the true sampling period."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from controllers import GainError
from controllers.laws.tde import TdeGains, tde, tde_init
from controllers.laws.tracking import JointInput

pytestmark = pytest.mark.once

LAWS = ("tde", "atde", "artde", "pid", "tde+c", "tde+kd")


def make(period: float) -> Any:
    return gym.make("BipedWalk-Payload-v0", disable_env_checker=True, control_period=period, duration=1.0).unwrapped


@pytest.mark.parametrize("law", LAWS)
def test_it_is_the_law_of_another_period(law: str) -> None:
    fast, slow = make(0.001), make(0.002)
    half, own = controllers.make(law, slow, time_base=0.5), controllers.make(law, fast)
    one, plain = controllers.make(law, slow, time_base=1.0), controllers.make(law, slow)
    observations = (
        slow.reset(seed=0)[0] + np.random.default_rng(0).normal(0.0, 1e-3, (20, 93))[:, : len(slow.reset()[0])]
    )
    states: list[Any] = [None] * 4
    actions: list[np.ndarray] = []
    for observation in observations:
        actions = []
        for i, policy in enumerate((half, own, one, plain)):
            action, states[i] = policy.predict(observation, states[i])
            actions.append(action)
        np.testing.assert_array_equal(actions[0], actions[1])
        np.testing.assert_array_equal(actions[2], actions[3])
    assert not np.array_equal(actions[0], actions[3])
    fast.close()
    slow.close()


def test_a_short_time_base_leaves_an_error_driven_by_the_reference() -> None:
    """e = (r - 1) s^2 / (r s^2 + K_d s + K_p) q_ref for a law that divides by L / r; nothing else drives it."""
    ratio, period, inertia, rate = 2.0, 0.0005, 0.1, 2 * math.pi
    gains = TdeGains(0.042, 25.0, 10.0)
    q = qd = tau = 0.0
    qd = rate  # on the reference at the start
    memory: Any = None
    errors, times = [], period * np.arange(24000)
    for t in times:
        reference = math.sin(rate * t), rate * math.cos(rate * t), -(rate**2) * math.sin(rate * t)
        signals = JointInput(*(np.array([value]) for value in (q, qd, *reference, tau)))
        memory = memory or tde_init(signals, period / ratio)
        force, memory = tde(gains, memory, signals, period / ratio)
        errors.append(reference[0] - q)
        tau = float(force[0])
        q += period * qd + 0.5 * period**2 * tau / inertia
        qd += period * tau / inertia
    late = times > 8.0
    measured = math.sqrt(2.0 * np.mean(np.square(errors)[late]))
    s = 1j * rate
    expected = abs((ratio - 1) * s**2 / (ratio * s**2 + 10.0 * s + 25.0))
    assert measured == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf, "2"])
def test_a_time_base_is_a_number_above_zero(wrong: Any) -> None:
    env = make(0.001)
    with pytest.raises(GainError, match="time_base"):
        controllers.make("tde", env, time_base=wrong)
    with pytest.raises(GainError, match="time_base"):
        controllers.make("computed-torque", env, time_base=0.5)  # it divides by no period
    env.close()
