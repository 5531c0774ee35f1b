"""Everything that `baselines` knows of a robot, as one frozen object that a plug-in brings."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from artde_gym.deprecation import renamed_arguments
from artde_gym.layout import Layout
from artde_gym.registry import Registry
from baselines.action_adapter import ActionAdapter
from baselines.task import Task

JOINTS = "joints"


@renamed_arguments({"coupling": "adapter", "channels": "action_modes", "hold": "decision_period"})
@dataclasses.dataclass(frozen=True)
class Agent:
    """Action, features and training tasks of a residual on one robot.

    Attributes:
        robot: by the environments' `robot_name`.
        adapter: called as adapter(interface, config, gains of the base); None for accelerations of the joints, see
            `baselines.joint_adapter`.
        action_modes: what an action may mean, each with its default limit of du (rad/s^2, m/s^2); the first one is the
            default.
        decision_period: default time between two decisions (s); 0 for the control periods that come nearest to 20 ms.
        tasks: by environment; any other environment has the task of `baselines.tasks.own_task`.
        balanced: channels for which the linear balance law (`cma-es`) has gains.
        observation, action: layouts of its environments, by which saved policies are read without one; without them,
            the environment of the training is built.
        observations: layouts of environments that observe more, by id.
        nominal: name in a policy's file -> builds the nominal robot.
        nominal_name: arguments of an environment -> name of its nominal robot in a policy's file.
    """

    robot: str
    adapter: Callable[[Any, Any, Any], ActionAdapter] | None = None
    action_modes: Mapping[str, float] = dataclasses.field(default_factory=lambda: {JOINTS: 25.0})
    decision_period: float = 0.0
    tasks: dict[str, Task] = dataclasses.field(default_factory=dict)
    balanced: frozenset[str] = frozenset()
    observation: Layout | None = None
    action: Layout | None = None
    observations: Mapping[str, Layout] = dataclasses.field(default_factory=dict)
    nominal: Mapping[str, Callable[[], Any]] = dataclasses.field(default_factory=dict)
    nominal_name: Callable[[Mapping[str, Any]], str] | None = None


AGENTS: Registry[Agent] = Registry("agent", "artde_gym.agents", lambda agent: {agent.robot: agent})
"""All of them by robot."""


def agent_of(robot: str) -> Agent:
    """Return what a robot brings; without, the residual on joint accelerations."""
    return AGENTS[robot] if robot in AGENTS else Agent(robot)
