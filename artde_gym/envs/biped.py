"""Base class of the walking tasks of Ojas: joint torques follow a given walking pattern."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import action_array, check_seed, known_arguments
from artde_gym.arrays import Array, total
from artde_gym.disturbances.effects import Effects
from artde_gym.disturbances.ground import LOADED, GrfPulses
from artde_gym.disturbances.schedule import Schedule
from artde_gym.envs.biped_disturbances import EpisodeDisturbances
from artde_gym.envs.closed_env import CLOSED
from artde_gym.envs.documentation import filled
from artde_gym.envs.interactive import InteractiveMixin
from artde_gym.envs.options import disturbances_in, warn_of_idle
from artde_gym.envs.view import View
from artde_gym.errors import OptionError
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas import task
from artde_gym.robots.ojas.model import ActuatorInertia
from artde_gym.robots.ojas.walking import WalkingPattern
from artde_gym.sim.engine import Camera, Engine
from artde_gym.sim.factory import EngineName, make_engine, resolve_engine
from artde_gym.sim.rotation import arcsine, roll_pitch

CAMERA_HEIGHT = 0.42  # m, of the camera's target
CAMERA_SLACK = 0.15  # m, distance from the pattern beyond which the camera follows the robot

_PAGE = (
    task.DOCUMENTATION
    + """
| `engine` | None | "bullet", "mujoco", None | physics engine; None: Bullet where it can be imported, else MuJoCo |
| `width`, `height` | 640, 480 | 16 to 4096 | pixels of a picture |

With `render_mode="rgb_array"`, `render` draws 30 frames per simulated second and returns the last one again in between.
Set `env.unwrapped.view.caption` to add text to each frame.

Gymnasium's `RecordVideo` records one frame per step and plays `metadata["render_fps"]` of them per second: real time
up to 100 steps per second, slow motion at shorter control periods. `artde-gym video` is always in real time.

`reset(options={{"disturbances": ..., "scenario": "S2"}})` overrides the disturbances of this and the following
episodes with a mapping or with those of a scenario. Nothing is merged: a mapping has to list every disturbance.

## Info
Only numbers and arrays, with the same keys after `reset` and `step` (`artde_gym.info`): `time_s`; the terms of the
reward (`reward_alive`, ...); `foot_loads` (normal force on each foot, N); the sampled disturbances
(`disturbance.payload.mass`, ...; `env.unwrapped.sampled_disturbances` has them in the grammar); the number of pushes
and payloads that began and ended in this control period (`push_begins`, `push_ends`, `payload_attached`,
`payload_dropped`); the reason for a fall (`fell_tilt`, `fell_height`, `fell_speed`, true or false)."""
)


class BipedEnv(InteractiveMixin, gym.Env[NDArray[Any], NDArray[Any]]):
    """Base class of all tasks of Ojas; a subclass sets the default disturbances.

    Args:
        disturbances: override of the task's disturbances; see `artde_gym.disturbances`.
        control_period: time between two actions (s), a whole multiple of the physics' 0.001 s.
        actuator_inertia: see `artde_gym.robots.ojas.model`.
        arms: see `artde_gym.robots.ojas.model`.
        self_collision: whether the feet can collide; they never touch in the planned walk.
        speed: see `artde_gym.robots.ojas.walking`, also for `step_duration` and `duration`.
        observe_ground_force: whether the observation ends with the ground's force on each foot.
        engine: physics engine; None for the default. `engine_name` is the selected one.
        width, height: size of a frame (pixels).
        render_mode: "rgb_array" or None.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    default_disturbances: ClassVar[Mapping[str, Any]] = {}
    action_layout = task.ACTION
    robot_name: ClassVar[str] = "ojas"
    metrics_spec = task.METRICS_SPEC
    fall_reasons: ClassVar[Sequence[str]] = task.FALL_REASONS

    @known_arguments
    def __init__(
        self,
        *,
        disturbances: Mapping[str, Any] | None = None,
        control_period: float = 0.001,
        actuator_inertia: ActuatorInertia = "rotor",
        arms: task.Arms = "fixed",
        self_collision: bool = False,
        speed: float = 0.1,
        step_duration: float = 1.0,
        duration: float = 58.0,
        observe_ground_force: bool = False,
        engine: EngineName | None = None,
        width: int = 640,
        height: int = 480,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise OptionError("render_mode", render_mode, "None, 'rgb_array'")
        self.render_mode = render_mode
        walk = self._walk = task.Walk.of(
            control_period, actuator_inertia, arms, self_collision, speed, step_duration, duration
        )
        self.nominal_robot, self.control_period = walk.nominal_robot, walk.control_period
        self._disturbances = walk.parse(self.default_disturbances if disturbances is None else disturbances)
        self.engine_name = resolve_engine(engine)
        self._engine: Engine = make_engine(
            self.engine_name, walk.robot, task.TIME_STEP, renders=render_mode is not None
        )
        camera = Camera((0.0, 0.0, CAMERA_HEIGHT), width=width, height=height)
        self.view = View(self._engine, camera, self.control_period, share=1.0, slack=CAMERA_SLACK)
        self.metadata = {**self.metadata, **self.view.metadata}
        self.observe_ground_force = observe_ground_force
        self.observation_layout = task.observation_layout(observe_ground_force)
        self.observation_space = self.observation_layout.box()
        self.action_space = task.ACTION.box()
        self._limit = robot.TORQUE_LIMIT
        self._engine.set_friction(task.FRICTION)
        self._engine.reset(walk.position, walk.start)
        self._still = self._settle(walk.start, task.SETTLE_STEPS)
        self._settled = self._engine.save_state()
        self._k, self._last, self._over = 0, walk.last, True  # no step before the first reset
        self._state, self.words = self._engine.state(), walk.words
        self._sample({})
        warn_of_idle(self._disturbances, self._last * self.control_period)
        self._active = EpisodeDisturbances(self._sampled, walk, self.np_random)
        self._pulses: GrfPulses | None = None
        self._effects = Effects(1, self.words)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Start a walk; the class' documentation lists the `options`.

        Raises:
            OptionError: for an unknown option, or a scenario of another environment.
            DisturbanceError: for a malformed disturbance.
        """
        self._require_open()
        disturbances = disturbances_in(options or {}, self)
        if disturbances is not None:
            self._disturbances = self._walk.parse(disturbances)
            warn_of_idle(self._disturbances, self._last * self.control_period)
        super().reset(seed=check_seed("seed", seed))
        sampled = self._disturbances.sample(self.np_random)
        self._sample(sampled)
        self._tau = self._begin(sampled)
        self._k, self._over = 0, False
        self.view.reset()
        observation = self._measure()
        return observation, self._info(dict.fromkeys(task.REWARD_SCALES, 0.0), (), ())

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply joint torques for one control period.

        Raises:
            ActionError: for a wrong shape or a value that is not finite.
            gymnasium.error.ResetNeeded: after the end of the walk, or before the first reset.
        """
        self._require_open()
        if self._over:
            raise gym.error.ResetNeeded("the walk is over or has not begun: call reset()")
        action = action_array(action, task.N_JOINTS, "torques (Nm)")
        previous = self._tau
        events = self._simulate(np.minimum(np.maximum(action, -self._limit), self._limit))
        self._k += 1
        observation = self._measure()
        terms = self._reward_terms(previous)
        reward = self.control_period * total(map(operator.mul, task.REWARD_SCALES.values(), terms.values()))
        falls = self._falls()
        fell, truncated = any(falls), self._k >= self._last
        self._over = fell or truncated
        return observation, reward, fell, truncated, self._info(terms, falls, events)

    def render(self) -> NDArray[np.uint8] | None:
        """Draw a frame from a camera that follows the robot; return None without a render mode."""
        self._require_open()
        if self.render_mode is None:
            return None
        step = self.elapsed
        home = (float(self.pattern.base[step, 0]), 0.0, CAMERA_HEIGHT)
        pushes = self.schedule.acting(step)
        return self.view.picture(step * task.TIME_STEP, home, pushes, self._sampled, over=self._over)

    def close(self) -> None:
        self._engine.close()
        self._engine = self.view = CLOSED

    @property
    def pattern(self) -> WalkingPattern:
        """The walking pattern."""
        return self._walk.pattern

    @property
    def elapsed(self) -> int:
        return self._k * self._walk.substeps

    @property
    def schedule(self) -> Schedule:
        return self._active.schedule

    def _begin(self, sampled: Mapping[str, Any]) -> Array:
        """Set up an episode and let the robot settle; return the final joint torques."""
        self._engine.restore_state(self._settled)
        self._walk.set_up(self._engine, sampled)
        self._active = EpisodeDisturbances(sampled, self._walk, self.np_random)
        self._active.start(self._engine)
        self._limit = task.torque_limit(sampled)
        self._pulses = None
        if "grf_pulse" in sampled:
            self._pulses = self._walk.pulses(1)
            self._pulses.begin(0, sampled["grf_pulse"], self.nominal_robot)
        self._effects.begin(0, sampled)
        steps = task.settling(sampled)
        tau = self._settle(self._walk.pose(sampled), steps) if steps else self._still
        self._active.begin_walk(tau)
        return tau

    def _settle(self, pose: Array, steps: int) -> Array:
        """Stand still for `steps` time steps; return the final torques."""
        tau = self._walk.stand
        for _ in range(steps):
            state = self._engine.state()
            tau = self._walk.hold(pose, state.q, state.qd)
            self._engine.step(tau)
        return np.clip(tau, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT)

    def _simulate(self, command: Array) -> list[str]:
        """Apply `command` and the disturbances for one control period; return the events."""
        engine, active = self._engine, self._active
        events: list[str] = []
        first, affected = self.elapsed, self._effects.acting[0]
        active.begin_period(command)
        for step in range(first, first + self._walk.substeps):
            tau = active.apply(step, engine, events)
            if self._pulses is not None:
                loads = np.array([engine.foot_loads()])
                engine.lift_feet(self._pulses.forces(loads, np.array([step]))[0].tolist())
            if affected:
                tau = tau + self._effects.apply(engine, engine.state(), step * task.TIME_STEP)
            engine.step(tau)
        self._tau = active.applied()
        return events

    def _info(self, terms: dict[str, float], falls: Sequence[bool], events: Sequence[str]) -> dict[str, Any]:
        """Return the `info`: data that policies must not use."""
        info = self._told.told(self._k * self.control_period, terms, events, falls)
        info["foot_loads"] = np.array(self._loads)
        return info

    def _measure(self) -> Array:
        """Read the engine and return the observation."""
        state = self._state = self._engine.state()
        loads = self._loads = self._engine.foot_loads()
        self._tilt = roll_pitch(state.quat_xyzw, math.atan2, arcsine)
        contact = [load > LOADED for load in loads]
        plan = self._walk.plan[self._k]
        base = (state.position[2], *self._tilt, *state.velocity, *state.angular_velocity, *contact)
        parts = [state.q, state.qd, plan[:-2], self._tau, base, plan[-2:]]
        if self.observe_ground_force:
            parts.append(self._engine.ground_forces().ravel())
        observation = np.concatenate(parts)
        sensing = self._active.sensing
        return observation if sensing is None else sensing.disturb(observation)

    def _reward_terms(self, previous: Array) -> dict[str, float]:
        error = self._walk.plan[self._k, : task.N_JOINTS] - self._state.q
        tau, change = self._tau, self._tau - previous
        roll, pitch = self._tilt
        tilt = roll * roll + pitch * pitch
        squares = float(error.dot(error)), tilt, float(tau.dot(tau)), float(change.dot(change))
        return task.reward_terms(*squares, math.exp)

    def _falls(self) -> tuple[bool, bool, bool]:
        speeds = self._state.qd
        return task.falls(self._state.quat_xyzw, self._state.position[2], float(speeds.dot(speeds)))


def document(default: str) -> Callable[[type[BipedEnv]], type[BipedEnv]]:
    """Return a class decorator that inserts the sections shared by all tasks at `{shared}` in a docstring."""
    return filled(shared=_PAGE.format(observation=task.OBSERVATION.table(), default=default))
