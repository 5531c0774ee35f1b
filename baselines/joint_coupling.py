"""An agent on the joints of any robot: smooth, bounded accelerations on top of the base's.

    du = limit x action, through a critically damped filter of `FILTER_RATE`

Without a base, the action is the joints' force, from the middle of its range. The agent sees errors, rates and the
reference, the force that acted, and its action before. The reward is for small errors, and against force.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np

from artde_gym.layout import Field, Layout
from baselines.recipe import NO_BASE, Recipe
from controllers.laws.second_order import FilterMemory, second_order
from controllers.laws.tracking import Array
from controllers.policies import Plant

FILTER_RATE = 50.0  # rad/s
ERROR = 0.05  # rad or m, of all joints together, at which the reward for tracking is 1/e
PASSED_ON = ("qd", "q_ref", "qd_ref", "qdd_ref", "tau_applied")
"""Fields of the observation that the agent sees as they are."""


class JointMemory(NamedTuple):
    """The action that acts (..., n), and the filter of the acceleration."""

    action: Array
    filter: FilterMemory


class JointCoupling:
    """The coupling at the top.

    Args:
        plant: of the environment, whose observation has the fields of `controllers.laws.tracking.Signals`.
        recipe: of the residual.
        gains: of the base; not used.
    """

    reward_scales: ClassVar[Mapping[str, float]] = {"tracking": 1.0, "effort": -0.1, "residual": -0.01}

    def __init__(self, plant: Plant, recipe: Recipe, gains: Any) -> None:
        del gains
        box, n = plant.action.box(), plant.action.size
        self._half = (box.high - box.low) / 2
        self._middle = (box.high + box.low) / 2
        self._limit = self._half if recipe.base == NO_BASE else np.full(n, recipe.limit)
        self._period = plant.control_period
        self._at = plant.observation.slices
        own = {field.name: field for field in plant.observation.fields}
        self.actions: tuple[str, ...] = tuple(f"u{i + 1}" for i in range(n))
        self.features = Layout(
            (
                Field("e", n, own["q"].unit, -3.2, 3.2, "q_ref - q"),
                Field("ed", n, own["qd"].unit, -50.0, 50.0, "qd_ref - qd"),
                *(own[name] for name in PASSED_ON),
                Field("action", n, "1", -1.0, 1.0, "of the agent, a decision ago"),
            )
        )

    def start(self, observation: Array) -> JointMemory:
        nothing = np.zeros((*observation.shape[:-1], len(self.actions)), observation.dtype)
        return JointMemory(nothing, FilterMemory(nothing, nothing))

    def observe(
        self, observation: Array, inside: Mapping[str, Array], memory: JointMemory
    ) -> tuple[Array, JointMemory]:
        del inside
        at = self._at
        e = observation[..., at["q_ref"]] - observation[..., at["q"]]
        ed = observation[..., at["qd_ref"]] - observation[..., at["qd"]]
        parts = [e, ed, *(observation[..., at[name]] for name in PASSED_ON), memory.action]
        return np.concatenate(parts, axis=-1, dtype=observation.dtype), memory

    def decide(self, memory: JointMemory, action: Array) -> JointMemory:
        return memory._replace(action=np.minimum(np.maximum(action, -1.0), 1.0).astype(memory.action.dtype))

    def advance(self, memory: JointMemory) -> tuple[Array, JointMemory]:
        after = second_order(memory.filter, self._limit * memory.action, FILTER_RATE, 1.0, self._period)
        return after.value.astype(memory.action.dtype, copy=False), memory._replace(filter=after)

    def reward_terms(self, observation: Array, memory: JointMemory, fell: Any) -> dict[str, Array]:
        del fell
        at, action = self._at, memory.action
        e = observation[..., at["q_ref"]] - observation[..., at["q"]]
        share = (observation[..., at["tau_applied"]] - self._middle) / self._half
        return {
            "tracking": np.exp(-np.sqrt(np.vecdot(e, e)) / ERROR),
            "effort": np.vecdot(share, share) / len(self.actions),
            "residual": np.vecdot(action, action),
        }
