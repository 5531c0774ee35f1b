"""Base class of single environments: what is checked and done alike for every robot."""

from __future__ import annotations

import abc
import operator
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import action_array, check_seed
from artde_gym.arrays import Array, total
from artde_gym.disturbances.schedule import Schedule
from artde_gym.envs.closed_env import require_open
from artde_gym.envs.interactive import InteractiveMixin
from artde_gym.envs.options import disturbances_in
from artde_gym.errors import OptionError
from artde_gym.layout import Layout
from artde_gym.metrics_spec import MetricsSpec


class BaseEnv(InteractiveMixin, gym.Env[NDArray[Any], NDArray[Any]], abc.ABC):
    """An environment that checks its use, samples disturbances, and assembles rewards and `info`.

    A subclass has the layouts, names and scales below, and simulates its robot in the methods `_begin`, `_simulate`,
    `_measure`, `_reward_terms` and `_falls`.

    Args:
        disturbances: see `artde_gym.disturbances`; None for `default_disturbances`.
        control_period: time between two actions (s).
        substeps: physics steps of `time_step` (s) in a control period.
        last: control periods in an episode.
        render_mode: "rgb_array" or None.

    Raises:
        OptionError: for an unknown render mode.
        DisturbanceError: for a malformed disturbance.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    action_layout: Layout
    observation_layout: Layout
    metrics_spec: MetricsSpec
    allowed_action: ClassVar[str]

    def __init__(
        self,
        disturbances: Mapping[str, Any] | None,
        *,
        control_period: float,
        substeps: int,
        last: int,
        render_mode: str | None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise OptionError("render_mode", render_mode, "None, 'rgb_array'")
        self.render_mode = render_mode
        self.observation_space, self.action_space = self.observation_layout.box(), self.action_layout.box()
        self._size = self.action_layout.size
        self._low, self._high = self.action_space.low, self.action_space.high
        self.control_period, self._substeps, self._last = control_period, substeps, last
        self._k, self._over, self._closed = 0, True, False  # no step before the first reset
        self.schedule = Schedule({}, self.time_step)
        self._sample({})
        self._disturb(disturbances)

    @abc.abstractmethod
    def _begin(self, sampled: Mapping[str, Any]) -> None:
        """Set up an episode with sampled disturbances."""

    @abc.abstractmethod
    def _simulate(self, command: Array) -> Sequence[str]:
        """Apply an action within its bounds for a control period, and return the events."""

    @abc.abstractmethod
    def _measure(self) -> Array:
        """Return the observation."""

    @abc.abstractmethod
    def _reward_terms(self) -> dict[str, float]:
        """Return the terms of the reward in the order of `reward_scales`."""

    @abc.abstractmethod
    def _falls(self) -> Sequence[bool]:
        """Return which of `fall_reasons` hold."""

    def _draw(self) -> NDArray[np.uint8]:
        """Draw a frame."""
        raise NotImplementedError

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Start an episode; the class' documentation lists the `options`.

        Raises:
            OptionError: for an unknown option, or a scenario of another environment.
            DisturbanceError: for a malformed disturbance.
        """
        self._require_open()
        disturbances = disturbances_in(options or {}, self)
        if disturbances is not None:
            self._disturb(disturbances)
        super().reset(seed=check_seed("seed", seed))
        sampled = self._disturbances.sample(self.np_random)
        self._sample(sampled)
        self._begin(sampled)
        self._k, self._over = 0, False
        return self._measure(), self._info(dict.fromkeys(self.reward_scales, 0.0), (), ())

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply an action for one control period.

        Raises:
            ActionError: for a wrong shape or a value that is not finite.
            gymnasium.error.ResetNeeded: after the end of the episode, or before the first reset.
            gymnasium.error.ClosedEnvironmentError: after `close`.
        """
        if self._over:
            self._require_open()
            raise gym.error.ResetNeeded("the episode is over or has not begun: call reset()")
        action = action_array(action, self._size, self.allowed_action)
        events = self._simulate(np.minimum(np.maximum(action, self._low), self._high))
        self._k += 1
        observation = self._measure()
        terms = self._reward_terms()
        reward = self.control_period * total(map(operator.mul, self.reward_scales.values(), terms.values()))
        falls = tuple(self._falls())
        fell, truncated = any(falls), self._k >= self._last
        self._over = fell or truncated
        return observation, reward, fell, truncated, self._info(terms, falls, events)

    def render(self) -> NDArray[np.uint8] | None:
        """Draw a frame; return None without a render mode."""
        self._require_open()
        return None if self.render_mode is None else self._draw()

    def close(self) -> None:
        self._closed = self._over = True

    @property
    def elapsed(self) -> int:
        return self._k * self._substeps

    def _info(self, terms: dict[str, float], falls: Sequence[bool], events: Sequence[str]) -> dict[str, Any]:
        """Return the `info`: data that policies must not use."""
        return self._told.told(self._k * self.control_period, terms, events, falls)

    def _require_open(self) -> None:
        require_open(closed=self._closed)
