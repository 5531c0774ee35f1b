"""Kinds of disturbances from outside: one effect acts in every environment, single or vector, in either engine."""

import copy
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.disturbances import (
    DISTURBANCES,
    Disturbances,
    DisturbanceSpec,
    Load,
    Parameter,
    RobotStates,
    register_disturbance,
)
from artde_gym.errors import DisturbanceError, OptionError

TORQUE = Parameter("torque", "Nm", 0.0, 20.0, None, "largest torque of friction, of each joint")
SPEED = Parameter("speed", "rad/s", 1e-3, 10.0, 0.1, "at which it is three quarters of that")
FRICTION = DisturbanceSpec(
    "stiction", "Friction in the joints.", (TORQUE, SPEED), requires="joints", shorthand="torque"
)
STIFFNESS = Parameter("stiffness", "N/m", 0.0, 100.0, None, "of the tether")
ANCHOR = Parameter("anchor", "m", -5.0, 5.0, (0.0, 0.0, 0.5), "where it is tied to", size=3)
TETHER = DisturbanceSpec(
    "tether", "A spring from the base to a point.", (STIFFNESS, ANCHOR), requires="mass", multiple=True
)
WALK, FLIGHT = "BipedWalk-Payload-v0", "QuadInfinity-Payload-v0"
EFFECTS = {
    WALK: {"stiction": {"torque": {"uniform": [0.2, 0.6]}}, "tether": [{"stiffness": 20.0}, {"stiffness": 5.0}]},
    FLIGHT: {"tether": {"stiffness": 2.0, "anchor": [0.0, 0.0, 1.0]}},
}


def friction(values, states: RobotStates) -> Load:
    return Load(tau=-values["torque"][:, None] * np.tanh(states.qd / values["speed"][:, None]))


def tether(values, states: RobotStates) -> Load:
    return Load(force=values["stiffness"][:, None] * (values["anchor"] - states.position))


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    len(DISTURBANCES)
    monkeypatch.setattr(DISTURBANCES, "_entries", dict(DISTURBANCES))
    register_disturbance(TETHER, tether)
    register_disturbance(FRICTION, friction)


def run(env, steps, action):
    """Observations of an episode, the first one included."""
    first = env.reset(seed=3)[0]
    return np.array([first, *(env.step(action)[0] for _ in range(steps))])


def walk(period=0.002, engine="mujoco", **disturbances):
    env = gym.make(WALK, engine=engine, duration=0.4, control_period=period, disturbances=disturbances)
    return run(env, round(0.1 / period), np.zeros(12))


@pytest.mark.once
@pytest.mark.parametrize("period", [0.001, 0.004])
def test_many_walk_as_each_alone_to_the_bit(period):
    options = {"duration": 0.4, "control_period": period, "disturbances": EFFECTS[WALK]}
    steps = round(0.06 / period)
    many: Any = gym.make_vec(WALK, 3, "vector_entry_point", engine="mujoco", **options)
    together = run(many, steps, np.zeros((3, 12)))
    for i in range(3):
        alone: Any = gym.make(WALK, engine="mujoco", **options)
        seen = [alone.reset(seed=3 + i)[0], *(alone.step(np.zeros(12))[0] for _ in range(steps))]
        np.testing.assert_array_equal(together[:, i], seen)
        assert alone.unwrapped.sampled_disturbances == many.unwrapped.sampled_disturbances[i]


@pytest.mark.once
@pytest.mark.bullet
def test_friction_takes_energy_in_both_engines():
    for engine in ("bullet", "mujoco"):
        free, rubbed = (walk(engine=engine, **kinds)[:, 12:24] for kinds in ({}, {"stiction": 5.0}))
        assert np.abs(rubbed).sum() < 0.7 * np.abs(free).sum()


@pytest.mark.once
@pytest.mark.bullet
def test_both_engines_pull_a_base_alike():
    moved = [walk(engine=engine, tether={"stiffness": 50.0}) - walk(engine=engine) for engine in ("bullet", "mujoco")]
    assert np.abs(moved[0]).max() > 0.01
    np.testing.assert_allclose(moved[0][-1, 60], moved[1][-1, 60], rtol=0.1)  # the base's height


@pytest.mark.once
def test_nothing_is_nothing_to_the_bit():
    np.testing.assert_array_equal(walk(stiction=0.0), walk())


@pytest.mark.once
@pytest.mark.bullet
def test_a_vehicle_is_pulled_alike_in_engines_and_in_numpy():
    options = {"duration": 3.0, "disturbances": EFFECTS[FLIGHT]}
    hover = np.array([10.0, 0.0, 0.0, 0.0])
    paths = [run(gym.make(FLIGHT, engine=engine, **options), 40, hover)[:, :3] for engine in ("bullet", "mujoco")]
    many = run(gym.make_vec(FLIGHT, 2, "vector_entry_point", engine="numpy", **options), 40, np.tile(hover, (2, 1)))
    free = run(gym.make(FLIGHT, duration=3.0, disturbances={}, engine="mujoco"), 40, hover)[:, :3]
    assert np.abs(paths[0] - free).max() > 0.05
    np.testing.assert_allclose(paths[0], paths[1], atol=1e-3)
    np.testing.assert_allclose(many[:, 0, :3], paths[1], atol=1e-3)
    alone = run(gym.make_vec(FLIGHT, 1, "vector_entry_point", engine="numpy", **options), 40, hover[None])
    np.testing.assert_array_equal(many[:, 0], alone[:, 0])


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_alike(duplicate):
    env = gym.make(WALK, engine="mujoco", duration=0.4, disturbances=EFFECTS[WALK])
    run(env, 20, np.zeros(12))
    other = duplicate(env)
    for _ in range(20):
        np.testing.assert_array_equal(env.step(np.ones(12))[0], other.step(np.ones(12))[0])


def test_the_same_is_drawn_whichever_kind_was_registered_first():
    given = {"tether": {"stiffness": {"uniform": [0, 9]}}, "stiction": {"uniform": [0, 9]}, "friction": 0.5}
    drawn = [Disturbances.parse(given, (), ()).sample(np.random.default_rng(1))]
    DISTURBANCES._entries["tether"] = DISTURBANCES._entries.pop("tether")
    drawn.append(Disturbances.parse(given, (), ()).sample(np.random.default_rng(1)))
    assert drawn[0] == drawn[1]


def test_a_robot_without_the_capability_refuses():
    with pytest.raises(DisturbanceError, match="q450"):
        gym.make(FLIGHT, disturbances={"stiction": 1.0})


def test_what_an_effect_gives_is_checked():
    register_disturbance(FRICTION, lambda values, states: Load(tau=states.qd[:, :3]), replace=True)
    with pytest.raises(DisturbanceError, match=r"tau of the effect of 'stiction'.*\(1, 3\).*\(1, 12\)"):
        walk(stiction=1.0)
    nothing: Any = None
    register_disturbance(FRICTION, lambda values, states: nothing, replace=True)
    with pytest.raises(DisturbanceError, match="a Load"):
        walk(stiction=1.0)


def test_a_name_is_taken_once():
    with pytest.raises(OptionError, match="is taken"):
        register_disturbance(TETHER, tether)
    with pytest.raises(OptionError, match=r"a name that is not taken|any name except"):
        register_disturbance(DISTURBANCES["payload"], tether, replace=True)
