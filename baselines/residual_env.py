"""A residual as a Gymnasium environment for an agent: features in, action in [-1, 1]^n out."""

from __future__ import annotations

from collections import Counter
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from artde_gym.arguments import action_array
from artde_gym.disturbances.schedule import EVENTS
from baselines.action_adapter import total
from baselines.residual import Residual, ResidualState
from baselines.residual_config import ResidualConfig
from controllers.laws.tracking import Array

Float = NDArray[np.float32]

RESIDUAL = "residual_"  # before names of the terms of its reward


class ResidualEnv(gym.Wrapper[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]):
    """An environment of this project under a base controller, whose residual is the action.

    One step is one decision: `decision_period` seconds, in which the base controls at its own rate. Zero action is the
    base controller alone, bit for bit.

    Args:
        env: the environment, wrapped or not.
        config: of the residual.

    ## Action
    `Box(-1, 1, (n,), float32)`; its components are `actions` (names), what they do is told by `baselines.arm`,
    `baselines.ojas` and `baselines.q450`. Clipped to the bounds.

    ## Observation
    `Box(-inf, inf, (n,), float32)`; `observation_layout` names its fields. Not normalized: that is for training.

    ## Reward
    The sum of the robot's `reward_scales` times terms, at the end of each decision; terms are in `info`, each with
    `residual_` before its name.

    Raises:
        OptionError: if `config` is another robot's, or `decision_period` is no whole number of control periods.
    """

    def __init__(self, env: gym.Env[Any, Any], config: ResidualConfig) -> None:
        super().__init__(env)
        self.residual = Residual.of(env, config)
        self.agent_layout = self.residual.features
        self.actions = self.residual.actions
        self.observation_space = agent_space(self.residual)
        self.action_space = action_space(self.residual)
        self._memory: ResidualState | None = None
        self._observation: Array = np.zeros(0)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Float, dict[str, Any]]:
        """Start an episode; seed and options are the environment's."""
        self._observation, info = self.env.reset(seed=seed, options=options)
        self._memory = self.residual.start(self._observation)
        info |= {RESIDUAL + name: 0.0 for name in self.residual.adapter.reward_scales}
        return self._features(), info

    def step(self, action: NDArray[Any]) -> tuple[Float, float, bool, bool, dict[str, Any]]:
        """Let an action act for one decision.

        Raises:
            ActionError: for a wrong shape or a value that is not finite.
            gymnasium.error.ResetNeeded: before the first reset.
        """
        if self._memory is None:
            raise gym.error.ResetNeeded("the episode has not begun: call reset()")
        action = action_array(action, len(self.actions), "numbers from -1 to 1")
        action = np.minimum(np.maximum(action, -1.0), 1.0)
        memory = self.residual.set_action(self._memory, action)
        terminated = truncated = False
        info: dict[str, Any] = {}
        events: Counter[str] = Counter()
        for _ in range(self.residual.periods):
            force, memory = self.residual.control(self._observation, memory)
            self._observation, _, terminated, truncated, info = self.env.step(force)
            events.update({name: info[name] for name in EVENTS})
            if terminated or truncated:
                break
        info |= events
        self._memory = memory
        features = self._features()
        adapter = self.residual.adapter
        terms = adapter.reward_terms(self._observation, self._memory.adapter, terminated)
        info |= {RESIDUAL + name: float(value) for name, value in terms.items()}
        reward = float(total(adapter.reward_scales, terms))
        return features, reward, bool(terminated), bool(truncated), info

    def _features(self) -> Float:
        assert self._memory is not None
        features, self._memory = self.residual.observe(self._observation, self._memory)
        return features.astype(np.float32)


def agent_space(residual: Residual) -> Box:
    """Return the space of an agent's features."""
    return Box(-np.inf, np.inf, (residual.features.size,), np.float32)


def action_space(residual: Residual) -> Box:
    """Return the space of an agent's actions."""
    return Box(-1.0, 1.0, (len(residual.actions),), np.float32)
