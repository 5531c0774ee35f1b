"""What environments of many robots share: Gymnasium's conventions of vectors, seeds, masks, and ends of episodes."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from artde_gym.arguments import flag
from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.envs.options import disturbances_in
from artde_gym.errors import ActionError, OptionError
from artde_gym.layout import Layout
from artde_gym.tracking import Tracking

Mask = NDArray[np.bool_]
Order = Literal["C", "F"]


class BatchEnv(VectorEnv[Array, ArrayLike, NDArray[Any]], abc.ABC):
    """Many environments in one. Each has a generator of its own, and does the same whatever the number beside it.

    A subclass says what happens; observations and actions are (n, size), in its `order` of memory.

    Args:
        num_envs: number of environments.
        dtype: of all numbers.
        autoreset: whether an episode that is over begins anew with the next step, which ignores its action, or waits
            for a reset, unmoved.

    Raises:
        OptionError: for an argument out of range.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    order: ClassVar[Order] = "C"
    action_layout: Layout
    observation_layout: Layout
    robot_name: ClassVar[str]
    tracking: ClassVar[Tracking]
    reward_scales: ClassVar[Mapping[str, float]]
    fall_reasons: ClassVar[Sequence[str]]
    allowed_action: ClassVar[str]
    control_period: float
    _disturbances: Disturbances
    _last: int  # control period with which an episode ends
    _np_random: Any  # a list: one for each environment, as for the seeds
    _np_random_seed: Any

    def __init__(
        self, num_envs: int, dtype: Literal["float64", "float32"] = "float64", *, autoreset: bool = True
    ) -> None:
        if isinstance(num_envs, bool) or not (isinstance(num_envs, int) and num_envs >= 1):
            raise OptionError("num_envs", num_envs, "a whole number >= 1")
        self.num_envs = num_envs
        self.dtype = np.dtype(dtype)
        self.single_observation_space = self.observation_layout.box(self.dtype)
        self.single_action_space = self.action_layout.box(self.dtype)
        self._low, self._high = self.single_action_space.low, self.single_action_space.high
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        if not autoreset:
            self.metadata = {**self.metadata, "autoreset_mode": AutoresetMode.DISABLED}
        self._autoreset = flag("autoreset", autoreset)
        seeded = [seeding.np_random() for _ in range(num_envs)]
        self._np_random, self._np_random_seed = map(list, zip(*seeded, strict=True))
        self._k = np.zeros(num_envs, np.int64)
        self._over: Mask | None = None  # where an episode has ended; None before the first reset

    @abc.abstractmethod
    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        """Read disturbances of this robot."""

    @abc.abstractmethod
    def _start(self, drawn: Mapping[int, Mapping[str, Any]]) -> None:
        """Begin episodes in some environments, with realised disturbances."""

    @abc.abstractmethod
    def _advance(self, commands: Array, goes_on: Mask) -> dict[int, list[str]]:
        """Let actions act for a control period; returns events by environment. Nobody looks where none goes on."""

    @abc.abstractmethod
    def _truth(self) -> Array:
        """The observations without errors of measurement (n, size), a new array."""

    @abc.abstractmethod
    def _measure(self, observations: Array, new: Mask) -> None:
        """Replace the truth by what sensors make of it; where it is not `new`, by what they made of it before."""

    @abc.abstractmethod
    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        """The terms of the reward, and where each reason of a fall holds."""

    def _tell(self) -> dict[str, Array]:
        """More entries of `info`, by name, one value an environment."""
        return {}

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute, once for each environment."""
        return (getattr(self, name),) * self.num_envs

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start episodes.

        Args:
            seed: one for each environment, or a number from which on they count; without, the generators go on.
            options: those of the class' documentation, and Gymnasium's "reset_mask" (n,), where to reset.

        Raises:
            OptionError: for an unknown option or value, or a scenario that needs another environment.
            DisturbanceError: for a malformed disturbance.
        """
        if not isinstance(options, Mapping | None):
            raise OptionError("reset options", options, "a mapping")
        options = dict(options or {})
        mask = self._mask(options.pop("reset_mask", None))
        seeds = self._seeds(seed)
        disturbances = disturbances_in(options, self)
        if disturbances is not None:
            self._disturbances = self._parse(disturbances)
        for i in np.flatnonzero(mask).tolist():
            if seeds[i] is not None:
                self._np_random[i], self._np_random_seed[i] = seeding.np_random(seeds[i])
        info = self._begin(mask)
        self._over = np.zeros(self.num_envs, np.bool_) if self._over is None else self._over & ~mask
        observations = self._truth()
        self._measure(observations, mask)
        self._inform(info, mask)
        return observations, info

    def step(self, actions: ArrayLike) -> tuple[Array, Array, Mask, Mask, dict[str, Any]]:
        """Apply actions for one control period; episodes that were over begin anew instead, or wait.

        Raises:
            ActionError: for a wrong shape, or a value that is not finite in an episode that goes on.
            gymnasium.error.ResetNeeded: before the first reset.
        """
        if self._over is None:
            raise gym.error.ResetNeeded("the episodes have not begun: call reset()")
        over, goes_on = self._over, ~self._over
        events = self._advance(self._commands(actions), goes_on)
        self._k += goes_on
        info = self._begin(over) if self._autoreset else {}
        observations = self._truth()
        terms, falls = self._score(observations)
        total: Any = 0.0
        for name, scale in self.reward_scales.items():
            total = total + scale * terms[name]
        rewards = np.where(over, 0.0, np.asarray(self.control_period * total, np.float64))
        self._measure(observations, goes_on | self._autoreset)
        terminated = np.logical_or.reduce(falls) & goes_on
        truncated = (self._k >= self._last) & goes_on
        self._over = terminated | truncated if self._autoreset else over | terminated | truncated
        self._inform(info, np.ones_like(over))
        info["reward_terms"] = {**terms, **{f"_{name}": goes_on.copy() for name in terms}}
        info["_reward_terms"] = goes_on
        if terminated.any():
            words: dict[int, str] = {}
            for word, fell in zip(reversed(self.fall_reasons), reversed(falls), strict=True):  # the first reason wins
                words.update(dict.fromkeys(np.flatnonzero(fell & terminated).tolist(), word))
            info["fall_reason"], info["_fall_reason"] = self._objects(words)
        if events:
            info["events"], info["_events"] = self._objects(events)
        return observations, rewards, terminated, truncated, info

    def _commands(self, actions: ArrayLike) -> Array:
        """Checked actions as an array of ours."""
        shape = self.action_space.shape
        try:
            with np.errstate(over="ignore"):  # of a cast to float32
                commands = np.array(actions, dtype=self.dtype, order=self.order)
        except (TypeError, ValueError, OverflowError) as error:
            raise ActionError("actions", actions, f"numbers of the shape {shape}") from error
        if commands.shape != shape:
            raise ActionError("shape of the actions", commands.shape, str(shape))
        commands[self._over] = 0.0
        finite = np.isfinite(commands)
        if not finite.all():
            i = int(np.flatnonzero(~finite.all(axis=1))[0])
            raise ActionError(f"action of environment {i}", commands[i].tolist(), f"finite {self.allowed_action}")
        return np.clip(commands, self._low, self._high, out=commands)

    def _mask(self, given: Any) -> Mask:
        if given is None:
            return np.ones(self.num_envs, np.bool_)
        mask = np.asarray(given)
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
            raise OptionError("reset_mask", given, f"({self.num_envs},) truth values, one of them true at least")
        if self._over is None and not mask.all():
            raise OptionError("reset_mask", given, "all true in the first reset")
        return mask

    def _seeds(self, given: int | Sequence[int | None] | None) -> list[int | None]:
        if given is None:
            return [None] * self.num_envs
        if isinstance(given, (int, np.integer)):
            given = range(int(given), int(given) + self.num_envs)
        if not isinstance(given, (Sequence, np.ndarray)) or len(given) != self.num_envs:
            raise OptionError("seed", given, f"None, a number, or {self.num_envs} of them, one for each environment")
        for seed in given:
            if not (seed is None or (isinstance(seed, (int, np.integer)) and seed >= 0)):
                raise OptionError("seed", seed, "a whole number >= 0, or None")
        return [None if seed is None else int(seed) for seed in given]

    def _begin(self, mask: Mask) -> dict[str, Any]:
        """Begin new episodes where the mask is true; returns what is to be told of them."""
        if not mask.any():
            return {}
        drawn = {i: self._disturbances.draw(self._np_random[i]) for i in np.flatnonzero(mask).tolist()}
        self._k[mask] = 0
        self._start(drawn)
        values, known = self._objects(drawn)
        return {"disturbances": values, "_disturbances": known}

    def _inform(self, info: dict[str, Any], mask: Mask) -> None:
        for name, values in {"time_s": self._k * self.control_period, **self._tell()}.items():
            info[name], info[f"_{name}"] = values, mask.copy()

    def _objects(self, known: Mapping[int, Any]) -> tuple[NDArray[Any], Mask]:
        """What is known of some environments as an array, and the mask of these."""
        values, mask = np.full(self.num_envs, None, dtype=object), np.zeros(self.num_envs, np.bool_)
        for i, value in known.items():
            values[i], mask[i] = value, True
        return values, mask
