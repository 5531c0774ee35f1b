"""An agent on an arm: accelerations of the joints on top of the base's, rewarded for the tool's place.

The channel is that of `baselines.joint_adapter`. The agent sees the tool's error and the TDE error, too, in which a
push and a payload show at once. Errors of a millimeter and of a hundredth of one both count: the reward for the tool
falls with the root of its error.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.layout import Field, Layout
from baselines.agent import Agent
from baselines.arm_tasks import TASKS
from baselines.joint_adapter import JointAdapter, JointAdapterState
from baselines.residual_config import ResidualConfig
from controllers.laws.tracking import Array
from controllers.policies import ControlInterface

ERROR = 0.001  # m, of the tool, at which the reward for it is 1/e


class ArmAdapter(JointAdapter):
    """The adapter at the top.

    Args:
        interface: of the environment.
        config: of the residual.
        gains: of the base; not used.
    """

    reward_scales: Mapping[str, float] = {"tool": 1.0, "residual": -0.01, "fall": -50.0}

    def __init__(self, interface: ControlInterface, config: ResidualConfig, gains: Any) -> None:
        super().__init__(interface, config, gains)
        n = len(self.actions)
        self.features = Layout(
            (
                *self.features.fields,
                Field("tool_error", 3, "m", -1.0, 1.0, "of the tool, reference minus actual"),
                Field("sigma", n, "rad/s^2", -1e5, 1e5, "TDE error, a sample ago"),
            )
        )

    def observe(
        self, observation: Array, inside: Mapping[str, Array], state: JointAdapterState
    ) -> tuple[Array, JointAdapterState]:
        seen, state = super().observe(observation, inside, state)
        sigma = inside.get("sigma")
        parts = [seen, self._tool_error(observation), np.zeros_like(state.action) if sigma is None else sigma]
        return np.concatenate(parts, axis=-1, dtype=observation.dtype), state

    def reward_terms(self, observation: Array, state: JointAdapterState, fell: Any) -> dict[str, Array]:
        error = self._tool_error(observation)
        return {
            "tool": np.exp(-np.sqrt(np.sqrt(np.vecdot(error, error)) / ERROR)),
            "residual": np.vecdot(state.action, state.action),
            "fall": np.asarray(fell, dtype=np.float64),
        }

    def _tool_error(self, observation: Array) -> Array:
        return observation[..., self._at["tool_ref"]] - observation[..., self._at["tool"]]


AGENT = Agent(robot="arm", adapter=ArmAdapter, tasks=TASKS)
