"""Friction of joints: its curve, both robots with joints, batch == loop, what a time step cannot resolve."""

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.effects import Effects
from artde_gym.errors import DisturbanceError
from artde_gym.sim.engine import State

pytestmark = pytest.mark.once

ARM, WALK = "ArmTrack-Payload-v0", "BipedWalk-Payload-v0"
CURVE: dict[str, Any] = {"viscous": 0.7, "coulomb": 2.0, "stribeck": 1.5, "stribeck_velocity": 0.2, "slip": 0.01}
RUBBED: dict[str, Any] = {"coulomb": {"uniform": [0.5, 1.0]}, "stribeck": 0.4, "viscous": {"uniform": [0.0, 0.3]}}


def torque(speed: float, entry: dict[str, Any]) -> float:
    effects = Effects(1, {"site": (), "joint": ("a",)})
    effects.begin(0, Disturbances.parse({"joint_friction": entry}, (), ("a",)).sample(np.random.default_rng(0)))
    zero = (0.0, 0.0, 0.0)
    state = State(np.zeros(1), np.array([speed]), zero, (0.0, 0.0, 0.0, 1.0), zero, zero)
    tau = effects.load_of(state, 0.0).tau
    return 0.0 if tau is None else float(tau[0, 0])


@pytest.mark.parametrize("speed", [0.05, 0.2, 0.6, 3.0])
def test_the_curve_is_that_of_its_source(speed: float) -> None:
    expected = 0.7 * speed + 2.0 + 1.5 * math.exp(-((speed / 0.2) ** 2))
    assert torque(speed, CURVE) == pytest.approx(-expected, rel=1e-4)  # beyond slip, tanh is one
    assert torque(-speed, CURVE) == -torque(speed, CURVE)
    assert torque(0.0, CURVE) == 0.0


def test_a_joint_breaks_away_harder_than_it_slides() -> None:
    resisting = [-torque(speed, {**CURVE, "viscous": 0.0}) for speed in np.linspace(0.05, 1.0, 40)]
    assert (np.diff(resisting) < 0).all()


def test_a_mere_scale_has_no_effect_of_its_own() -> None:
    effects = Effects(1, {"site": (), "joint": ("a",)})
    effects.begin(0, Disturbances.parse({"joint_friction": 2.0}, (), ("a",)).sample(np.random.default_rng(0)))
    assert not effects.acting.any()


@pytest.mark.parametrize("env_id", [ARM, WALK])
def test_a_vector_is_its_single_environments_to_the_bit(env_id: str) -> None:
    arguments: dict[str, Any] = {"duration": 1.0, "disturbances": {"joint_friction": RUBBED}, "engine": "mujoco"}
    envs: Any = gym.make_vec(env_id, 2, "vector_entry_point", **arguments)
    policy, state, (observations, _) = controllers.make("tde", envs), None, envs.reset(seed=[5, 6])
    seen = [observations.copy()]
    for _ in range(40):
        actions, state = policy.predict(observations, state)
        observations, *_ = envs.step(actions)
        seen.append(observations.copy())
    envs.close()
    for i in range(2):
        env = gym.make(env_id, **arguments)
        policy, state, (observation, _) = controllers.make("tde", env), None, env.reset(seed=5 + i)
        for row in seen:
            np.testing.assert_array_equal(row[i], observation)
            action, state = policy.predict(observation, state)
            observation, *_ = env.step(action)
        env.close()


def test_friction_takes_the_swing_out_of_an_arm_that_falls(engine_name: str) -> None:
    """Without motor torques the arm falls; the more friction, the less it moves."""
    moved = []
    for coulomb in (0.0, 4.0):
        env = gym.make(ARM, disturbances={"joint_friction": {"coulomb": coulomb}}, duration=0.2, engine=engine_name)
        first, _ = env.reset(seed=0)
        seen = [env.step(np.zeros(7))[0] for _ in range(100)]
        moved.append(np.abs(seen[-1][:7] - first[:7]).max())
        env.close()
    assert moved[1] < 0.9 * moved[0]


@pytest.mark.parametrize("env_id", [ARM, WALK])
@pytest.mark.parametrize(
    "entry",
    [
        {"coulomb": 50.0},
        {"stribeck": {"uniform": [1.0, 50.0]}},
        {"coulomb": 1.0, "slip": 1e-3},
        {"viscous": {"normal": [1.0, 90.0]}, "coulomb": 3.0},
    ],
)
def test_friction_that_a_time_step_cannot_resolve_is_refused(env_id: str, entry: dict[str, Any]) -> None:
    with pytest.raises(DisturbanceError, match=r"joint_friction\.coulomb .* smallest inertia"):
        gym.make(env_id, disturbances={"joint_friction": entry}, duration=1.0)


def test_only_joints_with_friction_have_a_scale() -> None:
    with pytest.raises(DisturbanceError, match="viscous"):
        gym.make(WALK, disturbances={"joint_friction": {"scale": 2.0}}, duration=1.0)
    with pytest.raises(DisturbanceError):
        gym.make(WALK, disturbances={"joint_friction": 2.0}, duration=1.0)
    with pytest.raises(DisturbanceError):
        gym.make("QuadInfinity-Payload-v0", disturbances={"joint_friction": {"coulomb": 1.0}}, duration=1.0)
