"""What disturbs one walk, from its beginning to its end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances.actuation import Actuation
from artde_gym.disturbances.schedule import Schedule
from artde_gym.disturbances.sensing import Sensing
from artde_gym.robots.ojas.task import OBSERVATION, TIME_STEP, Walk
from artde_gym.sim.engine import World


class EpisodeDisturbances:
    """The disturbances of one episode: `start`, `begin_walk`, then `begin_period` and the steps of each control period.

    Args:
        sampled: drawn disturbances.
        walk: that they disturb.
        rng: of the environment.

    Attributes:
        schedule: of pushes and the payload.
        sensing: of observations; None without any.
    """

    def __init__(self, sampled: Mapping[str, Any], walk: Walk, rng: np.random.Generator) -> None:
        kinds = sampled.keys()
        self.schedule = Schedule(sampled, TIME_STEP)
        joints = walk.nominal_robot.actuated
        self._actuation = None if kinds.isdisjoint(Actuation.KINDS) else Actuation(sampled, joints, TIME_STEP)
        self.sensing = (
            None if kinds.isdisjoint(Sensing.KINDS) else Sensing(sampled, OBSERVATION, walk.control_period, rng)
        )
        self._target = self._total = np.zeros(len(joints))
        self._substeps = walk.substeps

    def start(self, world: World) -> None:
        """Bring about what is there while the robot settles."""
        self.schedule.start(world)

    def begin_walk(self, tau: Array) -> None:
        """The walk begins, with torques `tau` (n,) (Nm)."""
        if self._actuation is not None:
            self._actuation.start(tau)

    def next_event_step(self, step: int) -> int:
        """The first time step from `step` on in which commanded torques are not all that happens."""
        return step if self._actuation is not None else self.schedule.next(step)

    def begin_period(self, command: Array) -> None:
        """A control period begins with torques `command` (n,) (Nm) within their bounds."""
        self._target = command if self._actuation is None else self._actuation.target(command)
        self._total = 0.0

    def apply(self, step: int, world: World, events: list[str]) -> Array:
        """Disturb a world for a time step; returns the torques (n,) (Nm) that act, and adds to `events`."""
        events += self.schedule.apply(step, world)
        if self._actuation is None:
            return self._target
        applied = self._actuation.advance(self._target, step)
        self._total = self._total + applied
        return applied

    def applied(self) -> Array:
        """Mean torques (n,) (Nm) of the control period: they belong to its mean acceleration."""
        return self._target if self._actuation is None else np.asarray(self._total / self._substeps)
