"""`ArmTrack-Payload-v0` with many arms at once in MuJoCo."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np
from gymnasium.vector import AutoresetMode

from artde_gym.arguments import known_arguments
from artde_gym.arrays import Array, vectorize
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.effects import Effects
from artde_gym.disturbances.loads import RobotStates
from artde_gym.disturbances.schedule import NEVER
from artde_gym.disturbances.sensing import Sensing
from artde_gym.envs.arm import DEFAULT, DISTURBANCES
from artde_gym.envs.biped_disturbances import EpisodeDisturbances
from artde_gym.envs.documentation import filled
from artde_gym.envs.options import warn_of_idle
from artde_gym.envs.vector import BaseVectorEnv, Mask
from artde_gym.errors import OptionError
from artde_gym.multibody.manipulator import TOOL
from artde_gym.robots.arm import task
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reference import PICK
from artde_gym.sim.factory import make_batch

_PAGE = (
    task.DOCUMENTATION
    + """
| `num_envs` | 1 | from 1 | number of arms |
| `engine` | None | None, "mujoco" | physics engine; None warns if `gym.make` would use another one |
| `threads` | 1 | from 1 | number of threads that step the arms; results do not depend on it |
| `autoreset_mode` | "NextStep" | "NextStep", "SameStep", "Disabled" | Gymnasium's `AutoresetMode` |
| `max_episode_steps` | None | from 1 | steps after which an episode is truncated, if its duration is longer |
| `render_mode` | None | None | use `vectorization_mode="sync"` to render |

## Vectorization
For `gym.make_vec(..., vectorization_mode="vector_entry_point")`. Each arm has its own random generator and behaves
bitwise as in `gym.make(..., engine="mujoco")` with the same seed and actions, for any number of arms and threads.

## Info
As in the single environment, each entry `x` with a mask `_x` (n,)."""
)

_EXP = vectorize(math.exp)


@filled(shared=_PAGE.format(observation=task.observation_layout(panda()).table(), default=DEFAULT))
class ArmTrackVectorEnv(BaseVectorEnv):
    """Many arms follow a reference, as in `ArmTrackEnv`.

    {shared}

    ## Versions
    * v0: first version.
    """

    observation_layout = task.observation_layout(panda())
    action_layout = task.action_layout(panda())
    robot_name: ClassVar[str] = "arm"
    metrics_spec = task.metrics_spec(panda())
    reward_scales = task.REWARD_SCALES
    fall_reasons = task.FALL_REASONS
    allowed_action = "torques (Nm)"
    own_engine = "mujoco"

    @known_arguments
    def __init__(
        self,
        num_envs: int = 1,
        *,
        robot: str | os.PathLike[str] = "panda",
        tip: str | None = None,
        armature: float | Sequence[float] | None = None,
        joints: Sequence[str] | None = None,
        reference: Any = PICK,
        disturbances: Mapping[str, Any] | None = None,
        control_period: float = 0.001,
        duration: float = 12.0,
        engine: Literal["mujoco"] | None = None,
        threads: int = 1,
        render_mode: None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
    ) -> None:
        if isinstance(threads, bool) or not (isinstance(threads, int) and threads >= 1):
            raise OptionError("threads", threads, "a whole number >= 1")
        tracking = self._tracking = task.Tracking.of(robot, tip, armature, joints, reference, control_period, duration)
        spec = self.nominal_robot = tracking.nominal_robot
        self.observation_layout, self.action_layout = task.observation_layout(spec), task.action_layout(spec)
        self.metrics_spec = task.metrics_spec(spec)
        super().__init__(
            num_envs,
            engine=engine,
            render_mode=render_mode,
            autoreset_mode=autoreset_mode,
            max_episode_steps=max_episode_steps,
        )
        self.control_period, self.reference = tracking.control_period, reference
        self._last, self.words = min(tracking.last, self._limit or tracking.last), tracking.words
        self._disturbances = self._parse(DISTURBANCES if disturbances is None else disturbances)
        warn_of_idle(self._disturbances, self._last * self.control_period)
        self._batch = make_batch("mujoco", spec, num_envs, task.TIME_STEP, threads)
        self._limits, self._effort = task.Limits(spec), np.array(spec.torque_limits)
        self._columns = self.observation_layout.slices
        self._active: dict[int, EpisodeDisturbances] = {}
        self._next_event = np.full(num_envs, NEVER)  # time step of each arm's next disturbance event
        self._effects = Effects(num_envs, self.words)
        self._friction = np.ones((num_envs, 1))
        self._sensing: dict[int, Sensing] = {}  # arms with sensor errors
        self._readings: dict[int, Array] = {}  # their last measurements
        self._tau = self._previous = np.zeros((num_envs, tracking.n))

    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        return self._tracking.parse(disturbances)

    def _start(self, drawn: Mapping[int, Mapping[str, Any]]) -> None:
        tracking, self._tau = self._tracking, self._tau.copy()
        for i, sampled in drawn.items():
            world = self._batch.worlds[i]
            self._batch.reset(i, (0.0, 0.0, 0.0), tracking.pose(sampled))
            tracking.set_up(world, sampled)
            placed, generator = tracking.at_tool(sampled), self._np_random[i]
            active = self._active[i] = EpisodeDisturbances(placed, tracking, generator, self.observation_layout)
            active.start(world)
            self._effects.begin(i, sampled)
            self._friction[i] = task.friction_scale(sampled)
            self._next_event[i] = active.next_event_step(0)
            self._sensing.pop(i, None)
            if active.sensing is not None:
                self._sensing[i] = active.sensing
            self._tau[i] = tracking.balance(sampled)
            active.begin_walk(self._tau[i].copy())

    def _advance(self, commands: Array, goes_on: Mask) -> dict[int, list[str]]:
        if not goes_on.all():
            np.copyto(commands, self._tau, where=~goes_on[:, None])
        self._previous, self._tau = self._tau, commands
        steps, torques = self._tracking.substeps, commands.copy()
        awake = goes_on & (self._next_event < (self._k + 1) * steps)
        happening = [(i, self._active[i], int(self._k[i]) * steps) for i in np.flatnonzero(awake).tolist()]
        events: dict[int, list[str]] = {i: [] for i, _, _ in happening}
        for i, active, _ in happening:
            active.begin_period(commands[i].copy())
        for step in range(steps):
            for i, active, first in happening:
                torques[i] = active.apply(first + step, self._batch.worlds[i], events[i])
            self._step(self._acting(torques, goes_on, step), goes_on)
        for i, active, first in happening:
            commands[i] = active.applied()
            self._next_event[i] = active.next_event_step(first + steps)
        return {i: words for i, words in events.items() if words}

    def _acting(self, torques: Array, some: Mask, step: int) -> Array:
        """Return the torques with those of effects and friction added."""
        affected = some & self._effects.acting
        state = self._batch.state()
        with np.errstate(invalid="ignore", over="ignore"):  # of an arm that has diverged
            if affected.any():
                load = self._effects.load(self._states(self._k * self._tracking.substeps + step))
                if load.tau is not None:
                    torques = torques.copy()
                    torques[affected] += load.tau[affected]
            return torques + self._tracking.friction(self._friction, state.qd)

    def _states(self, steps: Any) -> RobotStates:
        """Return the states of all arms after `steps` (n,) time steps."""
        state = self._batch.state()
        of_base = (state.position, state.quat_xyzw, state.velocity, state.angular_velocity)
        base = (np.stack(parts, axis=1) for parts in of_base)
        return RobotStates(steps * task.TIME_STEP, state.q, state.qd, *base)

    def _step(self, torques: Array, some: Mask) -> None:
        if some.all():
            self._batch.step(torques)
        else:
            worlds = np.flatnonzero(some).astype(np.int32)
            self._batch.step(torques[worlds], worlds)

    def _truth(self) -> Array:
        state, columns = self._batch.state(), self._columns
        out = np.empty((self.num_envs, self.observation_layout.size))
        out[:, columns["q"]], out[:, columns["qd"]] = state.q, state.qd
        out[:, columns["q_ref"].start : columns["qdd_ref"].stop] = self._tracking.plan[self._k]
        out[:, columns["tau_applied"]] = self._tau
        out[:, columns["tool"]] = [world.site(TOOL) for world in self._batch.worlds]
        out[:, columns["tool_ref"]] = self._tracking.tool[self._k]
        return out

    def _measure(self, observations: Array, new: Mask) -> None:
        for i, sensing in self._sensing.items():
            if new[i]:
                self._readings[i] = sensing.disturb(observations[i]).copy()
            else:
                observations[i] = self._readings[i]

    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        columns, n = self._columns, len(self._effort)
        q, qd = truth[:, columns["q"]], truth[:, columns["qd"]]
        with np.errstate(invalid="ignore", over="ignore"):  # of an arm that has diverged
            error = truth[:, columns["q_ref"]] - q
            effort, change = self._tau / self._effort, (self._tau - self._previous) / self._effort
            squares = _square(error), _square(effort) / n, _square(change) / n
            return task.reward_terms(*squares, _EXP), self._limits.falls(q, qd)


def _square(vectors: Array) -> Array:
    """Return squared norms of vectors (n, size), summed in the same order as for a single vector."""
    return np.vecdot(vectors, vectors)
