"""TDE control is an incremental PID: the identity along a closed-loop walk."""

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.robots.ojas.task import OBSERVATION

pytestmark = pytest.mark.once

M_BAR, K_P, K_D = 0.042, 25.0, 10.0
DISTURBANCES = {
    "payload": {"mass": 1.3, "position": [0.01, -0.01, 0.16]},
    "push": [{"magnitude": 4.0, "direction": [1, 1, 0], "start": 1.0}, {"magnitude": 5.0, "start": 2.6}],
}


@pytest.mark.parametrize(("actuator_inertia", "period"), [("rotor", 0.001), ("lumped", 0.002)])
def test_tde_is_the_incremental_pid_along_a_walk(actuator_inertia, period):
    env = gym.make(
        "BipedWalk-Payload-v0",
        duration=6.0,
        control_period=period,
        actuator_inertia=actuator_inertia,
        disturbances=DISTURBANCES,
    )
    tde, pid = controllers.make("tde", env), controllers.make("pid", env)
    observation, _ = env.reset(seed=0)
    rows, commands, memories, truncated = [], [], (None, None), False
    while not truncated:
        command, tde_memory = tde.predict(observation, memories[0])
        other, pid_memory = pid.predict(observation, memories[1])
        np.testing.assert_allclose(other, command, rtol=0.0, atol=1e-8)
        memories = (tde_memory, pid_memory)
        rows.append(observation)
        commands.append(command)
        observation, _, terminated, truncated, info = env.step(command)
        assert not terminated, info
    env.close()
    walk = OBSERVATION.split(np.array(rows))
    commands = np.array(commands)
    assert np.abs(commands).max() < 40.0  # nothing saturates
    assert np.abs(commands - commands[0]).max() > 5.0  # and the robot does walk
    assert walk["contact"].min(axis=0).tolist() == [0.0, 0.0]

    # the PID as one would write it down: position, integral and velocity, from the first sample on
    proportional, integral, derivative = M_BAR * K_D / period, M_BAR * K_P / period, M_BAR / period
    sums = {name: period * np.cumsum(walk[name], axis=0) for name in ("q", "q_ref", "qd", "qd_ref", "qdd_ref")}
    velocity = sums["qdd_ref"] - sums["qdd_ref"][0] - (walk["qd"] - walk["qd"][0])
    expected = (
        walk["tau_applied"][0]
        + proportional * (sums["qd_ref"] - sums["qd"])
        + integral * (sums["q_ref"] - sums["q"])
        + derivative * velocity
    )
    np.testing.assert_allclose(commands, expected, rtol=0.0, atol=1e-8)
