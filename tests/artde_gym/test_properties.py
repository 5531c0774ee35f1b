"""Whatever a program gives to an environment: it works, or raises an error of ours or of Gymnasium's."""

from __future__ import annotations

import contextlib
import gc
import inspect
import math
import os
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import load_env_creator
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from artde_gym.disturbances import DISTURBANCES
from artde_gym.errors import ArtdeGymError
from artde_gym.sim.engine_loops import open_clients

REFUSED = (ArtdeGymError, gym.error.Error, gym.error.ClosedEnvironmentError)
SINGLE = ("BipedWalk-Payload-v0", "BipedPush-v0", "QuadInfinity-Payload-v0")
SHORT: dict[str, dict[str, Any]] = {
    "BipedWalk-Payload-v0": {"duration": 0.2, "control_period": 0.004, "actuator_inertia": "lumped"},
    "BipedPush-v0": {"duration": 0.2, "control_period": 0.004, "actuator_inertia": "lumped"},
    "QuadInfinity-Payload-v0": {"duration": 0.5},
}

NUMBERS = st.one_of(
    st.integers(-3, 3),
    st.integers(),
    st.floats(),
    st.floats(-2, 2),
    st.sampled_from([1e308, 5e-324, math.nan, math.inf]),
)
WORDS = st.one_of(st.text(max_size=5), st.sampled_from(["bullet", "mujoco", "rotor", "all", "torso", "S1", "Q1"]))
PLAIN = st.one_of(st.none(), st.booleans(), NUMBERS, WORDS)
ANYTHING = st.recursive(
    PLAIN,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(WORDS, inner, max_size=3), st.tuples(inner), st.binary(max_size=3)
    ),
    max_leaves=6,
)
DISTRIBUTION = st.one_of(
    st.builds(lambda low, high: {"uniform": [low, high]}, NUMBERS, NUMBERS),
    st.builds(lambda mean, deviation: {"normal": [mean, deviation]}, NUMBERS, NUMBERS),
    st.builds(lambda items: {"choice": items}, st.lists(st.one_of(NUMBERS, st.lists(NUMBERS, max_size=3)), max_size=3)),
)
VALUES = st.one_of(ANYTHING, DISTRIBUTION, st.lists(st.one_of(NUMBERS, DISTRIBUTION), min_size=3, max_size=3))


def entries(kind: str) -> st.SearchStrategy[Any]:
    names = [parameter.name for parameter in DISTURBANCES[kind].parameters]
    one = st.one_of(VALUES, st.dictionaries(st.one_of(st.sampled_from(names), WORDS), VALUES, max_size=len(names)))
    return st.one_of(one, st.lists(one, max_size=3))


ANY_DISTURBANCES = st.one_of(
    ANYTHING,
    st.lists(st.sampled_from([*DISTURBANCES, "nothing"]), max_size=3, unique=True).flatmap(
        lambda kinds: st.fixed_dictionaries({kind: entries(kind) if kind in DISTURBANCES else VALUES for kind in kinds})
    ),
)
PERIODS = st.sampled_from([0.001, 0.004, 0.005, 0.015, 0.05, 0.0011])
ARGUMENTS: dict[str, st.SearchStrategy[Any]] = {
    "disturbances": ANY_DISTURBANCES,
    "control_period": st.one_of(PERIODS, ANYTHING),
    "actuator_inertia": st.one_of(st.sampled_from(["rotor", "lumped", "none"]), ANYTHING),
    "arms": st.one_of(st.sampled_from(["fixed", "revolute"]), ANYTHING),
    "self_collision": st.one_of(st.booleans(), ANYTHING),
    "speed": st.one_of(st.floats(0, 0.25), ANYTHING),
    "step_duration": st.one_of(st.floats(0.6, 2), ANYTHING),
    "observe_ground_force": st.one_of(st.booleans(), ANYTHING),
    "measurement": st.one_of(st.sampled_from(["ideal", "mocap"]), ANYTHING),
    "engine": st.one_of(st.sampled_from(["bullet", "mujoco"]), ANYTHING),
    "render_mode": st.one_of(st.none(), ANYTHING),
    "num_envs": st.one_of(st.integers(1, 4), st.integers(max_value=0), st.floats(), st.text(max_size=2)),
    "dtype": st.one_of(st.sampled_from(["float64", "float32"]), ANYTHING),
    "threads": st.one_of(st.integers(1, 2), st.integers(max_value=0), st.floats(), st.text(max_size=2)),
    "autoreset_mode": st.one_of(st.sampled_from(["NextStep", "SameStep", "Disabled"]), ANYTHING),
    "max_episode_steps": st.one_of(st.integers(0, 5), ANYTHING),
}
LENGTHS = st.one_of(st.floats(0.1, 1.0), st.floats(max_value=0.099), st.floats(min_value=1e4), st.text(max_size=2),
                    st.none(), st.lists(NUMBERS, max_size=2))  # fmt: skip
"""Durations that are short, or refused: a long one is no mistake, but takes its time."""

EXAMPLES = os.environ.get("EXAMPLES")
"""How many to try; `make soak` sets it, for random ones, where the tests have a hundred that are always the same."""
many = settings(
    max_examples=int(EXAMPLES or 100),
    derandomize=EXAMPLES is None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
)


def creator(name: str, batch: bool) -> Any:
    spec = gym.spec(name)
    return load_env_creator(str(spec.vector_entry_point if batch else spec.entry_point))


KINDS_OF_ENV = [(name, False) for name in SINGLE] + [
    (name, True) for name in SINGLE if gym.spec(name).vector_entry_point is not None
]
ENGINE = {(name, batch): {"engine": creator(name, True).own_engine} if batch else {} for name, batch in KINDS_OF_ENV}


@pytest.mark.parametrize(("name", "batch"), KINDS_OF_ENV)
def test_arguments_are_taken_or_refused(name: str, batch: bool) -> None:
    known = [argument for argument in inspect.signature(creator(name, batch)).parameters if argument in ARGUMENTS]

    @many
    @given(st.data(), st.lists(st.sampled_from(known), unique=True, max_size=3), LENGTHS)
    def check(data: st.DataObject, chosen: list[str], length: Any) -> None:
        kwargs = {**SHORT[name], "duration": length} if not batch else {"duration": length}
        kwargs |= {argument: data.draw(ARGUMENTS[argument], label=argument) for argument in chosen}
        with contextlib.suppress(*REFUSED):
            env = creator(name, batch)(**{**ENGINE[name, batch], **kwargs})
            env.reset(seed=0)
            env.step(env.action_space.sample())
            env.close()

    check()


@pytest.fixture(scope="module", params=KINDS_OF_ENV, ids=lambda pair: f"{pair[0]}{'-batch' if pair[1] else ''}")
def env(request: pytest.FixtureRequest) -> Any:
    name, batch = request.param
    if not batch:
        return gym.make(name, disable_env_checker=True, **SHORT[name]).unwrapped
    return gym.make_vec(name, 3, "vector_entry_point", duration=0.5, **ENGINE[name, batch])


def size(env: Any) -> int:
    return int(np.prod(env.action_space.shape))


SEEDS = st.one_of(st.none(), st.integers(0, 10), ANYTHING)
OPTIONS = st.one_of(
    st.none(),
    ANYTHING,
    st.fixed_dictionaries({}, optional={"disturbances": ANY_DISTURBANCES, "scenario": st.one_of(WORDS, ANYTHING)}),
)


def test_seeds_and_options_are_taken_or_refused(env: Any) -> None:
    @many
    @given(SEEDS, OPTIONS)
    def check(seed: Any, options: Any) -> None:
        try:
            observation, info = env.reset(seed=seed, options=options)
        except REFUSED:
            return
        assert env.observation_space.contains(np.asarray(observation)) or "sensor_noise" in str(info)
        env.step(env.action_space.low * 0.0)

    check()
    env.reset(seed=0, options={"disturbances": {}})


def test_actions_are_taken_or_refused(env: Any) -> None:
    """Inside the space, outside, of any shape and type: a step gives what the space promises, or an error."""
    shape = env.action_space.shape
    inside = st.integers(0, 2**32 - 1).map(lambda seed: np.random.default_rng(seed).uniform(-1, 1, shape))
    scaled = st.builds(lambda part, factor: part * factor, inside, st.sampled_from([1e-3, 1.0, 100.0, 1e10, 1e200]))
    holed = st.builds(_with, inside, st.integers(0, 100), st.sampled_from([math.nan, math.inf, -math.inf]))
    wrong = st.one_of(
        ANYTHING, inside.map(lambda part: part[..., :-1]), inside.map(lambda part: part[None]),
        inside.map(lambda part: part.astype(str)), inside.map(lambda part: part.astype(object)),
        inside.map(lambda part: part.astype(complex)), inside.map(lambda part: part.tolist()),
    )  # fmt: skip

    @many
    @given(st.one_of(scaled, holed, wrong))
    def check(action: Any) -> None:
        try:
            observation, reward, terminated, truncated, _ = env.step(action)
        except gym.error.ResetNeeded:
            env.reset(seed=0)
            return
        except REFUSED:
            return
        assert np.isfinite(reward).all()
        assert env.observation_space.contains(np.asarray(observation)) or np.any(terminated)
        if np.any(terminated) or np.any(truncated):
            env.reset(seed=0)

    env.reset(seed=0)
    check()


def _with(part: np.ndarray, place: int, value: float) -> np.ndarray:
    part = part.copy()
    part.flat[place % part.size] = value
    return part


@pytest.mark.parametrize(("name", "batch"), KINDS_OF_ENV)
@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_any_order_of_calls_works_or_is_refused(name: str, batch: bool, engine: str) -> None:
    if batch and engine == "mujoco":
        pytest.skip("a vector has one engine")

    @settings(many, max_examples=max(25, many.max_examples // 10))
    @given(st.lists(st.sampled_from(["reset", "step", "step", "render", "close", "bad"]), max_size=12))
    def check(calls: list[str]) -> None:
        if batch:
            env: Any = gym.make_vec(name, 2, "vector_entry_point", duration=0.5, **ENGINE[name, batch])
        else:
            env = gym.make(name, disable_env_checker=True, engine=engine, **SHORT[name]).unwrapped
        closed = closed_too_early = False
        for call in calls:
            try:
                if call == "reset":
                    env.reset(seed=1)
                elif call == "step":
                    env.step(env.action_space.low * 0.0)
                elif call == "bad":
                    env.step("no action")
                elif call == "render":
                    None if batch else env.render()  # a vector has no pictures
                else:
                    env.close()
                    closed = True
            except gym.error.ClosedEnvironmentError:
                closed_too_early |= not closed
            except REFUSED:
                pass
        env.close()
        env.close()
        assert not closed_too_early

    check()


@pytest.mark.bullet
def test_no_client_is_left_behind() -> None:
    """Closed twice, forgotten, closed while an exception is on its way, or never finished being made."""
    gc.collect()
    before = open_clients()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", ".* can never happen")
        for name in SINGLE:
            env = gym.make(name, disable_env_checker=True, **SHORT[name])
            env.reset(seed=0)
            assert open_clients() == before + 1
            for each in (env, env, env.unwrapped):
                each.close()
            assert open_clients() == before
            forgotten = gym.make(name, disable_env_checker=True, **SHORT[name])
            forgotten.reset(seed=0)
            del forgotten
            gc.collect()
            assert open_clients() == before
            with pytest.raises(KeyboardInterrupt):
                _closed_on_the_way_out(name)
            assert open_clients() == before
            with pytest.raises(ArtdeGymError):
                gym.make(name, disable_env_checker=True, disturbances={"payload": -1})
            with pytest.raises(ArtdeGymError):
                gym.make(name, disable_env_checker=True, duration=0.0)
            gc.collect()
            assert open_clients() == before


def _closed_on_the_way_out(name: str) -> None:
    env = gym.make(name, disable_env_checker=True, **SHORT[name])
    try:
        env.reset(seed=0)
        raise KeyboardInterrupt
    finally:
        env.close()


@pytest.mark.parametrize("engine", ["bullet", "mujoco"])
def test_a_closed_environment_says_so(engine: str) -> None:
    for name in SINGLE:
        env: Any = gym.make(name, disable_env_checker=True, engine=engine, **SHORT[name])
        env.reset(seed=0)
        env.close()
        with pytest.raises(gym.error.ClosedEnvironmentError, match="closed"):
            env.step(np.zeros(env.action_space.shape))
        with pytest.raises(gym.error.ClosedEnvironmentError, match="closed"):
            env.reset()
