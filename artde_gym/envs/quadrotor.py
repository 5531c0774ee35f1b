"""`QuadInfinity-Payload-v0` for one vehicle in a physics engine."""

from __future__ import annotations

import math
import operator
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, cast

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import action_array, check_seed, known_arguments, steps_per_period
from artde_gym.arrays import Array, total
from artde_gym.disturbances.effects import Effects, load_base
from artde_gym.disturbances.ground_effect import thrust_gain
from artde_gym.disturbances.noise import draw_keys
from artde_gym.disturbances.schedule import Schedule
from artde_gym.disturbances.wind import GRID, Wind
from artde_gym.envs.closed_env import CLOSED
from artde_gym.envs.documentation import filled
from artde_gym.envs.interactive import InteractiveMixin
from artde_gym.envs.options import disturbances_in, warn_of_idle
from artde_gym.envs.quadrotor_sensors import Measurement, Sensors
from artde_gym.envs.view import View
from artde_gym.errors import OptionError
from artde_gym.kit import PAYLOAD
from artde_gym.multibody.spec import Vector
from artde_gym.robots.q450 import model as robot
from artde_gym.robots.q450 import task
from artde_gym.robots.q450.rotors import Rotors
from artde_gym.sim.engine import Camera, Engine
from artde_gym.sim.factory import EngineName, make_engine, resolve_engine
from artde_gym.sim.rotation import matrix
from artde_gym.sim.sling import Sling

TIME_STEP = 0.001  # s, of the physics
STEPS = 5  # physics steps from one grid point to the next

PATH_CENTER: Vector = (0.0, 0.0, 0.6)  # m, of the path
CAMERA = Camera(PATH_CENTER, distance=3.0, yaw_deg=35.0, pitch_deg=24.0)
CAMERA_SHARE = 0.5  # of the vehicle's offset from the path's center that the camera does not follow
CAMERA_SLACK = 0.6  # m, largest distance of the vehicle from the frame's center

_NOTHING = (0.0, 0.0, 0.0)
_NO_JOINTS = np.zeros(0)


@filled(shared=task.DOCUMENTATION)
class QuadInfinityPayloadEnv(InteractiveMixin, gym.Env[NDArray[Any], NDArray[Any]]):
    """A quadrotor flies an infinity-shaped path with a payload, drops it, and flies the path again.

    ## Description
    After section 3.5 of Dantu, *Adaptive Artificial Time Delay Control for Robotic Systems* (2023): a Q-450 frame, a
    payload of 0.35 kg until 35 s, a fan, a low path. The vehicle is simulated in a physics engine; `gym.make_vec` with
    `vectorization_mode="vector_entry_point"` simulates thousands in NumPy (`artde_gym.envs.quadrotor_vector`).

    {shared}
    | `engine` | None | "bullet", "mujoco", None | physics engine; None: Bullet where it can be imported, else MuJoCo |
    | `width`, `height` | 640, 480 | 16 to 4096 | pixels of a picture |

    With `render_mode="rgb_array"`, `render` draws 30 frames per simulated second and returns the last one again in
    between. Set `env.unwrapped.view.caption` to add text to each frame.

    Gymnasium's `RecordVideo` records one frame per step and plays `metadata["render_fps"]` of them per second: real
    time up to 100 steps per second, slow motion at shorter control periods. `artde-gym video` is always in real time.

    `reset(options={{"disturbances": ..., "scenario": "Q1"}})` overrides the disturbances of this and the following
    episodes with a mapping or with those of a scenario. Nothing is merged: a mapping has to list every disturbance.

    ## Info
    Only numbers and arrays, with the same keys after `reset` and `step` (`artde_gym.info`): `time_s`; the terms of the
    reward (`reward_alive`, ...); the sampled disturbances (`disturbance.payload.mass`, ...;
    `env.unwrapped.sampled_disturbances` has them in the grammar); the number of pushes and payloads that began and
    ended in this control period (`push_begins`, `push_ends`, `payload_attached`, `payload_dropped`); the reason for a
    crash (`fell_ground`, `fell_inverted`, `fell_bounds`, true or false).

    ## Versions
    * v0: first version.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}

    action_layout = task.ACTION
    observation_layout = task.OBSERVATION
    robot_name: ClassVar[str] = "q450"
    metrics_spec = task.METRICS_SPEC
    fall_reasons: ClassVar[Sequence[str]] = task.FALL_REASONS
    reward_scales: ClassVar[Mapping[str, float]] = task.REWARD_SCALES
    default_disturbances: ClassVar[Mapping[str, Any]] = task.DEFAULT_DISTURBANCES
    lift: ClassVar[float] = 0.0
    words = task.WORDS

    @known_arguments
    def __init__(
        self,
        *,
        disturbances: Mapping[str, Any] | None = None,
        control_period: float = 0.015,
        measurement: Measurement = "ideal",
        duration: float = 70.0,
        engine: EngineName | None = None,
        width: int = 640,
        height: int = 480,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise OptionError("render_mode", render_mode, "None, 'rgb_array'")
        self.render_mode = render_mode
        self._disturbances = task.parse(self.default_disturbances if disturbances is None else disturbances)
        self._ticks = steps_per_period(control_period, GRID)
        self.control_period = self._ticks * GRID
        self.measurement = measurement
        self.duration = duration
        self._sensors = Sensors(1, measurement, self.control_period, np.float64, self.observation_layout)
        self.nominal_robot = robot.q450()
        self._plan = task.plan(duration, self.control_period, self.lift)
        self._last = len(self._plan) - 1
        self.observation_space = self.observation_layout.box()
        self.action_space = task.ACTION.box()
        self._low, self._high = self.action_space.low, self.action_space.high
        self.engine_name = resolve_engine(engine)
        engine_alone = make_engine(self.engine_name, self.nominal_robot, TIME_STEP, renders=render_mode is not None)
        self._sling = Sling(engine_alone)
        self._engine = cast(Engine, self._sling)
        x, y, z = PATH_CENTER
        self._home: Vector = (x, y, z + self.lift)
        camera = CAMERA._replace(target=self._home, width=width, height=height)
        self.view = View(self._engine, camera, self.control_period, CAMERA_SHARE, CAMERA_SLACK)
        self.metadata = {**self.metadata, **self.view.metadata}
        self._engine.reset(task.start({}, self.lift), _NO_JOINTS)
        self._placed = self._engine.save_state()
        self._k, self._over = 0, True  # no step before the first reset
        self._schedule = Schedule({}, TIME_STEP)
        self._effects = Effects(1, self.words)
        self._sample({})
        warn_of_idle(self._disturbances, self._last * self.control_period)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """Start a flight; the class' documentation lists the `options`.

        Raises:
            OptionError: for an unknown option, or a scenario of another environment.
            DisturbanceError: for a malformed disturbance.
        """
        self._require_open()
        disturbances = disturbances_in(options or {}, self)
        if disturbances is not None:
            self._disturbances = task.parse(disturbances)
            warn_of_idle(self._disturbances, self._last * self.control_period)
        super().reset(seed=check_seed("seed", seed))
        sampled = self._disturbances.sample(self.np_random)
        self._sample(sampled)
        self._begin(sampled, draw_keys(self.np_random, task.STREAMS))
        self.view.reset()
        return self._measure(), self._info(dict.fromkeys(self.reward_scales, 0.0), (), ())

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply a wrench for one control period.

        Raises:
            ActionError: for a wrong shape or a value that is not finite.
            gymnasium.error.ResetNeeded: after the end of the flight, or before the first reset.
        """
        self._require_open()
        if self._over:
            raise gym.error.ResetNeeded("the flight is over or has not begun: call reset()")
        action = action_array(action, 4, "[u1 (N), u2, u3, u4 (Nm)]")
        before = self._rotors.thrusts
        events = self._simulate(np.minimum(np.maximum(action, self._low), self._high).tolist())
        self._k += 1
        observation = self._measure()
        terms = self._reward_terms(before)
        reward = self.control_period * total(map(operator.mul, self.reward_scales.values(), terms.values()))
        falls = self._falls()
        terminated, truncated = any(falls), self._k >= self._last
        self._over = terminated or truncated
        return observation, reward, terminated, truncated, self._info(terms, falls, events)

    def render(self) -> NDArray[np.uint8] | None:
        """Draw a frame from a camera that follows the vehicle half-way; return None without a render mode."""
        self._require_open()
        if self.render_mode is None:
            return None
        step = self.elapsed
        pushes = self._schedule.acting(step)
        path = self._plan[:, :3]
        cable = self._sling.curve()
        return self.view.picture(
            step * TIME_STEP, self._home, pushes, self._sampled, path=path, cable=cable, over=self._over
        )

    def close(self) -> None:
        self._engine.close()
        self._engine = self.view = CLOSED

    @property
    def elapsed(self) -> int:
        return self._k * self._ticks * STEPS

    @property
    def schedule(self) -> Schedule:
        return self._schedule

    def _begin(self, sampled: Mapping[str, Any], keys: NDArray[np.uint64]) -> None:
        """Set up an episode with the vehicle at rest in equilibrium."""
        engine = self._engine
        engine.restore_state(self._placed)
        if "initial_position" in sampled:
            engine.reset(task.start(sampled, self.lift), _NO_JOINTS)
        engine.scale_masses(sampled.get("mass_scale", {}).get("factor", 1.0))
        self._schedule = Schedule(sampled, TIME_STEP)
        self._schedule.start(engine)
        self._rotors = Rotors(sampled, task.hover_thrusts(sampled, self.lift), TIME_STEP, self._ticks * STEPS)
        self._wrench = robot.MIXER @ self._rotors.thrusts
        self._wind = Wind(sampled["wind"], keys[0]) if "wind" in sampled else None
        self._ground_effect = sampled.get("ground_effect", {}).get("strength", 0.0)
        self._sensors.begin(0, sampled, keys[1:])
        self._effects.begin(0, sampled)
        self._k = 0
        self._over = False
        self._pulled = 0.0
        self._read()

    def _info(self, terms: dict[str, float], falls: Sequence[bool], events: Sequence[str]) -> dict[str, Any]:
        """Return the `info`: data that policies must not use."""
        return self._told.told(self._k * self.control_period, terms, events, falls)

    def _simulate(self, command: list[float]) -> list[str]:
        """Apply `command` and the disturbances for one control period; return the events."""
        engine, events = self._engine, []
        steps = self._ticks * STEPS
        first = self._k * steps
        thrusts = self._rotors.advance(command, first)
        wrenches = thrusts @ robot.MIXER.T
        rows = wrenches.tolist()
        quiet = self._schedule.quiet(first, first + steps)
        pulled = 0.0
        for start in range(0, steps, STEPS):
            end = start + STEPS
            if self._ground_effect:
                rows[start:end] = ((thrusts[start:end] * self._gains()) @ robot.MIXER.T).tolist()
            drag_x, drag_y, drag_z = self._drag()
            load = self._effects.load_of(self._state, (first + start) * TIME_STEP)
            for step in range(start, end):
                if not quiet:
                    events += self._schedule.apply(first + step, engine)
                u1, u2, u3, u4 = rows[step]
                engine.apply_base_wrench((drag_x, drag_y, drag_z + u1), (u2, u3, u4))
                load_base(engine, load, 0)
                engine.step(_NO_JOINTS)
                pulled += self._sling.tension
            self._read()
        self._wrench = np.add.reduce(wrenches) / steps
        self._pulled = pulled * TIME_STEP  # impulse of the cable (N s)
        return events

    def _read(self) -> None:
        self._state = self._engine.state()
        self._rot = matrix(self._state.quat_xyzw)

    def _drag(self) -> Vector:
        """Return the aerodynamic force until the next grid point (N, body axes)."""
        state, (xx, xy, xz, yx, yy, yz, zx, zy, zz) = self._state, self._rot
        if self._wind is not None:
            self._sling.wind = self._wind.at(self._sling.site(PAYLOAD)) if self._sling.length else _NOTHING
        wx, wy, wz = _NOTHING if self._wind is None else self._wind.next(state.position)
        vx, vy, vz = state.velocity
        x, y, z = robot.DRAG * (wx - vx), robot.DRAG * (wy - vy), robot.DRAG * (wz - vz)
        return xx * x + yx * y + zx * z, xy * x + yy * y + zy * z, xz * x + yz * y + zz * z

    def _gains(self) -> Array:
        """Return the gain of each rotor's thrust (4,) until the next grid point."""
        heights = np.array(robot.rotor_heights(self._state.position[2], self._rot[6], self._rot[7]))
        return thrust_gain(heights, robot.ROTOR_RADIUS, self._ground_effect, np.maximum)

    def _measure(self) -> Array:
        """Return the observation of the last state read."""
        state, rot = self._state, self._rot
        wx, wy, wz = state.angular_velocity
        rates = (rot[i] * wx + rot[3 + i] * wy + rot[6 + i] * wz for i in range(3))
        observation = np.empty(self.observation_layout.size)
        observation[task.MEASURED] = (*state.position, *state.velocity, *rot, *rates)
        plan = self._plan[self._k]
        observation[task.REFERENCE] = plan[:-1]
        observation[task.WRENCH] = self._wrench
        observation[task.THRUST] = self._rotors.thrusts
        observation[task.PHASE] = plan[-1]
        self._look(observation)
        if not self._sensors.ideal:
            self._sensors.measure(observation[:, None], np.array([self._k]))
        return observation

    def _look(self, observation: Array) -> None:
        """Fill in what else is observed."""

    def _reward_terms(self, before: Array) -> dict[str, float]:
        plan = self._plan[self._k, :6].tolist()
        error = math.dist(plan[:3], self._state.position) ** 2
        velocity_error = math.dist(plan[3:], self._state.velocity) ** 2
        thrusts = self._rotors.thrusts
        change = thrusts - before
        effort, smoothness = float(thrusts.dot(thrusts)), float(change.dot(change))
        return task.reward_terms(error, velocity_error, self._rot[8], effort, smoothness, math.exp)

    def _falls(self) -> tuple[bool, ...]:
        spin = math.hypot(*self._state.angular_velocity) ** 2
        return task.falls(self._state.position, self._rot[8], spin)
