"""An agent on the joints of any robot: smooth, bounded accelerations on top of the base's.

    du = limit x action, through a critically damped filter of `FILTER_RATE`

Without a base, the action is the joints' force, from the middle of its range. The agent sees errors, rates and the
reference, the force that acted, and its action before. The reward is for small errors, and against force.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from artde_gym.layout import Field, Layout
from baselines.residual_config import NO_BASE, ResidualConfig
from controllers.laws.second_order import FilterState, second_order
from controllers.laws.tracking import Array
from controllers.policies import ControlInterface

FILTER_RATE = 50.0  # rad/s
ERROR = 0.05  # rad or m, of all joints together, at which the reward for tracking is 1/e
PASSED_ON = ("qd", "q_ref", "qd_ref", "qdd_ref", "tau_applied")
"""Fields of the observation that the agent sees as they are."""


class JointAdapterState(NamedTuple):
    """The action that acts (..., n), and the filter of the acceleration."""

    action: Array
    filter: FilterState


class JointAdapter:
    """The adapter at the top.

    Args:
        interface: of the environment, whose observation has the fields of `controllers.laws.tracking.JointInput`.
        config: of the residual.
        gains: of the base; not used.
    """

    reward_scales: Mapping[str, float] = {"tracking": 1.0, "effort": -0.1, "residual": -0.01}

    def __init__(self, interface: ControlInterface, config: ResidualConfig, gains: Any) -> None:
        del gains
        box, n = interface.action.box(), interface.action.size
        self._half = (box.high - box.low) / 2
        self._middle = (box.high + box.low) / 2
        self._limit = self._half if config.base == NO_BASE else np.full(n, config.action_scale)
        self._period = interface.control_period
        self._at = interface.observation.slices
        own = {field.name: field for field in interface.observation.fields}
        self.actions: tuple[str, ...] = tuple(f"u{i + 1}" for i in range(n))
        self.features = Layout(
            (
                Field("e", n, own["q"].unit, -3.2, 3.2, "q_ref - q"),
                Field("ed", n, own["qd"].unit, -50.0, 50.0, "qd_ref - qd"),
                *(own[name] for name in PASSED_ON),
                Field("action", n, "1", -1.0, 1.0, "of the agent, a decision ago"),
            )
        )

    def start(self, observation: Array) -> JointAdapterState:
        nothing = np.zeros((*observation.shape[:-1], len(self.actions)), observation.dtype)
        return JointAdapterState(nothing, FilterState(nothing, nothing))

    def observe(
        self, observation: Array, inside: Mapping[str, Array], state: JointAdapterState
    ) -> tuple[Array, JointAdapterState]:
        del inside
        at = self._at
        e = observation[..., at["q_ref"]] - observation[..., at["q"]]
        ed = observation[..., at["qd_ref"]] - observation[..., at["qd"]]
        parts = [e, ed, *(observation[..., at[name]] for name in PASSED_ON), state.action]
        return np.concatenate(parts, axis=-1, dtype=observation.dtype), state

    def set_action(self, state: JointAdapterState, action: Array) -> JointAdapterState:
        return state._replace(action=np.minimum(np.maximum(action, -1.0), 1.0).astype(state.action.dtype))

    def next_residual(self, state: JointAdapterState) -> tuple[Array, JointAdapterState]:
        after = second_order(state.filter, self._limit * state.action, FILTER_RATE, 1.0, self._period)
        return after.value.astype(state.action.dtype, copy=False), state._replace(filter=after)

    def reward_terms(self, observation: Array, state: JointAdapterState, fell: Any) -> dict[str, Array]:
        del fell
        at, action = self._at, state.action
        e = observation[..., at["q_ref"]] - observation[..., at["q"]]
        share = (observation[..., at["tau_applied"]] - self._middle) / self._half
        return {
            "tracking": np.exp(-np.sqrt(np.vecdot(e, e)) / ERROR),
            "effort": np.vecdot(share, share) / len(self.actions),
            "residual": np.vecdot(action, action),
        }
