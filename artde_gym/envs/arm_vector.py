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
from artde_gym.envs.arm import DEFAULT, DISTURBANCES
from artde_gym.envs.documentation import filled
from artde_gym.envs.joint_vector import JointVectorEnv, square
from artde_gym.envs.vector import Mask
from artde_gym.multibody.manipulator import TOOL
from artde_gym.robots.arm import task
from artde_gym.robots.arm.panda import panda
from artde_gym.robots.arm.reference import PICK

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
class ArmTrackVectorEnv(JointVectorEnv[task.Tracking]):
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
    default_disturbances = DISTURBANCES

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
        tracking = task.Tracking.of(robot, tip, armature, joints, reference, control_period, duration)
        spec, self.reference = tracking.robot, reference
        self.observation_layout, self.action_layout = task.observation_layout(spec), task.action_layout(spec)
        self.metrics_spec = task.metrics_spec(spec)
        super().__init__(
            tracking,
            num_envs,
            disturbances,
            threads=threads,
            engine=engine,
            render_mode=render_mode,
            autoreset_mode=autoreset_mode,
            max_episode_steps=max_episode_steps,
        )
        self._limits, self._effort = task.Limits(spec), np.array(spec.torque_limits)
        self._columns = self.observation_layout.slices
        self._friction = np.ones((num_envs, 1))
        self._always = np.ones(num_envs, np.bool_)

    def _place(self, robots: Mapping[int, Mapping[str, Any]]) -> None:
        for i, sampled in robots.items():
            self._batch.reset(i, (0.0, 0.0, 0.0), self._task.pose(sampled))
            self._task.set_up(self._batch.worlds[i], sampled)
            self._friction[i] = task.friction_scale(sampled)

    def _rest(self, robots: Mapping[int, Mapping[str, Any]]) -> None:
        for i, sampled in robots.items():
            self._tau[i] = self._task.balance(sampled)

    def _affected(self) -> Mask:
        return self._always  # friction depends on the state

    def _acting(self, torques: Array, some: Mask, step: int) -> Array:
        torques = super()._acting(torques, some, step)
        with np.errstate(invalid="ignore", over="ignore"):  # of an arm that has diverged
            _, qd = self._batch.joints()
            return torques + self._task.friction(self._friction, qd)

    def _truth(self) -> Array:
        columns = self._columns
        out = np.empty((self.num_envs, self.observation_layout.size))
        out[:, columns["q"]], out[:, columns["qd"]] = self._batch.joints()
        out[:, columns["q_ref"].start : columns["qdd_ref"].stop] = self._task.plan[self._k]
        out[:, columns["tau_applied"]] = self._tau
        out[:, columns["tool"]] = self._batch.site(TOOL)
        out[:, columns["tool_ref"]] = self._task.tool[self._k]
        return out

    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        columns, n = self._columns, len(self._effort)
        q, qd = truth[:, columns["q"]], truth[:, columns["qd"]]
        with np.errstate(invalid="ignore", over="ignore"):  # of an arm that has diverged
            error = truth[:, columns["q_ref"]] - q
            effort, change = self._tau / self._effort, (self._tau - self._previous) / self._effort
            squares = square(error), square(effort) / n, square(change) / n
            return task.reward_terms(*squares, _EXP), self._limits.falls(q, qd)
