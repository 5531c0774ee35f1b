"""`ArmTrack-Payload-v0`: torques of an arm's joints follow a given reference."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np

from artde_gym.arguments import known_arguments
from artde_gym.arrays import Array
from artde_gym.envs.documentation import filled
from artde_gym.envs.joint_env import JointEnv
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.motion.motion import Pose
from artde_gym.multibody.manipulator import TOOL
from artde_gym.robots.arm import task
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reference import GRASP, PICK, RELEASE
from artde_gym.robots.arm.scene import frame_angles
from artde_gym.sim.engine import Camera
from artde_gym.sim.factory import EngineName

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
class ArmTrackEnv(JointEnv[task.Tracking]):
    """An arm on a fixed base follows a reference of its joints; a payload is grasped and released on the way.

    ## Description
    The policy commands the torques of all joints. It does not observe payload, pushes and friction.

    {shared}

    ## Versions
    * v0: first version.
    """

    observation_layout = task.observation_layout(panda())
    action_layout = task.action_layout(panda())
    robot_name: ClassVar[str] = "arm"
    metrics_spec = task.metrics_spec(panda())
    reward_scales = task.REWARD_SCALES
    fall_reasons: ClassVar[Sequence[str]] = task.FALL_REASONS
    default_disturbances = DISTURBANCES

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
        tracking = task.Tracking.of(robot, tip, armature, joints, reference, control_period, duration)
        spec, self.reference = tracking.robot, reference
        self.observation_layout, self.action_layout = task.observation_layout(spec), task.action_layout(spec)
        self.metrics_spec = task.metrics_spec(spec)
        camera = Camera((0.0, 0.0, CAMERA_HEIGHT), distance=CAMERA_DISTANCE, width=width, height=height)
        super().__init__(tracking, disturbances, engine=engine, camera=camera, render_mode=render_mode)
        self._effort = np.array(spec.torque_limits)
        self._limits, self._frames = task.Limits(spec), frame_angles(spec)

    @staticmethod
    def metrics_spec_with(arguments: Mapping[str, Any]) -> MetricsSpec:
        """Return the metrics of the arm that these arguments choose.

        Raises:
            OptionError, RobotError: for an arm that there is not.
        """
        chosen = {name: arguments[name] for name in ("robot", "tip", "armature", "joints") if name in arguments}
        return task.metrics_spec(task.arm(**chosen))

    def pose(self) -> Pose:
        """Read where arm and payload are; joints as `artde_gym.robots.arm.scene` counts them."""
        pose = super().pose()
        return pose._replace(q=np.concatenate([pose.q, self._frames]))

    def _lines(self) -> dict[str, Any]:
        return {"path": self._task.tool[:: max(1, self._last // 300)]}

    def _place(self, sampled: Mapping[str, Any]) -> None:
        self._engine.reset((0.0, 0.0, 0.0), self._task.pose(sampled))
        self._task.set_up(self._engine, sampled)
        self._friction = task.friction_scale(sampled)

    def _rest(self, sampled: Mapping[str, Any]) -> Array:
        return self._task.balance(sampled)

    def _is_loaded(self) -> bool:
        return True  # by the friction of the joints

    def _acting(self, tau: Array, step: int) -> Array:
        state = self._state if step == self.elapsed else self._engine.state()
        return super()._acting(tau, step) + self._task.friction(self._friction, state.qd)

    def _observation(self) -> Array:
        state = self._state = self._engine.state()
        tracking = self._task
        tool, planned = self._engine.site(TOOL), tracking.tool[self._k]
        return np.concatenate([state.q, state.qd, tracking.plan[self._k], self._tau, tool, planned])

    def _reward_terms(self) -> dict[str, float]:
        n = len(self._effort)
        error = self._task.plan[self._k, :n] - self._state.q
        effort, change = self._tau / self._effort, (self._tau - self._previous) / self._effort
        return task.reward_terms(
            float(error.dot(error)), float(effort.dot(effort)) / n, float(change.dot(change)) / n, math.exp
        )

    def _falls(self) -> tuple[bool, ...]:
        return tuple(map(bool, self._limits.falls(self._state.q, self._state.qd)))
