"""A residual in the environment with a cable: what it sees, what it is rewarded for, its task, and its file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import artde_gym  # noqa: F401  (registers the environments)
import baselines
import controllers
from artde_gym.errors import OptionError
from artde_gym.robots.q450.sling import OBSERVATION
from baselines.network import Network
from baselines.policy_file import DESCRIPTION, save
from baselines.q450 import SCALES, WORST
from baselines.residual import Residual
from baselines.residual_config import ResidualConfig
from baselines.run import Run, Training
from baselines.tasks import task

ID = "QuadSling-Payload-v0"


@pytest.fixture
def env() -> Any:
    return gym.make_vec(ID, 2, "vector_entry_point", engine="numpy", duration=2.0).unwrapped


def residual(env: Any) -> Residual:
    return Residual.of(env, ResidualConfig("q450", "tde+swing"))


def test_the_agent_sees_the_cable_only_where_there_is_one(env: Any) -> None:
    slung = residual(env).features.slices
    other = gym.make_vec("QuadInfinity-Payload-v0", 1, "vector_entry_point", engine="numpy")
    without = Residual.of(other, ResidualConfig("q450")).features.slices
    assert slung.keys() - without.keys() == {"cable", "cable_rate", "cable_held", "load_e", "load_ed"}


def test_the_reward_is_for_the_load_while_one_hangs_and_for_the_vehicle_afterwards(env: Any) -> None:
    adapter = residual(env).adapter
    observation = env.reset(seed=0)[0][0].copy()
    state = adapter.start(observation)

    def costs(**cable: Any) -> tuple[float, float]:
        seen = observation.copy()
        for name, value in cable.items():
            seen[OBSERVATION[name]] = value
        terms = adapter.reward_terms(seen, state, False)
        return float(terms["position"]), float(terms["velocity"])

    at = {"position": observation[OBSERVATION["position_ref"]] + [0.02, 0.0, 0.0]}
    straight = {"cable": [0.0, 0.0, -0.5], "cable_rate": 0.0}
    gone = {"cable": 0.0, "cable_rate": 0.0}
    assert costs(**at, **straight) == pytest.approx(costs(**at, **gone))
    assert costs(**at, **gone)[0] == pytest.approx(1.0)
    leaning = {"cable": [-0.02, 0.0, -np.sqrt(0.25 - 0.0004)], "cable_rate": 0.0}
    assert costs(**at, **leaning)[0] == pytest.approx(0.02, rel=0.02)  # the load is where it should be, but 0.4 mm up
    moving = {"velocity": observation[OBSERVATION["velocity_ref"]] + [0.0, 0.1, 0.0], "cable": [0.0, 0.0, -0.5]}
    assert costs(**moving, cable_rate=[0.0, -0.1, 0.0])[1] == pytest.approx(0.0, abs=1e-6)
    assert costs(**moving, cable_rate=0.0)[1] == pytest.approx(2.0)


def test_an_agent_that_moves_the_vehicle_sees_the_errors_it_pays_for_and_leans_at_no_cost(env: Any) -> None:
    own = Residual.of(env, ResidualConfig("q450", "tde+swing", action_mode="position"))
    observation = env.reset(seed=0)[0]
    for _ in range(60):
        observation, *_ = env.step(np.tile([20.0, 0.02, -0.01, 0.0], (2, 1)))  # tips over: errors of all kinds
    features, state = own.observe(observation, own.start(observation))
    terms = own.adapter.reward_terms(observation, state.adapter, np.zeros(2, np.bool_))
    for name, field in (("position", "load_e"), ("velocity", "load_ed")):
        seen = np.linalg.norm(features[:, own.features.slices[field]], axis=-1)
        assert terms[name] == pytest.approx(np.minimum(seen / SCALES[name], WORST))
    assert (terms["attitude"] > 1.0).all()
    scales = own.adapter.reward_scales
    assert (scales["attitude"], scales["turning"]) == (0.0, 0.0)
    assert residual(env).adapter.reward_scales["attitude"] < 0.0


def test_a_residual_of_the_attitude_adds_to_one_of_the_position(env: Any) -> None:
    """The trained policy is a base; what is added to it counts as if both had been one du of both loops."""
    rng = np.random.default_rng(2)
    trained = controllers.make("tde+ppo", env)
    observation, _ = env.reset(seed=0)
    move, turn = rng.normal(size=(2, 3)), rng.normal(size=(2, 6))
    state = trained.start(trained.read(observation))
    features, _ = trained.residual.observe(observation, state.residual)
    own = 2.0 * np.clip(trained.actor(features), -1.0, 1.0)
    for more in (move, turn):
        du = np.concatenate([more, np.zeros((2, 6 - more.shape[-1]))], axis=-1)
        du[:, :3] += own
        found, _ = trained.predict(observation, residual=more)
        expected, _ = trained.residual.base.predict(observation, residual=du)
        np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_the_task_trains_on_loads_that_hang_swing_and_fall_off(level: float) -> None:
    made = gym.make_vec(ID, 16, "vector_entry_point", engine="numpy", disturbances=task(ID).training(level))
    env: Any = made.unwrapped
    env.reset(seed=3)
    drawn = env.sampled_disturbances
    assert len({one["payload"]["cable"] for one in drawn}) == 16
    assert all(push["body"] == "payload" for one in drawn for push in one["push"])
    assert all(one["wind"]["scale"] <= 1.0 + 1.5 * level for one in drawn)


def test_a_policy_of_the_slung_load_is_read_without_an_environment(env: Any, tmp_path: Path) -> None:
    config = ResidualConfig("q450", "tde+swing")
    own = residual(env)
    rng = np.random.default_rng(0)
    size, count = own.features.size, len(own.actions)
    layer = rng.normal(0.0, 0.1, (size, count)).astype(np.float32), np.zeros(count, np.float32)
    network = Network(np.zeros(size, np.float32), np.ones(size, np.float32), (layer,))
    run = Run(Training(ID, config), tmp_path / "run")
    save(tmp_path / "policy", run._saved(network, own, 0))
    alone, fitted = baselines.load(tmp_path / "policy"), baselines.load(tmp_path / "policy", env)
    observations, _ = env.reset(seed=0)
    assert alone.name == "tde+swing+ppo"
    assert (alone.predict(observations)[0] == fitted.predict(observations)[0]).all()

    file = tmp_path / "policy" / DESCRIPTION
    description = json.loads(file.read_text())
    for wrong in ("QuadInfinity-Payload-v0", ["no"], None):  # which have no cable
        description["about"]["env_id"] = wrong
        file.write_text(json.dumps(description))
        with pytest.raises(OptionError, match="observes a cable"):
            baselines.load(tmp_path / "policy")
