"""What Gymnasium and its clients expect of an environment, of every registered one, single and in a vector."""

import contextlib
import copy
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import TimeAwareObservation

from artde_gym.errors import ActionError, ArtdeGymError, OptionError, UnknownArgumentError
from artde_gym.evaluation.environments import ours
from artde_gym.info import fall_reason
from artde_gym.sim.factory import resolve_engine

BRIEF: dict[str, Any] = {
    "payload": 0.3,
    "push": [{"magnitude": 1.0, "start": 0.0, "duration": 0.001}, {"magnitude": 2.0, "start": 0.0, "duration": 0.03}],
    "actuator_effectiveness": [{"joint": "all", "factor": {"uniform": [0.9, 1.0]}}],
}
KINDS = [(name, vector) for name in ours() for vector in (False, True)]


def make(name: str, *, vector: bool, **kwargs: Any) -> Any:
    arguments: dict[str, Any] = {"disturbances": BRIEF, "duration": 0.12, "control_period": 0.01, **kwargs}
    if name.startswith("Biped"):
        arguments = {"actuator_inertia": "lumped", **arguments}  # quicker
    if not vector:
        return gym.make(name, disable_env_checker=True, **arguments).unwrapped
    engine = "numpy" if name.startswith("Quad") else "mujoco"
    return gym.make_vec(name, 3, "vector_entry_point", **{"engine": engine, **arguments})


def middle(env: Any) -> np.ndarray:
    """An action of no effort, but for the quadrotor's weight."""
    return 0.5 * (env.action_space.low + env.action_space.high)


@pytest.fixture(params=KINDS, ids=lambda kind: f"{kind[0]}{'-vector' if kind[1] else ''}")
def env(request: pytest.FixtureRequest) -> Any:
    name, vector = request.param
    return make(name, vector=vector)


def arrays(info: dict[str, Any]) -> list[np.ndarray]:
    return [value for value in info.values() if isinstance(value, np.ndarray)]


def test_info_is_numbers_and_arrays_with_the_same_keys_after_reset_and_step(env: Any) -> None:
    _, first = env.reset(seed=0)
    infos = [first, *(env.step(middle(env))[-1] for _ in range(3))]
    for info in infos:
        assert [(name, np.shape(value), np.asarray(value).dtype) for name, value in sorted(info.items())] == [
            (name, np.shape(value), np.asarray(value).dtype) for name, value in sorted(first.items())
        ]
        assert all(type(value) in (int, float, bool) or value.dtype.kind in "biuf" for value in info.values())


def test_nothing_that_is_handed_out_shares_memory(env: Any) -> None:
    """A caller that overwrites all that it was given changes nothing that happens later."""
    other = make(env.spec.id, vector=isinstance(env, gym.vector.VectorEnv))
    for each in (env, other):
        each.reset(seed=0)
    for _ in range(6):
        observation, reward, terminated, truncated, info = env.step(middle(env))
        expected = copy.deepcopy(other.step(middle(other)))
        assert observation.tobytes() == expected[0].tobytes()
        assert {name: np.asarray(value).tolist() for name, value in info.items()} == {
            name: np.asarray(value).tolist() for name, value in expected[-1].items()
        }
        given = [array for array in (observation, reward, terminated, truncated) if isinstance(array, np.ndarray)]
        for array in [*given, *arrays(info)]:
            array[...] = 1
        drawn = env.sampled_disturbances
        for one in drawn if isinstance(drawn, list) else [drawn]:
            one["payload"]["mass"] = 4.0
            one["push"].clear()
        info.clear()


def test_a_picture_belongs_to_the_caller() -> None:
    for name in ours():
        env = make(name, vector=False, render_mode="rgb_array", width=64, height=48)
        env.reset(seed=0)
        picture = env.render()
        kept = picture.copy()
        picture[:] = 0
        assert np.array_equal(env.render(), kept)
        env.close()


def test_a_push_within_one_step_is_told_as_begun_and_ended(env: Any) -> None:
    env.reset(seed=0)
    _, _, _, _, info = env.step(middle(env))
    assert np.all(info["push_begins"] == 2)
    assert np.all(info["push_ends"] == 1)


def test_a_step_is_refused_before_a_reset_after_an_end_and_after_close(env: Any) -> None:
    vector = isinstance(env, gym.vector.VectorEnv)
    with pytest.raises(gym.error.ResetNeeded):
        env.step(middle(env))
    env.reset(seed=0)
    for _ in range(12):
        env.step(middle(env))
    if not vector:
        with pytest.raises(gym.error.ResetNeeded):
            env.step(middle(env))
    env.close()
    for call in (env.reset, lambda: env.step(middle(env)), *([] if vector else [env.render])):
        with pytest.raises(gym.error.ClosedEnvironmentError):
            call()


@pytest.mark.once
@pytest.mark.parametrize("name", ours())
def test_a_step_after_a_fall_is_refused(name: str, engine_name: Any) -> None:
    env = make(name, vector=False, duration=3.0, engine=engine_name, disturbances={})
    env.reset(seed=0)
    terminated, info = False, {}
    while not terminated:
        _, _, terminated, _, info = env.step(env.action_space.low)
    assert fall_reason(info) in env.fall_reasons
    with pytest.raises(gym.error.ResetNeeded):
        env.step(env.action_space.low)


def test_seeds_of_any_integer_type_are_one_seed_and_others_are_refused(env: Any) -> None:
    first, _ = env.reset(seed=0)
    for seed in (np.array(0), np.int64(0), np.uint8(0)):
        assert env.reset(seed=seed)[0].tobytes() == first.tobytes()
    for seed in (-1, 1.0, "one", np.array(0.0), True):
        with pytest.raises(OptionError, match="seed"):
            env.reset(seed=seed)


def test_actions_are_real_numbers(env: Any) -> None:
    env.reset(seed=0)
    for action in (middle(env) + 1j, middle(env).astype(str)):
        with pytest.raises(ActionError, match="numbers"):
            env.step(action)


@pytest.mark.parametrize(("name", "vector"), KINDS)
def test_an_unknown_argument_is_refused_with_a_suggestion(name: str, vector: bool) -> None:
    with pytest.raises(UnknownArgumentError, match=r"unexpected keyword argument 'contol_period'.*'control_period'"):
        make(name, vector=vector, contol_period=0.01)
    with pytest.raises(TypeError):  # as Python's own, for clients that try arguments of other libraries
        make(name, vector=vector, frameskip=4)


def test_the_spec_tells_the_length_of_an_episode(env: Any) -> None:
    assert gym.spec(env.spec.id).max_episode_steps is None  # it depends on the arguments
    assert env.spec.max_episode_steps == 12
    env.reset(seed=0)
    truncated = [np.any(env.step(middle(env))[3]) for _ in range(12)]
    assert truncated == [False] * 11 + [True]


@pytest.mark.parametrize("name", ours())
def test_time_aware_observations_and_videos(name: str) -> None:
    env = make(name, vector=False, duration=0.12)
    aware = TimeAwareObservation(env, normalize_time=True)
    aware.reset(seed=0)
    assert aware.step(middle(env))[0][-1] == pytest.approx(1 / 12)
    for period in (0.005, 0.01, 0.015, 0.05):
        assert 0 < make(name, vector=False, control_period=period).metadata["render_fps"] <= 100


@pytest.mark.parametrize("name", ours())
def test_what_can_never_happen_is_warned_of(name: str) -> None:
    late: dict[str, Any] = {"push": [{"magnitude": 1.0, "start": {"uniform": [1.0, 2.0]}}]}
    for vector in (False, True):
        with pytest.warns(UserWarning, match=r"push can never happen: begins at 1 s .* ends at 0\.12 s"):
            env = make(name, vector=vector, disturbances=late)
        with pytest.warns(UserWarning, match="payload can never happen"):
            env.reset(options={"disturbances": {"payload": {"mass": 0.1, "attach_time": 0.1, "detach_time": 0.05}}})
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            make(name, vector=vector, disturbances={"push": [*late["push"], BRIEF["push"][0]]})
    if name == "BipedPush-v0":
        with pytest.warns(UserWarning, match="push can never happen: begins at 28 s"):
            gym.make(name, duration=6.0)


# ------------------------------------------------------------------------------------------------------------- vectors


@pytest.mark.parametrize("name", ours())
def test_a_vector_says_where_it_runs(name: str) -> None:
    own, default = make(name, vector=True).unwrapped.own_engine, resolve_engine(None)
    expected = pytest.warns(UserWarning, match=rf"uses engine '{own}', but gym\.make uses '{default}'")
    with contextlib.nullcontext() if own == default else expected:
        make(name, vector=True, engine=None)
    with pytest.raises(OptionError, match="sync"):
        make(name, vector=True, engine="bullet")
    with pytest.raises(OptionError, match="sync"):
        make(name, vector=True, render_mode="rgb_array")
    with pytest.raises(OptionError, match="NextStep"):
        make(name, vector=True, autoreset_mode="never")


@pytest.mark.once
@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("name", ours())
def test_autoreset_modes_are_those_of_gymnasiums_own_vectors(name: str, mode: AutoresetMode) -> None:
    """Beside a `SyncVectorEnv`: the same ends, rewards, observations and infos, but for what the engines differ in."""
    single: dict[str, Any] = {"disturbances": BRIEF, "duration": 0.12, "control_period": 0.01}
    single |= {"engine": "mujoco", "actuator_inertia": "lumped"} if name.startswith("Biped") else {}
    env = make(name, vector=True, autoreset_mode=mode.value)
    assert env.metadata["autoreset_mode"] is mode
    theirs: Any = gym.make_vec(name, 3, "sync", vector_kwargs={"autoreset_mode": mode}, **single)
    seen, expected = env.reset(seed=[4, 2, 7]), theirs.reset(seed=[4, 2, 7])
    tolerance = 0.0 if name.startswith("Biped") else 0.05
    for _ in range(30):
        assert seen[-1].keys() == expected[-1].keys()
        np.testing.assert_allclose(seen[0], expected[0], rtol=0, atol=tolerance)
        for part, other in zip(seen[1:-1], expected[1:-1], strict=True):
            np.testing.assert_allclose(part, other, rtol=0, atol=tolerance)
        _compare(seen[-1], expected[-1], tolerance)
        ended = np.zeros(3, np.bool_) if len(seen) == 2 else seen[2] | seen[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            options = {"reset_mask": ended}
            seen, expected = env.reset(options=options), theirs.reset(options=options)
        else:
            seen, expected = env.step(middle(env)), theirs.step(middle(env))
    theirs.close()


def _compare(info: dict[str, Any], other: dict[str, Any], tolerance: float) -> None:
    assert info.keys() == other.keys()
    for name, value in info.items():
        if isinstance(value, dict):
            _compare(value, other[name], tolerance)
        elif name == "final_obs":
            for i in np.flatnonzero(info["_final_obs"]):
                np.testing.assert_allclose(value[i], other[name][i], rtol=0, atol=tolerance)
        else:
            known = info.get(f"_{name}", np.ones(3, np.bool_))
            assert value.dtype == other[name].dtype, name
            np.testing.assert_allclose(value[known], other[name][known], rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", ours())
def test_disabled_vectors_wait_unmoved(name: str) -> None:
    env = make(name, vector=True, autoreset_mode="Disabled")
    env.reset(seed=0)
    last = [env.step(middle(env)) for _ in range(12)][-1]
    assert last[3].all()
    for _ in range(20):
        observation, reward, terminated, truncated, info = env.step(middle(env) * np.nan)
        assert observation.tobytes() == last[0].tobytes()
        assert not np.any([reward, terminated, truncated])
        assert info["time_s"].tolist() == last[-1]["time_s"].tolist()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("name", ours())
def test_a_vector_of_tensors(name: str, mode: str) -> None:
    torch = pytest.importorskip("torch")
    pytest.importorskip("array_api_compat")
    from gymnasium.wrappers.vector import NumpyToTorch

    env: Any = NumpyToTorch(make(name, vector=True, autoreset_mode=mode))
    env.reset(seed=0)
    info = [env.step(torch.tensor(middle(env)))[-1] for _ in range(14)][-1]
    assert isinstance(info["disturbance.push.magnitude"], torch.Tensor)


def test_errors_of_arguments_are_errors_of_the_project() -> None:
    assert issubclass(UnknownArgumentError, ArtdeGymError)
