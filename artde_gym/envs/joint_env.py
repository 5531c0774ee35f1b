"""Base class of single environments whose actions are joint torques."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.effects import Effects
from artde_gym.envs.engine_env import EngineEnv
from artde_gym.envs.joint_disturbances import EpisodeDisturbances
from artde_gym.robots.joint_task import TIME_STEP, JointTask
from artde_gym.sim.engine import Camera
from artde_gym.sim.factory import EngineName

Task = TypeVar("Task", bound=JointTask)


class JointEnv(EngineEnv, Generic[Task]):
    """An environment of a robot with joints: its disturbances, and the torques that act.

    Args:
        task: what is the same in all episodes.
        disturbances, render_mode: see `artde_gym.envs.single.BaseEnv`.
        engine: physics engine; None for the default.
        camera: initial pose of the camera.
        slack: see `artde_gym.envs.view.View`.
    """

    time_step = TIME_STEP
    allowed_action = "torques (Nm)"

    def __init__(
        self,
        task: Task,
        disturbances: Mapping[str, Any] | None,
        *,
        engine: EngineName | None,
        camera: Camera,
        slack: float = 0.0,
        render_mode: str | None,
    ) -> None:
        self._task, self.nominal_robot, self.words = task, task.nominal_robot, task.words
        super().__init__(
            disturbances,
            control_period=task.control_period,
            substeps=task.substeps,
            last=task.last,
            render_mode=render_mode,
        )
        self._open(engine, task.robot, camera, slack=slack)
        self._active = EpisodeDisturbances({}, task, self.np_random, self.observation_layout)
        self._effects = Effects(1, self.words)
        self._loaded = False
        self._tau = self._previous = np.zeros(task.n)

    @abc.abstractmethod
    def _place(self, sampled: Mapping[str, Any]) -> None:
        """Set up the robot at the start, except for what acts during the episode."""

    @abc.abstractmethod
    def _rest(self, sampled: Mapping[str, Any]) -> Array:
        """Let the robot come to rest; return the torques (n,) that act at the start."""

    @abc.abstractmethod
    def _observation(self) -> Array:
        """Read the engine and return the observation without sensor errors."""

    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        return self._task.parse(disturbances)

    def _mounted(self, sampled: Mapping[str, Any]) -> Mapping[str, Any]:
        return self._task.placed(sampled)

    def _begin(self, sampled: Mapping[str, Any]) -> None:
        self._place(sampled)
        placed = self._mounted(sampled)
        self._active = EpisodeDisturbances(placed, self._task, self.np_random, self.observation_layout)
        self._active.start(self._engine)
        self.schedule = self._active.schedule
        self._effects.begin(0, sampled)
        self._loaded = self._is_loaded()
        self._tau = self._rest(sampled)
        self._active.begin_walk(self._tau)

    def _simulate(self, command: Array) -> list[str]:
        engine, active, events = self._engine, self._active, []
        first = self.elapsed
        end = first + self._substeps
        active.begin_period(command)
        quiet = active.next_event_step(first) >= end
        for step in range(first, end):
            tau = command if quiet else active.apply(step, engine, events)
            engine.step(self._acting(tau, step) if self._loaded else tau)
        self._previous, self._tau = self._tau, active.applied()
        return events

    def _is_loaded(self) -> bool:
        """Return True if other torques than those of the motors can act in this episode."""
        return bool(self._effects.acting[0])

    def _acting(self, tau: Array, step: int) -> Array:
        """Return the torques (n,) that act in a time step: those of the motors, and what is added to them."""
        if not self._effects.acting[0]:
            return tau
        return tau + self._effects.apply(self._engine, self._engine.state(), step * TIME_STEP)

    def _measure(self) -> Array:
        observation, sensing = self._observation(), self._active.sensing
        return observation if sensing is None else sensing.disturb(observation)
