"""`ArmTrack-Payload-v0`: torques of an arm's joints follow a given reference."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import action_array, check_seed, known_arguments
from artde_gym.arrays import Array, total
from artde_gym.disturbances.effects import Effects
from artde_gym.disturbances.schedule import Schedule
from artde_gym.envs.biped_disturbances import EpisodeDisturbances
from artde_gym.envs.closed_env import CLOSED
from artde_gym.envs.documentation import filled
from artde_gym.envs.interactive import InteractiveMixin
from artde_gym.envs.options import disturbances_in, warn_of_idle
from artde_gym.envs.view import View
from artde_gym.errors import OptionError
from artde_gym.motion.motion import Pose
from artde_gym.multibody.manipulator import TOOL
from artde_gym.robots.arm import task
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reference import GRASP, PICK, RELEASE
from artde_gym.robots.arm.scene import frame_angles
from artde_gym.sim.engine import Camera, Engine
from artde_gym.sim.factory import EngineName, make_engine, resolve_engine

CAMERA_HEIGHT, CAMERA_DISTANCE = 0.45, 2.2  # m

DISTURBANCES: dict[str, Any] = {"payload": {"mass": 1.5, "attach_time": GRASP, "detach_time": RELEASE}}
DEFAULT = "payload of 1.5 kg from 4 s to 8 s"

_PAGE = (
    task.DOCUMENTATION
    + """
| `engine` | None | "bullet", "mujoco", None | physics engine; None: Bullet where it can be imported, else MuJoCo |
| `width`, `height` | 640, 480 | 16 to 4096 | pixels of a picture |

With `render_mode="rgb_array"`, `render` draws 30 frames per simulated second and returns the last one again in between.

`reset(options={{"disturbances": ..., "scenario": "A2"}})` overrides the disturbances of this and the following
episodes with a mapping or with those of a scenario. Nothing is merged: a mapping has to list every disturbance.

## Info
Only numbers and arrays, with the same keys after `reset` and `step` (`artde_gym.info`): `time_s`; the terms of the
reward (`reward_alive`, ...); the sampled disturbances (`disturbance.payload.mass`, ...); the number of pushes and
payloads that began and ended in this control period (`push_begins`, `push_ends`, `payload_attached`,
`payload_dropped`); the reason for an early end (`fell_position`, `fell_speed`, true or false)."""
)


@filled(shared=_PAGE.format(observation=task.observation_layout(panda()).table(), default=DEFAULT))
class ArmTrackEnv(InteractiveMixin, gym.Env[NDArray[Any], NDArray[Any]]):
    """An arm on a fixed base follows a reference of its joints; a payload is grasped and released on the way.

    ## Description
    The policy commands the torques of all joints. It does not observe payload, pushes and friction.

    {shared}

    ## Versions
    * v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    observation_layout = task.observation_layout(panda())
    action_layout = task.action_layout(panda())
    robot_name: ClassVar[str] = "arm"
    metrics_spec = task.metrics_spec(panda())
    fall_reasons: ClassVar[Sequence[str]] = task.FALL_REASONS

    @known_arguments
    def __init__(
        self,
        *,
        robot: str | os.PathLike[str] = "panda",
        tip: str | None = None,
        armature: float | Sequence[float] | None = None,
        joints: Sequence[str] | None = None,
        reference: Any = PICK,
        disturbances: Mapping[str, Any] | None = None,
        control_period: float = 0.001,
        duration: float = 12.0,
        engine: EngineName | None = None,
        width: int = 640,
        height: int = 480,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise OptionError("render_mode", render_mode, "None, 'rgb_array'")
        self.render_mode = render_mode
        tracking = self._tracking = task.Tracking.of(robot, tip, armature, joints, reference, control_period, duration)
        spec = self.nominal_robot = tracking.nominal_robot
        self.control_period, self.reference = tracking.control_period, reference
        self._disturbances = tracking.parse(DISTURBANCES if disturbances is None else disturbances)
        self.engine_name = resolve_engine(engine)
        self._engine: Engine = make_engine(self.engine_name, spec, task.TIME_STEP, renders=render_mode is not None)
        camera = Camera((0.0, 0.0, CAMERA_HEIGHT), distance=CAMERA_DISTANCE, width=width, height=height)
        self.view = View(self._engine, camera, self.control_period, share=1.0, slack=0.0)
        self.metadata = {**self.metadata, **self.view.metadata}
        self.observation_layout, self.action_layout = task.observation_layout(spec), task.action_layout(spec)
        self.metrics_spec = task.metrics_spec(spec)
        self.observation_space, self.action_space = self.observation_layout.box(), self.action_layout.box()
        self._limit = np.array(spec.torque_limits)
        self._limits, self._frames = task.Limits(spec), frame_angles(spec)
        self._k, self._last, self._over = 0, tracking.last, True  # no step before the first reset
        self.words = tracking.words
        self._sample({})
        warn_of_idle(self._disturbances, self._last * self.control_period)
        self._active = EpisodeDisturbances({}, tracking, self.np_random, self.observation_layout)
        self._effects = Effects(1, self.words)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Start an episode; the class' documentation lists the `options`.

        Raises:
            OptionError: for an unknown option, or a scenario of another environment.
            DisturbanceError: for a malformed disturbance.
        """
        self._require_open()
        disturbances = disturbances_in(options or {}, self)
        if disturbances is not None:
            self._disturbances = self._tracking.parse(disturbances)
            warn_of_idle(self._disturbances, self._last * self.control_period)
        super().reset(seed=check_seed("seed", seed))
        sampled = self._disturbances.sample(self.np_random)
        self._sample(sampled)
        self._begin(sampled)
        self._k, self._over = 0, False
        self.view.reset()
        return self._measure(), self._info(dict.fromkeys(task.REWARD_SCALES, 0.0), (), ())

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply joint torques for one control period.

        Raises:
            ActionError: for a wrong shape or a value that is not finite.
            gymnasium.error.ResetNeeded: after the end of the episode, or before the first reset.
        """
        self._require_open()
        if self._over:
            raise gym.error.ResetNeeded("the episode is over or has not begun: call reset()")
        action = action_array(action, len(self._limit), "torques (Nm)")
        previous = self._tau
        events = self._simulate(np.minimum(np.maximum(action, -self._limit), self._limit))
        self._k += 1
        observation = self._measure()
        terms = self._reward_terms(previous)
        reward = self.control_period * total(map(operator.mul, task.REWARD_SCALES.values(), terms.values()))
        falls = tuple(map(bool, self._limits.falls(self._state.q, self._state.qd)))
        fell, truncated = any(falls), self._k >= self._last
        self._over = fell or truncated
        return observation, reward, fell, truncated, self._info(terms, falls, events)

    def render(self) -> NDArray[np.uint8] | None:
        """Draw a frame from a fixed camera; return None without a render mode."""
        self._require_open()
        if self.render_mode is None:
            return None
        step = self.elapsed
        pushes, time = self.schedule.acting(step), step * task.TIME_STEP
        path = self._tracking.tool[:: max(1, self._last // 300)]
        return self.view.picture(time, (0.0, 0.0, 0.0), pushes, self._sampled, path=path, over=self._over)

    def close(self) -> None:
        self._engine.close()
        self._engine = self.view = CLOSED

    def pose(self) -> Pose:
        """Read where arm and payload are; joints as `artde_gym.robots.arm.scene` counts them."""
        pose = super().pose()
        return pose._replace(q=np.concatenate([pose.q, self._frames]))

    @property
    def elapsed(self) -> int:
        return self._k * self._tracking.substeps

    @property
    def schedule(self) -> Schedule:
        return self._active.schedule

    def _begin(self, sampled: Mapping[str, Any]) -> None:
        """Set up an episode in equilibrium."""
        tracking = self._tracking
        self._engine.reset((0.0, 0.0, 0.0), tracking.pose(sampled))
        tracking.set_up(self._engine, sampled)
        placed = tracking.at_tool(sampled)
        self._active = EpisodeDisturbances(placed, tracking, self.np_random, self.observation_layout)
        self._active.start(self._engine)
        self._effects.begin(0, sampled)
        self._friction = task.friction_scale(sampled)
        self._tau = tracking.balance(sampled)
        self._active.begin_walk(self._tau)

    def _simulate(self, command: Array) -> list[str]:
        """Apply `command`, friction and the disturbances for one control period; return the events."""
        engine, active, tracking = self._engine, self._active, self._tracking
        events: list[str] = []
        first, affected = self.elapsed, self._effects.acting[0]
        active.begin_period(command)
        state = self._state
        for step in range(first, first + tracking.substeps):
            tau = active.apply(step, engine, events)
            if step > first:
                state = engine.state()
            if affected:
                tau = tau + self._effects.apply(engine, state, step * task.TIME_STEP)
            engine.step(tau + tracking.friction(self._friction, state.qd))
        self._tau = active.applied()
        return events

    def _info(self, terms: dict[str, float], falls: Sequence[bool], events: Sequence[str]) -> dict[str, Any]:
        """Return the `info`: data that policies must not use."""
        return self._told.told(self._k * self.control_period, terms, events, falls)

    def _measure(self) -> Array:
        """Read the engine and return the observation."""
        state = self._state = self._engine.state()
        tracking = self._tracking
        tool, planned = self._engine.site(TOOL), tracking.tool[self._k]
        observation = np.concatenate([state.q, state.qd, tracking.plan[self._k], self._tau, tool, planned])
        sensing = self._active.sensing
        return observation if sensing is None else sensing.disturb(observation)

    def _reward_terms(self, previous: Array) -> dict[str, float]:
        n = len(self._limit)
        error = self._tracking.plan[self._k, :n] - self._state.q
        effort, change = self._tau / self._limit, (self._tau - previous) / self._limit
        return task.reward_terms(
            float(error.dot(error)), float(effort.dot(effort)) / n, float(change.dot(change)) / n, math.exp
        )
