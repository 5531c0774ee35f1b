"""`BaseEnv` and what all environments take over from it: guards, spec, warnings that point at the user's line."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.disturbances.schedule import Schedule
from artde_gym.envs.single import BaseEnv
from artde_gym.errors import ActionError, DisturbanceError, OptionError, RobotError
from artde_gym.evaluation.environments import ours
from artde_gym.layout import Field, Layout

LATE = {"push": [{"start": 100.0, "magnitude": 1.0, "duration": 0.1}]}


class Cart(BaseEnv):
    """A mass of 1 kg on a rail, in few lines."""

    observation_layout = Layout((Field("x", 1, "m", -1.0, 1.0, "place"),))
    action_layout = Layout((Field("force", 1, "N", -2.0, 2.0, "force"),))
    robot_name = "arm"  # whose kinds of disturbances it takes
    words, time_step, allowed_action = {"site": ("cart",), "joint": ()}, 0.01, "force (N)"
    reward_scales: ClassVar[Mapping[str, float]] = {"near": 2.0, "alive": 0.5}
    fall_reasons = ("left",)

    def __init__(self, disturbances: Any = None, render_mode: str | None = None) -> None:
        super().__init__(disturbances, control_period=0.02, substeps=2, last=5, render_mode=render_mode)

    def _begin(self, sampled: Mapping[str, Any]) -> None:
        self.x = self.v = 0.0
        self.schedule = Schedule(sampled, self.time_step)

    def _simulate(self, command: np.ndarray) -> list[str]:
        for _ in range(2):
            self.v += self.time_step * float(command[0])
            self.x += self.time_step * self.v
        return []

    def _measure(self) -> np.ndarray:
        return np.array([self.x])

    def _reward_terms(self) -> dict[str, float]:
        return {"near": 1.0 - abs(self.x), "alive": 1.0}

    def _falls(self) -> Sequence[bool]:
        return [abs(self.x) > 1.0]


def test_a_subclass_is_guarded_and_told_about() -> None:
    env = Cart()
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(1))
    _, first = env.reset(seed=0)
    for wrong in (np.zeros(2), [np.nan], ["a"]):
        with pytest.raises(ActionError):
            env.step(np.array(wrong))
    for number in range(1, 6):
        observation, reward, terminated, truncated, info = env.step(np.array([9.0]))
        assert reward == 0.02 * (2.0 * (1.0 - observation[0]) + 0.5)
        assert (terminated, truncated) == (False, number == 5)
        assert info.keys() == first.keys()
        assert info["time_s"] == number * 0.02
    assert env.v == pytest.approx(0.2)  # of a force that is clipped to 2 N
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros(1))
    for options in ({"disturbance": {}}, {"scenario": "Q1", "other": 1}):
        with pytest.raises(OptionError):
            env.reset(options=options)
    with pytest.raises(DisturbanceError):
        env.reset(options={"disturbances": {"nonsense": 1}})
    with pytest.raises(RobotError):
        env.push("nose", (1.0, 0.0, 0.0))
    env.close()
    for call in (env.reset, env.render, lambda: env.step(np.zeros(1))):
        with pytest.raises(gym.error.ClosedEnvironmentError):
            call()


def test_a_subclass_has_a_spec_with_its_steps() -> None:
    gym.register("Cart-v0", f"{__name__}:Cart", disable_env_checker=True)
    try:
        env = gym.make("Cart-v0")
        assert env.spec is not None
        assert env.spec.max_episode_steps == 5
        with pytest.raises(OptionError, match="render_mode"):
            Cart(render_mode="human")
    finally:
        gym.registry.pop("Cart-v0")


def lines_of(call: Callable[[], Any]) -> set[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    assert caught
    return {warning.filename for warning in caught}


@pytest.mark.parametrize("name", ours())
def test_warnings_point_at_the_line_of_the_user(name: str) -> None:
    engine = "numpy" if name.startswith("Quad") else "mujoco"
    calm = {"duration": 0.1, "disturbances": {}}
    single = gym.make(name, engine="mujoco", disable_env_checker=True, **calm)
    vector = gym.make_vec(name, 1, "vector_entry_point", engine=engine, **calm)
    for env in (single, vector):
        assert lines_of(lambda env=env: env.reset(options={"disturbances": LATE})) == {__file__}
    late = {"duration": 0.1, "disturbances": LATE}
    assert lines_of(lambda: gym.make(name, engine="mujoco", **late)) == {__file__}
    assert lines_of(lambda: gym.make_vec(name, 1, "vector_entry_point", **late)) == {__file__}


@pytest.mark.parametrize("name", [name for name in ours() if not name.startswith("Biped")])  # which settles anew
def test_a_payload_attached_on_demand_is_that_of_the_same_disturbance(name: str, engine_name: Any) -> None:
    """An episode with the disturbances that live play has recorded does the same again."""
    arguments: dict[str, Any] = {"engine": engine_name, "disable_env_checker": True, "duration": 0.3}
    played: Any = gym.make(name, disturbances={}, **arguments).unwrapped
    played.reset(seed=0)
    action = 0.5 * (played.action_space.low + played.action_space.high)
    for _ in range(4):
        played.step(action)
    assert played.add_payload({"mass": 0.3})
    again: Any = gym.make(name, disturbances=played.sampled_disturbances, **arguments).unwrapped
    again.reset(seed=0)
    for _ in range(4):
        again.step(action)
    for _ in range(6):
        assert played.step(action)[0].tolist() == again.step(action)[0].tolist()
