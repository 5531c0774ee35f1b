"""Base class of vector environments: Gymnasium's conventions for vectors, seeds, masks and ends of episodes."""

from __future__ import annotations

import abc
import copy
import warnings
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, Self

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from artde_gym.arguments import check_seed, real_array
from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.grammar import duplicate
from artde_gym.disturbances.numeric import numeric_rows
from artde_gym.disturbances.schedule import EVENTS
from artde_gym.envs.closed_env import require_open
from artde_gym.envs.disturbed import DisturbedMixin
from artde_gym.envs.options import disturbances_in, user_level
from artde_gym.errors import ActionError, OptionError
from artde_gym.info import FELL, REWARD, Columns, Mask, SampledTable, cleared, masked, prefixed
from artde_gym.layout import Layout
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.sim.factory import resolve_engine

Order = Literal["C", "F"]


class BaseVectorEnv(DisturbedMixin, VectorEnv[Array, ArrayLike, NDArray[Any]], abc.ABC):
    """Many environments in one, each with its own random generator and independent of their number.

    A subclass defines the task; observations and actions are (n, size), in its memory `order`.

    Args:
        num_envs: number of environments.
        dtype: data type of all numbers.
        engine: None for the engine of this class, with a warning if `gym.make` would use another one.
        render_mode: None; only single environments render.
        autoreset_mode: Gymnasium's. With `NEXT_STEP` a finished episode restarts with the next step, which ignores its
            action; with `SAME_STEP` in the same step, with its last observation and info in `info["final_obs"]` and
            `info["final_info"]`; with `DISABLED` it stays as it is until a reset.
        max_episode_steps: steps after which an episode is truncated, if its duration is longer.

    Raises:
        OptionError: for an argument out of range.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    order: ClassVar[Order] = "C"
    action_layout: Layout
    observation_layout: Layout
    metrics_spec: MetricsSpec
    reward_scales: ClassVar[Mapping[str, float]]
    fall_reasons: ClassVar[Sequence[str]]
    allowed_action: ClassVar[str]
    own_engine: ClassVar[str]
    _apart: Sequence[Disturbances] = ()  # of each environment, where they differ
    _np_random: Any  # a list with one entry per environment, as the seeds
    _np_random_seed: Any

    def __init__(
        self,
        num_envs: int,
        dtype: Literal["float64", "float32"] = "float64",
        *,
        engine: str | None,
        render_mode: None,
        autoreset_mode: AutoresetMode | str,
        max_episode_steps: int | None,
    ) -> None:
        if isinstance(num_envs, bool) or not (isinstance(num_envs, int) and num_envs >= 1):
            raise OptionError("num_envs", num_envs, "a whole number >= 1")
        if render_mode is not None:
            raise OptionError("render_mode", render_mode, "None; vectorization_mode='sync' draws pictures")
        if not (max_episode_steps is None or (isinstance(max_episode_steps, int) and max_episode_steps >= 1)):
            raise OptionError("max_episode_steps", max_episode_steps, "a whole number >= 1, or None")
        self.autoreset_mode = _mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self._limit = max_episode_steps
        self._check_engine(engine)
        self.num_envs = num_envs
        self.dtype = np.dtype(dtype)
        self.single_observation_space = self.observation_layout.box(self.dtype)
        self.single_action_space = self.action_layout.box(self.dtype)
        self._low, self._high = self.single_action_space.low, self.single_action_space.high
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        seeded = [seeding.np_random() for _ in range(num_envs)]
        self._np_random, self._np_random_seed = map(list, zip(*seeded, strict=True))
        self._k = np.zeros(num_envs, np.int64)
        self._all = np.ones(num_envs, np.bool_)
        self._reason_names = [FELL + name for name in self.fall_reasons]
        self._over: Mask | None = None  # where an episode has ended; None before the first reset
        self._sampled: list[Mapping[str, Any]] = [{}] * num_envs
        self._table = SampledTable(num_envs)

    def _set_episodes(self, last: int, disturbances: Mapping[str, Any] | None) -> None:
        """Set the length of an episode (control periods), unless it is limited to fewer, and the disturbances."""
        self._last = min(last, self._limit or last)
        self._disturb(disturbances)

    @abc.abstractmethod
    def _start(self, drawn: Mapping[int, Mapping[str, Any]]) -> None:
        """Begin episodes in some environments with sampled disturbances."""

    @abc.abstractmethod
    def _advance(self, commands: Array, goes_on: Mask) -> dict[int, list[str]]:
        """Apply actions for a control period; return events by environment. Only results where `goes_on` are used."""

    @abc.abstractmethod
    def _truth(self) -> Array:
        """Return the observations without measurement errors (n, size), a new array."""

    @abc.abstractmethod
    def _measure(self, observations: Array, new: Mask) -> None:
        """Replace true values by measurements: new ones where `new`, else the previous ones."""

    @abc.abstractmethod
    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        """Return the terms of the reward, and masks of the reasons for a fall."""

    def _tell(self) -> Columns:
        """Return further entries of `info` by name, one value per environment."""
        return {}

    def _end(self, ended: Mask) -> None:
        """Hold environments whose episodes have ended until their reset."""

    def __copy__(self) -> Self:
        return copy.deepcopy(self)  # environments cannot share an engine

    @property
    def sampled_disturbances(self) -> list[dict[str, Any]]:
        """The disturbances of each episode in the grammar of `artde_gym.disturbances`."""
        return [duplicate(sampled) for sampled in self._sampled]

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute, once for each environment."""
        return (getattr(self, name),) * self.num_envs

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start episodes.

        Args:
            seed: one per environment, or the first of consecutive seeds; None: the generators continue.
            options: see the class' documentation, "disturbances" also as a list, one mapping per environment; also
                Gymnasium's "reset_mask" (n,), the environments to reset.

        Raises:
            OptionError: for an unknown option or value, or a scenario of another environment.
            DisturbanceError: for a malformed disturbance.
        """
        require_open(closed=self.closed)
        if not isinstance(options, Mapping | None):
            raise OptionError("reset options", options, "a mapping")
        options = dict(options or {})
        mask = self._mask(options.pop("reset_mask", None))
        seeds = self._seeds(seed)
        disturbances = disturbances_in(options, self)
        if disturbances is not None:
            self._replace(disturbances)
        for i in np.flatnonzero(mask).tolist():
            if seeds[i] is not None:
                self._np_random[i], self._np_random_seed[i] = seeding.np_random(seeds[i])
        self._begin(mask)
        self._over = np.zeros(self.num_envs, np.bool_) if self._over is None else self._over & ~mask
        observations = self._truth()
        self._measure(observations, mask)
        terms = {name: np.zeros(self.num_envs, self.dtype) for name in self.reward_scales}
        nowhere = np.zeros(self.num_envs, np.bool_)
        told = prefixed(REWARD, terms) | self._counts({}) | self._reasons(nowhere, [nowhere] * len(self.fall_reasons))
        return observations, self._info(mask, told)

    def step(self, actions: ArrayLike) -> tuple[Array, Array, Mask, Mask, dict[str, Any]]:
        """Apply actions for one control period; finished episodes restart instead, or wait.

        Raises:
            ActionError: for a wrong shape, or a value that is not finite in a running episode.
            gymnasium.error.ResetNeeded: before the first reset.
            gymnasium.error.ClosedEnvironmentError: after `close`.
        """
        require_open(closed=self.closed)
        if self._over is None:
            raise gym.error.ResetNeeded("the episodes have not begun: call reset()")
        over, goes_on = self._over, ~self._over
        begun = over if self.autoreset_mode is AutoresetMode.NEXT_STEP else np.zeros_like(over)
        events = self._advance(self._commands(actions), goes_on)
        self._k += goes_on
        self._begin(begun)
        observations = self._truth()
        terms, falls = self._score(observations)
        total: Any = 0.0
        for name, scale in self.reward_scales.items():
            total = total + scale * terms[name]
        rewards = np.where(over, 0.0, np.asarray(self.control_period * total, np.float64))
        self._measure(observations, goes_on | begun)
        terminated = np.logical_or.reduce(falls) & goes_on
        truncated = (self._k >= self._last) & goes_on
        ended = terminated | truncated
        told = cleared(prefixed(REWARD, terms), over) | self._counts(events) | self._reasons(terminated, falls)
        info = self._info(self._all, told)
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            self._over = ended.copy()
        elif ended.any():
            if self.autoreset_mode is AutoresetMode.SAME_STEP:
                observations, info = self._renew(observations, info, told, ended)
            else:
                self._over = over | ended
                self._end(ended)
        return observations, rewards, terminated, truncated, info

    def close_extras(self, **kwargs: Any) -> None:
        """Free the environment's resources; see `close`."""

    def _check_engine(self, engine: str | None) -> None:
        """Warn if the engine was not chosen and differs from the one of `gym.make`."""
        if engine is None:
            default = resolve_engine(None)
            if default != self.own_engine:
                warnings.warn(
                    f"{type(self).__name__} uses engine {self.own_engine!r}, but gym.make uses {default!r} by default: "
                    f"results will differ; pass engine={self.own_engine!r} to silence this warning",
                    stacklevel=user_level(),
                )
        elif engine != self.own_engine:
            allowed = f"{self.own_engine!r}; for engine {engine!r}: gym.make_vec(..., vectorization_mode='sync')"
            raise OptionError("engine", engine, allowed)

    def _replace(self, given: Any) -> None:
        """Take other disturbances from now on: for all environments, or a list with those of each."""
        if not isinstance(given, (list, tuple)):
            self._disturbances, self._apart = self._parse(given), ()
        elif len(given) == self.num_envs:
            self._apart = [self._parse(one) for one in given]
        else:
            allowed = f"a mapping, or a list of {self.num_envs}, one for each environment"
            raise OptionError("disturbances", f"a list of {len(given)}", allowed)
        for one in self._apart or (self._disturbances,):
            self._warn_of_idle(one)

    def _renew(
        self, observations: Array, info: dict[str, Any], told: Columns, ended: Mask
    ) -> tuple[Array, dict[str, Any]]:
        """Restart episodes in the step that ended them."""
        final = {"final_obs": np.where(ended[:, None], observations, 0.0), "final_info": masked(info, ended)}
        self._begin(ended)
        renewed = self._truth()
        self._measure(renewed, ended)
        begun = self._info(self._all, cleared(told, ended))
        return renewed, begun | masked(final, ended.copy())

    def _commands(self, actions: ArrayLike) -> Array:
        """Check actions and copy them into an array."""
        shape = self.action_space.shape
        with np.errstate(over="ignore"):  # of a cast to float32
            commands = real_array("actions", actions, f"numbers of the shape {shape}", self.dtype, self.order)
        if commands.shape != shape:
            raise ActionError("shape of the actions", commands.shape, str(shape))
        commands[self._over] = 0.0
        finite = np.isfinite(commands)
        if not finite.all():
            i = int(np.flatnonzero(~finite.all(axis=1))[0])
            error = ActionError(f"action of environment {i}", commands[i].tolist(), f"finite {self.allowed_action}")
            error.environment = i
            raise error
        return commands.clip(self._low, self._high, commands)

    def _mask(self, given: Any) -> Mask:
        if given is None:
            return np.ones(self.num_envs, np.bool_)
        mask = np.asarray(given)
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
            raise OptionError("reset_mask", given, f"({self.num_envs},) Booleans, at least one of them true")
        if self._over is None and not mask.all():
            raise OptionError("reset_mask", given, "all true in the first reset")
        return mask

    def _seeds(self, given: Any) -> list[int | None]:
        if not isinstance(given, Sequence) and np.ndim(given) == 0:
            first = check_seed("seed", given)
            return [first + i for i in range(self.num_envs)] if first is not None else [None] * self.num_envs
        if isinstance(given, str) or len(given) != self.num_envs:
            raise OptionError("seed", given, f"None, a number, or {self.num_envs} of them, one for each environment")
        return [check_seed("seed", seed) for seed in given]

    def _begin(self, mask: Mask) -> None:
        """Begin new episodes where the mask is true."""
        if not mask.any():
            return
        given = self._apart or (self._disturbances,) * self.num_envs
        drawn = {i: given[i].sample(self._np_random[i]) for i in np.flatnonzero(mask).tolist()}
        self._k[mask] = 0
        self._start(drawn)
        if mask.all():
            self._table = SampledTable(self.num_envs)  # without the columns that earlier disturbances needed
        for i, sampled in drawn.items():
            self._sampled[i] = sampled
        alike: dict[int, list[int]] = {}  # environments with the same disturbances
        for i in drawn:
            alike.setdefault(id(given[i]), []).append(i)
        for some in alike.values():
            self._table.enter(np.array(some), numeric_rows([drawn[i] for i in some], self.words))

    def _info(self, mask: Mask, told: Columns) -> dict[str, Any]:
        """Return the `info` of the environments in a mask: data that policies must not use.

        `told` are terms of the reward, counts of events, and reasons for falls.
        """
        own = {"time_s": self._k * self.control_period, **self._tell(), **self._table.told(), **told}
        return masked(own, mask.copy())

    def _counts(self, events: Mapping[int, list[str]]) -> Columns:
        """Count each kind of event in each environment."""
        counts = {name: np.zeros(self.num_envs, np.int64) for name in EVENTS}
        for i, names in events.items():
            for name in names:
                counts[name][i] += 1
        return counts

    def _reasons(self, terminated: Mask, falls: Sequence[Mask]) -> Columns:
        """Mark the first reason that holds where an episode was terminated."""
        reasons: Columns = dict(zip(self._reason_names, np.zeros((len(falls), self.num_envs), np.bool_), strict=True))
        if not terminated.any():
            return reasons
        left = terminated
        for name, fell in zip(self._reason_names, falls, strict=True):
            reasons[name] = fell & left
            left = left & ~fell
        return reasons


def _mode(given: AutoresetMode | str) -> AutoresetMode:
    """Return Gymnasium's mode, given as such or by its name or value."""
    for mode in AutoresetMode:
        if given in (mode, mode.value, mode.name):
            return mode
    raise OptionError("autoreset_mode", given, ", ".join(repr(mode.value) for mode in AutoresetMode))
