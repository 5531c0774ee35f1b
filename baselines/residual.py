"""A base controller with a residual on top: what training environments and trained policies share.

An agent decides every `decision_period` seconds, on features of the observation and of the base; its action becomes an
acceleration du that the base adds to the one it desires, at every control period.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.evaluation.identity import digest
from artde_gym.registration import make_controller
from baselines.agent import agent_of
from baselines.joint_adapter import JointAdapter
from baselines.residual_config import NO_BASE, ResidualConfig
from controllers.laws.tracking import Array, LawState
from controllers.policies import ControlInterface, Policy, choose, flatten


class ResidualState(NamedTuple):
    """Of the base and of the adapter."""

    base: Any
    adapter: Any


class Residual:
    """A residual at work on a robot.

    Args:
        interface: of the environment.
        base: the configuration's base controller for it.
        config: of the residual.

    Attributes:
        features: what the agent sees.
        actions: names of its action's components.
        periods: control periods between two decisions.

    Raises:
        OptionError: if the configuration is another robot's, or its decisions do not fall on control periods.
    """

    def __init__(self, interface: ControlInterface, base: Policy, config: ResidualConfig) -> None:
        self.base = base
        self.periods = config.periods(interface.control_period)
        self.config = (
            config
            if config.decision_period
            else dataclasses.replace(config, decision_period=self.periods * interface.control_period)
        )
        self.adapter = (agent_of(interface.robot).adapter or JointAdapter)(interface, self.config, base.gains)
        self.features, self.actions = self.adapter.features, self.adapter.actions

    @classmethod
    def of(cls, env: Any, config: ResidualConfig) -> Residual:
        """For an environment, or anything else that `ControlInterface.of` reads."""
        interface = ControlInterface.of(env)
        base = NoBase(interface) if config.base == NO_BASE else make_controller(config.base, env, **config.gains)
        return cls(interface, base, config)

    def start(self, observation: Array) -> ResidualState:
        """Memory at the start of an episode."""
        return ResidualState(self.base.start(self.base.read(observation)), self.adapter.start(observation))

    def observe(self, observation: Array, state: ResidualState) -> tuple[Array, ResidualState]:
        """Return the agent's features (..., n_features) and the next state."""
        inside = {
            **self.base.internals(state.base),
            **self.base.preview(state.base, self.base.read(observation)),
        }
        features, adapter = self.adapter.observe(observation, inside, state.adapter)
        return features, state._replace(adapter=adapter)

    def set_action(self, state: ResidualState, action: Array) -> ResidualState:
        """Memory with a new action (..., n_actions)."""
        return state._replace(adapter=self.adapter.set_action(state.adapter, action))

    def control(
        self, observation: Array, state: ResidualState, more: Array | None = None
    ) -> tuple[Array, ResidualState]:
        """Return the bounded force of one control period and the next state; `more` is added to du."""
        du, adapter = self.adapter.next_residual(state.adapter)
        if more is not None:
            du = _sum(du, more)
        force, base = self.base.predict(observation, state.base, residual=du)
        return force, ResidualState(base, adapter)


def _sum(a: Array, b: Array) -> Array:
    """Add two du; one that is shorter, of the position alone, is zero beyond its end."""
    short, long = (a, b) if a.shape[-1] <= b.shape[-1] else (b, a)
    rest = np.zeros((*short.shape[:-1], long.shape[-1] - short.shape[-1]), short.dtype)
    return np.concatenate([short, rest], axis=-1) + long


class PolicyState(NamedTuple):
    """Of the residual, and the control periods since the last decision (...)."""

    residual: ResidualState
    since: NDArray[np.int64]


class ResidualPolicy(Policy):
    """A residual with an actor, as a policy of the environment: judged like any other controller, or a base itself.

    Args:
        name: under which results are listed.
        interface: of the environment.
        residual: what the actor acts through.
        actor: features (..., n_features) -> action (..., n_actions).
    """

    def __init__(
        self, name: str, interface: ControlInterface, residual: Residual, actor: Callable[[Array], Array]
    ) -> None:
        super().__init__(name, interface, residual.base.gains)
        self.residual, self.actor = residual, actor

    @functools.cached_property
    def identity(self) -> str | None:
        """Hash of the configuration and of what was learned; None if the actor does not tell what that is."""
        try:
            return digest([self.name, self.residual.config, self.actor])
        except TypeError:
            return None

    def read(self, observation: Array) -> _ResidualInput:
        return _ResidualInput(observation, None)

    def with_residual(self, signals: _ResidualInput, du: Array) -> _ResidualInput:
        return signals._replace(du=du)

    def start(self, signals: _ResidualInput) -> LawState:
        observation = signals.observation
        return PolicyState(self.residual.start(observation), np.zeros(observation.shape[:-1], np.int64))

    def step(self, state: Any, signals: _ResidualInput, observation: Array) -> tuple[Array, LawState]:
        residual, due = state.residual, state.since == 0
        if due.any():
            features, seen = self.residual.observe(observation, residual)
            decided = self.residual.set_action(seen, self.actor(features))
            residual = decided if due.all() else choose(due, decided, residual)
        force, residual = self.residual.control(observation, residual, signals.du)
        return force, PolicyState(residual, (state.since + 1) % self.residual.periods)

    def preview(self, state: Any, signals: _ResidualInput) -> dict[str, Array]:
        base = self.residual.base
        return base.preview(state.residual.base, base.read(signals.observation))

    def internals(self, state: Any) -> dict[str, Array]:
        return self.residual.base.internals(state.residual.base)

    def diagnostics(self, state: Any) -> dict[str, Array]:
        """Return the base's diagnostics, the agent's `action` and, on the biped, `gate`."""
        memory: PolicyState = state
        named = flatten(memory.residual.adapter)
        own = {f"agent_{name}": named[name] for name in ("action", "gate") if name in named}
        return {**self.residual.base.diagnostics(memory.residual.base), **own}


class _ResidualInput(NamedTuple):
    """The observation, and the du (..., n) of whoever uses a policy with a residual as a base."""

    observation: Array
    du: Array | None


class NoBase(Policy):
    """No controller: the residual is the force itself, from the middle of its range."""

    def __init__(self, interface: ControlInterface) -> None:
        super().__init__(NO_BASE, interface, None)
        self._rest = (self._low + self._high) / 2

    def read(self, observation: Array) -> Array:
        return np.broadcast_to(self._rest, (*observation.shape[:-1], len(self._rest))).astype(observation.dtype)

    def with_residual(self, signals: Array, du: Array) -> Array:
        return signals + du

    def start(self, signals: Array) -> LawState:
        return _Nothing()

    def step(self, state: Any, signals: Array, observation: Array) -> tuple[Array, LawState]:
        return signals, state


class _Nothing(NamedTuple):
    """The memory of no controller."""
