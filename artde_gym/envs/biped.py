"""Base class of the walking tasks of Ojas: joint torques follow a given walking pattern."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from artde_gym.arguments import known_arguments
from artde_gym.arrays import Array
from artde_gym.disturbances.ground import LOADED, GrfPulses
from artde_gym.envs.documentation import filled
from artde_gym.envs.joint_env import JointEnv
from artde_gym.multibody.spec import Vector
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas import task
from artde_gym.robots.ojas.model import ActuatorInertia
from artde_gym.robots.ojas.walking import WalkingPattern
from artde_gym.sim.engine import Camera
from artde_gym.sim.factory import EngineName
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


class BipedEnv(JointEnv[task.Walk]):
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

    action_layout = task.ACTION
    robot_name: ClassVar[str] = "ojas"
    metrics_spec = task.METRICS_SPEC
    reward_scales = task.REWARD_SCALES
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
        self.observe_ground_force = observe_ground_force
        self.observation_layout = task.observation_layout(observe_ground_force)
        walk = task.Walk.of(control_period, actuator_inertia, arms, self_collision, speed, step_duration, duration)
        camera = Camera((0.0, 0.0, CAMERA_HEIGHT), width=width, height=height)
        super().__init__(walk, disturbances, engine=engine, camera=camera, slack=CAMERA_SLACK, render_mode=render_mode)
        self._engine.set_friction(task.FRICTION)
        self._engine.reset(walk.position, walk.start)
        self._still = self._settle(walk.start, task.SETTLE_STEPS)
        self._settled = self._engine.save_state()
        self._state = self._engine.state()
        self._pulses: GrfPulses | None = None

    @property
    def pattern(self) -> WalkingPattern:
        """The walking pattern."""
        return self._task.pattern

    def _place(self, sampled: Mapping[str, Any]) -> None:
        self._engine.restore_state(self._settled)
        self._task.set_up(self._engine, sampled)
        self._high = np.full(task.N_JOINTS, task.torque_limit(sampled))
        self._low = -self._high
        self._pulses = None
        if "grf_pulse" in sampled:
            self._pulses = self._task.pulses(1)
            self._pulses.begin(0, sampled["grf_pulse"], self.nominal_robot)

    def _rest(self, sampled: Mapping[str, Any]) -> Array:
        steps = task.settling(sampled)
        return self._settle(self._task.pose(sampled), steps) if steps else self._still

    def _settle(self, pose: Array, steps: int) -> Array:
        """Stand still for `steps` time steps; return the final torques."""
        tau = self._task.stand
        for _ in range(steps):
            state = self._engine.state()
            tau = self._task.hold(pose, state.q, state.qd)
            self._engine.step(tau)
        return np.clip(tau, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT)

    def _is_loaded(self) -> bool:
        return self._pulses is not None or super()._is_loaded()

    def _acting(self, tau: Array, step: int) -> Array:
        if self._pulses is not None:
            loads = np.array([self._engine.foot_loads()])
            self._engine.lift_feet(self._pulses.forces(loads, np.array([step]))[0].tolist())
        return super()._acting(tau, step)

    def _home(self) -> Vector:
        return (float(self.pattern.base[self.elapsed, 0]), 0.0, CAMERA_HEIGHT)

    def _info(self, terms: dict[str, float], falls: Sequence[bool], events: Sequence[str]) -> dict[str, Any]:
        info = super()._info(terms, falls, events)
        info["foot_loads"] = np.array(self._loads)
        return info

    def _observation(self) -> Array:
        state = self._state = self._engine.state()
        left, right = self._loads = self._engine.foot_loads()
        self._tilt = roll_pitch(state.quat_xyzw, math.atan2, arcsine)
        plan = self._plan = self._task.plan[self._k]
        contact = (1.0 if left > LOADED else 0.0, 1.0 if right > LOADED else 0.0)
        base = (state.position[2], *self._tilt, *state.velocity, *state.angular_velocity, *contact)
        parts = [state.q, state.qd, plan[:-2], self._tau, base, plan[-2:]]
        if self.observe_ground_force:
            parts.append(self._engine.ground_forces().ravel())
        return np.concatenate(parts)

    def _reward_terms(self) -> dict[str, float]:
        error = self._plan[: task.N_JOINTS] - self._state.q
        tau, change = self._tau, self._tau - self._previous
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
