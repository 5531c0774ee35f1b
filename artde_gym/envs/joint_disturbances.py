"""Disturbances of one episode of a robot with joints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances.actuation import Actuation
from artde_gym.disturbances.schedule import Schedule
from artde_gym.disturbances.sensing import Sensing
from artde_gym.layout import Layout
from artde_gym.robots.joint_task import TIME_STEP, JointTask
from artde_gym.sim.engine import World


class EpisodeDisturbances:
    """The disturbances of one episode.

    Call `start`, `begin_walk`, then `begin_period` and `apply` at each step of every control period.

    Args:
        sampled: sampled disturbances.
        task: the disturbed task.
        rng: generator of the environment.
        layout: layout of the observation.

    Attributes:
        schedule: schedule of pushes and the payload.
        sensing: disturbances of the observations; None without any.
    """

    def __init__(self, sampled: Mapping[str, Any], task: JointTask, rng: np.random.Generator, layout: Layout) -> None:
        kinds = sampled.keys()
        self.schedule = Schedule(sampled, TIME_STEP)
        joints = task.nominal_robot.actuated
        self._actuation = None if kinds.isdisjoint(Actuation.KINDS) else Actuation(sampled, joints, TIME_STEP)
        self.sensing = None if kinds.isdisjoint(Sensing.KINDS) else Sensing(sampled, layout, task.control_period, rng)
        self._target = self._total = np.zeros(len(joints))
        self._substeps = task.substeps

    def start(self, world: World) -> None:
        """Apply the disturbances that act while the robot settles."""
        self.schedule.start(world)

    def begin_walk(self, tau: Array) -> None:
        """Begin the walk with torques `tau` (n,) (Nm)."""
        if self._actuation is not None:
            self._actuation.start(tau)

    def next_event_step(self, step: int) -> int:
        """Return the first time step from `step` on in which anything but the commanded torques acts."""
        return step if self._actuation is not None else self.schedule.next(step)

    def begin_period(self, command: Array) -> None:
        """Begin a control period with torques `command` (n,) (Nm) within their bounds."""
        self._target = command if self._actuation is None else self._actuation.target(command)
        self._total = 0.0

    def apply(self, step: int, world: World, events: list[str]) -> Array:
        """Disturb a world for a time step; return the torques (n,) (Nm) that act and append to `events`."""
        events += self.schedule.apply(step, world)
        if self._actuation is None:
            return self._target
        applied = self._actuation.advance(self._target, step)
        self._total = self._total + applied
        return applied

    def applied(self) -> Array:
        """Return the mean torques (n,) (Nm) of the control period, which match its mean acceleration."""
        return self._target if self._actuation is None else np.asarray(self._total / self._substeps)
