"""Factors in which a plausible world may differ, by their physics: rotors, masses, contact, torque limit."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from artde_gym.errors import DisturbanceError
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.ojas.model import ARMATURE, TOTAL_MASS, ojas
from artde_gym.sim.engine import Engine
from artde_gym.sim.factory import EngineName, make_engine

pytestmark = pytest.mark.once

ID = "BipedWalk-Payload-v0"
DT = 0.001  # s, of the physics
WORLD: dict[str, Any] = {
    "rotor_inertia": {"uniform": [0.02, 0.1]},
    "mass_distribution": {"uniform": [0.7, 1.3]},
    "contact": {"uniform": [0.0025, 0.01]},
    "torque_limit": {"uniform": [3.0, 20.0]},
    "mass_scale": {"uniform": [0.85, 1.15]},
}


@pytest.fixture
def engine(engine_name: EngineName) -> Iterator[Engine]:
    made = make_engine(engine_name, ojas(), DT)
    made.set_friction(0.8)
    yield made
    made.close()


def make(disturbances: dict[str, Any], **kwargs: Any) -> Any:
    options: dict[str, Any] = {"duration": 2.0, "disturbances": disturbances, **kwargs}
    return gym.make(ID, disable_env_checker=True, **options).unwrapped


def start_in_free_fall(engine: Engine) -> np.ndarray:
    """Joint accelerations (12,) under unit torques without gravity, from rest."""
    engine.set_gravity((0.0, 0.0, 0.0))
    engine.reset((0.0, 0.0, 3.0), np.full(12, 0.1))
    engine.step(np.ones(12))
    return engine.state().qd / DT


def expected_in_free_fall(engine: Engine, spec: RobotSpec) -> np.ndarray:
    """The same by our own algebra, with the rotors as the engine has them."""
    mass_matrix = RigidBodyTree(spec.with_rotor_links() if engine.spec.gears else spec).mass_matrix(np.full(12, 0.1))
    return np.linalg.solve(mass_matrix, np.concatenate([np.zeros(6), np.ones(12)]))[6:]


def assert_near(measured: np.ndarray, expected: np.ndarray) -> None:
    atol = float(4e-3 * np.abs(expected).max())  # Bullet's gears converge to 0.3 % with heavy rotors
    np.testing.assert_allclose(measured, expected, rtol=0, atol=atol)


@pytest.mark.parametrize("inertia", [0.02, 0.1])
def test_rotors_of_another_inertia(engine: Engine, inertia: float) -> None:
    other = dataclasses.replace(ojas(), armature=(inertia,) * 12)
    engine.scale_masses(1.0, armature=inertia / ARMATURE)
    assert_near(start_in_free_fall(engine), expected_in_free_fall(engine, other))
    engine.scale_masses(1.0)
    assert_near(start_in_free_fall(engine), expected_in_free_fall(engine, ojas()))


def test_links_of_another_mass(engine: Engine) -> None:
    factors = {"torso": 0.8, "left_knee": 1.5, "right_ankle_roll": 0.6}
    links = [
        dataclasses.replace(
            link,
            mass=factors.get(link.name, 1.0) * link.mass,
            inertia=tuple(factors.get(link.name, 1.0) * moment for moment in link.inertia),
        )
        for link in ojas().links
    ]
    engine.scale_masses(1.0, factors)
    assert_near(
        start_in_free_fall(engine), expected_in_free_fall(engine, dataclasses.replace(ojas(), links=tuple(links)))
    )


@pytest.mark.parametrize("legs", [0.6, 1.4])
@pytest.mark.parametrize("arms", ["fixed", "revolute"])
def test_the_distribution_of_mass_keeps_the_weight(engine_name: EngineName, legs: float, arms: str) -> None:
    env = make({"mass_distribution": legs}, engine=engine_name, arms=arms)
    env.reset(seed=0)
    factors = env._task._mass_factors(env.sampled_disturbances)
    assert {factor for name, factor in factors.items() if name in env.nominal_robot.actuated} == {legs}
    assert sum(factors[link.name] * link.mass for link in env._task.robot.links) == pytest.approx(TOTAL_MASS)
    policy, state, (observation, _) = controllers.make("tde", env), None, env.reset(seed=0)
    loads = []
    for _ in range(300):
        action, state = policy.predict(observation, state)
        observation, _, _, _, info = env.step(action)
        loads.append(sum(info["foot_loads"]))
    assert np.mean(loads[100:]) == pytest.approx(9.81 * TOTAL_MASS, rel=0.01)
    env.close()


def test_soft_contacts_let_feet_sink_in_mujoco() -> None:
    """At rest the spring of a contact, of stiffness 1 / T^2 by its mass, carries the weight: the depth grows as T^2."""
    depths = []
    for time in (0.01, 0.02):
        made = make_engine("mujoco", ojas(), DT)
        made.set_friction(0.8)
        made.set_contact_time(time)
        made.reset((0.0, 0.0, 0.45), np.zeros(12))
        for _ in range(1500):
            state = made.state()
            made.step(-400.0 * state.q - 10.0 * state.qd)
        depths.append(0.45 - made.state().position[2])
        made.close()
    assert depths[1] / depths[0] == pytest.approx(4.0, rel=0.2)


@pytest.mark.parametrize("time", [0.0125, 0.02, 0.04])
@pytest.mark.bullet
def test_bullet_corrects_the_depth_with_the_time_constant(time: float) -> None:
    made = make_engine("bullet", ojas("lumped"), DT)
    made.set_friction(0.8)
    made.set_contact_time(time)
    made.reset((0.0, 0.0, 0.449), np.zeros(12))
    depths = []
    for _ in range(10):
        state = made.state()
        depths.append(0.45 - state.position[2])
        made.step(-400.0 * state.q - 10.0 * state.qd)
    made.close()
    rates = np.diff(np.log(depths[2:]))
    np.testing.assert_allclose(rates, np.log(1 - DT / time), rtol=0.1)


def test_torques_stay_within_the_limit(engine_name: EngineName) -> None:
    env = make({"torque_limit": 2.0}, engine=engine_name)
    env.reset(seed=0)
    for action in (40.0, -40.0, 1.5):
        observation, *_ = env.step(np.full(12, action))
        acted = env.observation_layout.split(observation)["tau_applied"]
        np.testing.assert_array_equal(acted, np.clip(action, -2.0, 2.0))
    env.reset(seed=0, options={"disturbances": {}})
    observation, *_ = env.step(np.full(12, 30.0))
    np.testing.assert_array_equal(env.observation_layout.split(observation)["tau_applied"], 30.0)
    env.close()


def walk(env: Any, seed: Any, steps: int = 150) -> np.ndarray:
    policy, state, (observation, _) = controllers.make("tde", env), None, env.reset(seed=seed)
    seen = [observation]
    for _ in range(steps):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        seen.append(observation)
    return np.array(seen)


def test_a_batch_of_worlds_is_the_single_ones_to_the_bit() -> None:
    arguments: dict[str, Any] = {"engine": "mujoco", "disturbances": WORLD, "duration": 2.0}
    env = gym.make_vec(ID, num_envs=3, vectorization_mode="vector_entry_point", **arguments)
    together = walk(env, [4, 5, 6])
    for row, seed in enumerate([4, 5, 6]):
        np.testing.assert_array_equal(together[:, row], walk(make(WORLD, engine="mujoco"), seed))
    env.close()


def test_a_reset_without_them_leaves_no_trace(engine_name: EngineName) -> None:
    fresh, used = make({}, engine=engine_name), make(WORLD, engine=engine_name)
    walk(used, 1, 20)
    used.reset(seed=2, options={"disturbances": {}})
    np.testing.assert_array_equal(walk(used, 3, 60), walk(fresh, 3, 60))
    nominal = {"rotor_inertia": ARMATURE, "torque_limit": 40.0}
    used.reset(options={"disturbances": nominal})
    np.testing.assert_array_equal(walk(used, 3, 60), walk(fresh, 3, 60))


@pytest.mark.parametrize("actuator_inertia", ["lumped", "none"])
def test_a_robot_without_rotors_refuses_their_inertia(actuator_inertia: str) -> None:
    with pytest.raises(DisturbanceError, match=r"rotor_inertia.*actuator_inertia='rotor'"):
        make({"rotor_inertia": 0.05}, actuator_inertia=actuator_inertia)
    env = make({}, actuator_inertia=actuator_inertia)
    with pytest.raises(DisturbanceError, match="rotor_inertia"):
        env.reset(options={"disturbances": {"rotor_inertia": 0.05}})
    env.close()
