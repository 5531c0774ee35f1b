"""A base controller with a residual on top: what training environments and trained policies share.

An agent decides every `Recipe.hold` seconds, on features of the observation and of the base; its action becomes an
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
from baselines.joint_coupling import JointCoupling
from baselines.recipe import NO_BASE, Recipe
from controllers.laws.tracking import Array, Memory
from controllers.policies import Plant, Policy, choose, flatten


class ResidualMemory(NamedTuple):
    """Of the base and of the coupling."""

    base: Any
    coupling: Any


class Residual:
    """A recipe at work on a plant.

    Args:
        plant: of the environment.
        base: the recipe's base controller for it.
        recipe: of the residual.

    Attributes:
        features: what the agent sees.
        actions: names of its action's components.
        periods: control periods between two decisions.

    Raises:
        OptionError: if the recipe is another robot's, or its decisions do not fall on control periods.
    """

    def __init__(self, plant: Plant, base: Policy, recipe: Recipe) -> None:
        self.base = base
        self.periods = recipe.periods(plant.control_period)
        self.recipe = recipe if recipe.hold else dataclasses.replace(recipe, hold=self.periods * plant.control_period)
        self.coupling = (agent_of(plant.robot).coupling or JointCoupling)(plant, self.recipe, base.gains)
        self.features, self.actions = self.coupling.features, self.coupling.actions

    @classmethod
    def of(cls, env: Any, recipe: Recipe) -> Residual:
        """For an environment, or anything else that `Plant.of` reads."""
        plant = Plant.of(env)
        base = NoBase(plant) if recipe.base == NO_BASE else make_controller(recipe.base, env, **recipe.gains)
        return cls(plant, base, recipe)

    def start(self, observation: Array) -> ResidualMemory:
        """Memory at the start of an episode."""
        return ResidualMemory(self.base.start(self.base.read(observation)), self.coupling.start(observation))

    def observe(self, observation: Array, memory: ResidualMemory) -> tuple[Array, ResidualMemory]:
        """What the agent sees (..., n_features), and memory."""
        inside = {
            **self.base.remembered(memory.base),
            **self.base.upcoming(memory.base, self.base.read(observation)),
        }
        features, coupling = self.coupling.observe(observation, inside, memory.coupling)
        return features, memory._replace(coupling=coupling)

    def decide(self, memory: ResidualMemory, action: Array) -> ResidualMemory:
        """Memory with a new action (..., n_actions)."""
        return memory._replace(coupling=self.coupling.decide(memory.coupling, action))

    def control(
        self, observation: Array, memory: ResidualMemory, more: Array | None = None
    ) -> tuple[Array, ResidualMemory]:
        """The force for one control period, within the actuators' bounds, and memory; `more` is added to du."""
        du, coupling = self.coupling.advance(memory.coupling)
        if more is not None:
            du = du + more
        force, base = self.base.predict(observation, memory.base, residual=du)
        return force, ResidualMemory(base, coupling)


class PolicyMemory(NamedTuple):
    """Of the residual, and the control periods since the last decision (...)."""

    residual: ResidualMemory
    since: NDArray[np.int64]


class ResidualPolicy(Policy):
    """A residual with an actor, as a policy of the environment: judged like any other controller, or a base itself.

    Args:
        name: under which results are listed.
        plant: of the environment.
        residual: what the actor acts through.
        actor: features (..., n_features) -> action (..., n_actions).
    """

    def __init__(self, name: str, plant: Plant, residual: Residual, actor: Callable[[Array], Array]) -> None:
        super().__init__(name, plant, residual.base.gains)
        self.residual, self.actor = residual, actor

    @functools.cached_property
    def identity(self) -> str | None:
        """Hash of the recipe and of what was learned; None if the actor does not tell what that is."""
        try:
            return digest([self.name, self.residual.recipe, self.actor])
        except TypeError:
            return None

    def read(self, observation: Array) -> _Signals:
        return _Signals(observation, None)

    def accelerated(self, signals: _Signals, du: Array) -> _Signals:
        return signals._replace(du=du)

    def start(self, signals: _Signals) -> Memory:
        observation = signals.observation
        return PolicyMemory(self.residual.start(observation), np.zeros(observation.shape[:-1], np.int64))

    def step(self, memory: Any, signals: _Signals, observation: Array) -> tuple[Array, Memory]:
        residual, due = memory.residual, memory.since == 0
        if due.any():
            features, seen = self.residual.observe(observation, residual)
            decided = self.residual.decide(seen, self.actor(features))
            residual = decided if due.all() else choose(due, decided, residual)
        force, residual = self.residual.control(observation, residual, signals.du)
        return force, PolicyMemory(residual, (memory.since + 1) % self.residual.periods)

    def upcoming(self, state: Any, signals: _Signals) -> dict[str, Array]:
        base = self.residual.base
        return base.upcoming(state.residual.base, base.read(signals.observation))

    def remembered(self, state: Any) -> dict[str, Array]:
        return self.residual.base.remembered(state.residual.base)

    def diagnostics(self, state: Any) -> dict[str, Array]:
        """What the base tells, and the agent's `action` and, on the biped, `gate`."""
        memory: PolicyMemory = state
        named = flatten(memory.residual.coupling)
        own = {f"agent_{name}": named[name] for name in ("action", "gate") if name in named}
        return {**self.residual.base.diagnostics(memory.residual.base), **own}


class _Signals(NamedTuple):
    """The observation, and the du (..., n) of whoever uses a policy with a residual as a base."""

    observation: Array
    du: Array | None


class NoBase(Policy):
    """No controller: the residual is the force itself, from the middle of its range."""

    def __init__(self, plant: Plant) -> None:
        super().__init__(NO_BASE, plant, None)
        self._rest = (self._low + self._high) / 2

    def read(self, observation: Array) -> Array:
        return np.broadcast_to(self._rest, (*observation.shape[:-1], len(self._rest))).astype(observation.dtype)

    def accelerated(self, signals: Array, du: Array) -> Array:
        return signals + du

    def start(self, signals: Array) -> Memory:
        return _Nothing()

    def step(self, memory: Any, signals: Array, observation: Array) -> tuple[Array, Memory]:
        return signals, memory


class _Nothing(NamedTuple):
    """The memory of no controller."""
