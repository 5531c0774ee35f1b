"""Base class of environments with many robots at once in MuJoCo, whose actions are joint torques."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.effects import Effects, load_base
from artde_gym.disturbances.loads import RobotStates
from artde_gym.disturbances.schedule import NEVER
from artde_gym.disturbances.sensing import Sensing
from artde_gym.envs.joint_disturbances import EpisodeDisturbances
from artde_gym.envs.vector import BaseVectorEnv, Mask
from artde_gym.errors import OptionError
from artde_gym.robots.joint_task import TIME_STEP, JointTask
from artde_gym.sim.factory import make_batch

Task = TypeVar("Task", bound=JointTask)


class JointVectorEnv(BaseVectorEnv, Generic[Task]):
    """Many robots with joints: their disturbances, and the torques that act.

    Robots on which nothing acts but commanded torques advance by a control period at once.

    Args:
        task: what is the same in all episodes.
        num_envs: number of robots.
        disturbances: see `artde_gym.disturbances`; None for `default_disturbances`.
        threads: number of threads that step the robots.
        engine, render_mode, autoreset_mode, max_episode_steps: see `artde_gym.envs.vector.BaseVectorEnv`.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    allowed_action = "torques (Nm)"
    own_engine = "mujoco"

    def __init__(
        self,
        task: Task,
        num_envs: int,
        disturbances: Mapping[str, Any] | None,
        *,
        threads: int,
        engine: str | None,
        render_mode: None,
        autoreset_mode: AutoresetMode | str,
        max_episode_steps: int | None,
    ) -> None:
        if isinstance(threads, bool) or not (isinstance(threads, int) and threads >= 1):
            raise OptionError("threads", threads, "a whole number >= 1")
        super().__init__(
            num_envs,
            engine=engine,
            render_mode=render_mode,
            autoreset_mode=autoreset_mode,
            max_episode_steps=max_episode_steps,
        )
        self._task, self.nominal_robot, self.words = task, task.nominal_robot, task.words
        self.control_period = task.control_period
        self._set_episodes(task.last, disturbances)
        self._batch = make_batch(self.own_engine, task.robot, num_envs, TIME_STEP, threads)
        self._active: dict[int, EpisodeDisturbances] = {}
        self._next_event = np.full(num_envs, NEVER)  # time step of each robot's next disturbance event
        self._effects = Effects(num_envs, self.words)
        self._sensing: dict[int, Sensing] = {}  # robots with sensor errors
        self._readings: dict[int, Array] = {}  # their last measurements
        self._tau = self._previous = np.zeros((num_envs, task.n))

    @abc.abstractmethod
    def _place(self, robots: Mapping[int, Mapping[str, Any]]) -> None:
        """Set up some robots at the start with sampled disturbances, except for what acts during the episode."""

    @abc.abstractmethod
    def _rest(self, robots: Mapping[int, Mapping[str, Any]]) -> None:
        """Let some robots come to rest, and set the torques that act at the start."""

    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        return self._task.parse(disturbances)

    def _start(self, drawn: Mapping[int, Mapping[str, Any]]) -> None:
        self._place(drawn)
        for i, sampled in drawn.items():
            placed, generator = self._task.placed(sampled), self._np_random[i]
            active = self._active[i] = EpisodeDisturbances(placed, self._task, generator, self.observation_layout)
            active.start(self._batch.worlds[i])
            self._effects.begin(i, sampled)
            self._next_event[i] = active.next_event_step(0)
            self._sensing.pop(i, None)
            if active.sensing is not None:
                self._sensing[i] = active.sensing
        self._tau = self._tau.copy()
        self._rest(drawn)
        for i in drawn:
            self._active[i].begin_walk(self._tau[i].copy())

    def _advance(self, commands: Array, goes_on: Mask) -> dict[int, list[str]]:
        if not goes_on.all():
            np.copyto(commands, self._tau, where=~goes_on[:, None])
        self._previous, self._tau = self._tau, commands
        steps = self._task.substeps
        awake = goes_on & (self._next_event < (self._k + 1) * steps)
        busy = awake | (goes_on & self._affected())
        if not busy.any():
            self._step(commands, goes_on, steps)
            return {}
        if steps > 1:
            self._step(commands, goes_on & ~busy, steps)
        return self._disturbed(commands, awake, goes_on if steps == 1 else busy)

    def _affected(self) -> Mask:
        """Return the robots on which anything acts that depends on their state."""
        return self._effects.acting

    def _disturbed(self, commands: Array, awake: Mask, some: Mask) -> dict[int, list[str]]:
        """Advance `some` robots by a control period in which disturbances act on those in `awake`.

        The torques that act on these replace the commanded ones. Return the events.
        """
        steps, torques = self._task.substeps, commands.copy()
        happening = [(i, self._active[i], int(self._k[i]) * steps) for i in np.flatnonzero(awake).tolist()]
        events: dict[int, list[str]] = {i: [] for i, _, _ in happening}
        for i, active, _ in happening:
            active.begin_period(commands[i].copy())
        for step in range(steps):
            for i, active, first in happening:
                torques[i] = active.apply(first + step, self._batch.worlds[i], events[i])
            self._step(self._acting(torques, some, step), some, 1)
        for i, active, first in happening:
            commands[i] = active.applied()
            self._next_event[i] = active.next_event_step(first + steps)
        return {i: words for i, words in events.items() if words}

    def _acting(self, torques: Array, some: Mask, step: int) -> Array:
        """Return the torques that act on `some` robots in a step of the control period, and apply other loads."""
        acting = some & self._effects.acting
        if not acting.any():
            return torques
        load = self._effects.load(self._states(self._k * self._task.substeps + step))
        for i in np.flatnonzero(acting).tolist():
            load_base(self._batch.worlds[i], load, i)
        if load.tau is not None:
            torques = torques.copy()
            torques[acting] += load.tau[acting]
        return torques

    def _states(self, steps: NDArray[np.int64]) -> RobotStates:
        """Return the states of all robots after `steps` (n,) time steps."""
        with np.errstate(invalid="ignore", over="ignore"):  # of a robot that has diverged
            state = self._batch.state()
        of_base = (state.position, state.quat_xyzw, state.velocity, state.angular_velocity)
        base = (np.stack(parts, axis=1) for parts in of_base)
        return RobotStates(steps * TIME_STEP, state.q, state.qd, *base)

    def _step(self, torques: Array, some: Mask, steps: int) -> None:
        """Advance some robots by `steps` time steps under their rows of `torques`."""
        if some.all():
            self._batch.step(torques, steps=steps)
        else:
            worlds = np.flatnonzero(some).astype(np.int32)
            self._batch.step(torques[worlds], worlds, steps)

    def _measure(self, observations: Array, new: Mask) -> None:
        for i, sensing in self._sensing.items():
            if new[i]:
                self._readings[i] = sensing.disturb(observations[i]).copy()
            else:
                observations[i] = self._readings[i]


def square(vectors: Array) -> Array:
    """Return squared norms of vectors (n, size), summed in the same order as for a single vector."""
    return np.vecdot(vectors, vectors)
