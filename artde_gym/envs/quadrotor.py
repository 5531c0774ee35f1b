"""`QuadInfinity-Payload-v0` for one vehicle in a physics engine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, cast

import numpy as np

from artde_gym.arguments import known_arguments, steps_per_period
from artde_gym.arrays import Array
from artde_gym.disturbances.effects import Effects, load_base
from artde_gym.disturbances.ground_effect import thrust_gain
from artde_gym.disturbances.noise import draw_keys
from artde_gym.disturbances.schedule import Schedule
from artde_gym.disturbances.wind import GRID, Wind
from artde_gym.envs.documentation import filled
from artde_gym.envs.engine_env import EngineEnv
from artde_gym.envs.quadrotor_sensors import Measurement, Sensors
from artde_gym.kit import PAYLOAD
from artde_gym.multibody.spec import Vector
from artde_gym.robots.q450 import model as robot
from artde_gym.robots.q450 import task
from artde_gym.robots.q450.rotors import Rotors
from artde_gym.sim.engine import Camera, Engine
from artde_gym.sim.factory import EngineName
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
class QuadInfinityPayloadEnv(EngineEnv):
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

    time_step = TIME_STEP
    allowed_action = "[u1 (N), u2, u3, u4 (Nm)]"
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
        self.measurement, self.duration = measurement, duration
        self._ticks = steps_per_period(control_period, GRID)
        period, steps = self._ticks * GRID, self._ticks * STEPS
        self.nominal_robot = robot.q450()
        self._plan = task.plan(duration, period, self.lift)
        super().__init__(
            disturbances, control_period=period, substeps=steps, last=len(self._plan) - 1, render_mode=render_mode
        )
        self._sensors = Sensors(1, measurement, period, np.float64, self.observation_layout)
        x, y, z = PATH_CENTER
        self._center: Vector = (x, y, z + self.lift)
        camera = CAMERA._replace(target=self._center, width=width, height=height)
        self._open(engine, self.nominal_robot, camera, share=CAMERA_SHARE, slack=CAMERA_SLACK)
        self._engine.reset(task.start({}, self.lift), _NO_JOINTS)
        self._placed = self._engine.save_state()
        self._effects = Effects(1, self.words)

    def _equipped(self, engine: Engine) -> Engine:
        self._sling = Sling(engine)
        return cast(Engine, self._sling)

    def _home(self) -> Vector:
        return self._center

    def _lines(self) -> dict[str, Any]:
        return {"path": self._plan[:, :3], "cable": self._sling.curve()}

    def _begin(self, sampled: Mapping[str, Any]) -> None:
        engine, keys = self._engine, draw_keys(self.np_random, task.STREAMS)
        engine.restore_state(self._placed)
        if "initial_position" in sampled:
            engine.reset(task.start(sampled, self.lift), _NO_JOINTS)
        engine.scale_masses(sampled.get("mass_scale", {}).get("factor", 1.0))
        self.schedule = Schedule(sampled, TIME_STEP)
        self.schedule.start(engine)
        self._rotors = Rotors(sampled, task.hover_thrusts(sampled, self.lift), TIME_STEP, self._substeps)
        self._wrench = robot.MIXER @ self._rotors.thrusts
        self._wind = Wind(sampled["wind"], keys[0]) if "wind" in sampled else None
        self._ground_effect = sampled.get("ground_effect", {}).get("strength", 0.0)
        self._sensors.begin(0, sampled, keys[1:])
        self._effects.begin(0, sampled)
        self._pulled = 0.0
        self._read()

    def _simulate(self, command: Array) -> list[str]:
        sling, events = self._sling, []
        engine, loaded = sling.moved, self._effects.acting[0]
        steps, first = self._substeps, self.elapsed
        self._before = self._rotors.thrusts
        thrusts = self._rotors.advance(command.tolist(), first)
        wrenches = thrusts @ robot.MIXER.T
        rows = wrenches.tolist()
        quiet = self.schedule.quiet(first, first + steps)
        pulled = 0.0
        for start in range(0, steps, STEPS):
            end = start + STEPS
            if self._ground_effect:
                rows[start:end] = ((thrusts[start:end] * self._gains()) @ robot.MIXER.T).tolist()
            drag_x, drag_y, drag_z = self._drag()
            load = self._effects.load_of(self._state, (first + start) * TIME_STEP) if loaded else None
            for step in range(start, end):
                if not quiet:
                    events += self.schedule.apply(first + step, sling)
                    engine = sling.moved
                u1, u2, u3, u4 = rows[step]
                engine.apply_base_wrench((drag_x, drag_y, drag_z + u1), (u2, u3, u4))
                if load is not None:
                    load_base(engine, load, 0)
                engine.step(_NO_JOINTS)
                pulled += sling.tension
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

    def _reward_terms(self) -> dict[str, float]:
        plan = self._plan[self._k, :6].tolist()
        error = math.dist(plan[:3], self._state.position) ** 2
        velocity_error = math.dist(plan[3:], self._state.velocity) ** 2
        thrusts = self._rotors.thrusts
        change = thrusts - self._before
        effort, smoothness = float(thrusts.dot(thrusts)), float(change.dot(change))
        return task.reward_terms(error, velocity_error, self._rot[8], effort, smoothness, math.exp)

    def _falls(self) -> tuple[bool, ...]:
        spin = math.hypot(*self._state.angular_velocity) ** 2
        return task.falls(self._state.position, self._rot[8], spin)
