"""Base class of the walking tasks of Ojas, with many robots at once in MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from artde_gym.arguments import known_arguments
from artde_gym.arrays import Array, vectorize
from artde_gym.disturbances.ground import LOADED, GrfPulses
from artde_gym.envs.documentation import filled
from artde_gym.envs.joint_vector import JointVectorEnv, square
from artde_gym.envs.vector import Mask
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas import task
from artde_gym.robots.ojas.model import ActuatorInertia
from artde_gym.sim.rotation import arcsine, roll_pitch

_PAGE = (
    task.DOCUMENTATION
    + """
| `num_envs` | 1 | from 1 | number of robots |
| `engine` | None | None, "mujoco" | physics engine; None warns if `gym.make` would use another one |
| `threads` | 1 | from 1 | number of threads that step the robots; results do not depend on it |
| `autoreset_mode` | "NextStep" | "NextStep", "SameStep", "Disabled" | Gymnasium's `AutoresetMode` |
| `max_episode_steps` | None | from 1 | steps after which a walk is truncated, if its duration is longer |
| `render_mode` | None | None | use `vectorization_mode="sync"` to render |

`reset(options={{"disturbances": ..., "scenario": "S2"}})` overrides the disturbances of this and the following
episodes with a mapping or with those of a scenario. Nothing is merged: a mapping has to list every disturbance.
The option `"reset_mask"` (n,) selects the robots to reset.

## Vectorization
For `gym.make_vec(..., vectorization_mode="vector_entry_point")`. Each robot has its own random generator and behaves
bitwise as in `gym.make(..., engine="mujoco")` with the same seed and actions, for any number of robots and threads.
A finished walk restarts with the next step, which ignores its action; with `autoreset_mode="SameStep"` it restarts in
the same step, with its last observation and info in `info["final_obs"]` and `info["final_info"]`; with `"Disabled"` it
stays as it is until a reset whose mask includes it.

## Info
As in the single environment, each entry `x` with a mask `_x` (n,), in nested dictionaries too: numbers and Booleans
(n,), arrays (n, ...). `env.unwrapped.sampled_disturbances` is a list."""
)

COLUMNS = task.OBSERVATION.slices
PLAN = slice(COLUMNS["q_ref"].start, COLUMNS["qdd_ref"].stop)
CLOCK = slice(COLUMNS["load_left_ref"].start, COLUMNS["phase"].stop)
KNOWN = 256  # settled robots that are kept for later resets
BASE = slice(COLUMNS["base_height"].start, COLUMNS["base_angular_velocity"].stop)

_ARCTANGENT, _ARCSINE, _EXP = vectorize(math.atan2), vectorize(arcsine), vectorize(math.exp)


class BipedVectorEnv(JointVectorEnv[task.Walk]):
    """Base class of all tasks of Ojas with many robots; a subclass sets the default disturbances.

    Args:
        num_envs: number of robots.
        engine: "mujoco" or None; None warns if `gym.make` would use another one.
        threads: number of threads that step the robots.
        render_mode, autoreset_mode, max_episode_steps: see `artde_gym.envs.vector.BaseVectorEnv`.
        disturbances: see `artde_gym.envs.biped.BipedEnv`, also for all further arguments.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    action_layout = task.ACTION
    robot_name: ClassVar[str] = "ojas"
    metrics_spec = task.METRICS_SPEC
    reward_scales = task.REWARD_SCALES
    fall_reasons = task.FALL_REASONS

    @known_arguments
    def __init__(
        self,
        num_envs: int = 1,
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
        engine: Literal["mujoco"] | None = None,
        threads: int = 1,
        render_mode: None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
    ) -> None:
        self.observe_ground_force = observe_ground_force
        self.observation_layout = task.observation_layout(observe_ground_force)
        walk = task.Walk.of(control_period, actuator_inertia, arms, self_collision, speed, step_duration, duration)
        super().__init__(
            walk,
            num_envs,
            disturbances,
            threads=threads,
            engine=engine,
            render_mode=render_mode,
            autoreset_mode=autoreset_mode,
            max_episode_steps=max_episode_steps,
        )
        self._pulses: GrfPulses | None = None
        self._pulsed = np.zeros(num_envs, np.bool_)  # robots with ground reaction pulses
        self._high = np.full((num_envs, task.N_JOINTS), robot.TORQUE_LIMIT)
        self._low = -self._high
        first = np.zeros(1, np.int32)
        self._batch.worlds[0].set_friction(task.FRICTION)
        self._batch.reset(0, walk.position, walk.start)
        self._known: dict[bytes, tuple[Any, Array]] = {}  # settled robots and their torques
        self._still = self._settle(first, walk.start[None], task.SETTLE_STEPS)[0]
        self._settled = self._batch.save_state(0)

    def _place(self, robots: Mapping[int, Mapping[str, Any]]) -> None:
        self._batch.restore_state(np.fromiter(robots, np.int32), self._settled)
        for i, sampled in robots.items():
            self._task.set_up(self._batch.worlds[i], sampled)
            self._high[i] = task.torque_limit(sampled)
            self._low[i] = -self._high[i]
            self._begin_pulses(i, sampled.get("grf_pulse"))

    def _rest(self, robots: Mapping[int, Mapping[str, Any]]) -> None:
        restless: dict[int, list[int]] = {}
        for i, sampled in robots.items():
            self._tau[i] = self._still
            if steps := task.settling(sampled):
                restless.setdefault(steps, []).append(i)
        for steps, some in restless.items():
            self._settle_alike({i: robots[i] for i in some}, steps)

    def _settle_alike(self, drawn: Mapping[int, Mapping[str, Any]], steps: int) -> None:
        """Let robots settle, one for all that are disturbed alike; those known from an earlier reset not at all."""
        alike: dict[bytes, list[int]] = {}
        for i, sampled in drawn.items():
            alike.setdefault(task.settled_by(sampled), []).append(i)
        new = {key: robots[0] for key, robots in alike.items() if key not in self._known}
        if new:
            some = [*new.values()]
            poses = np.array([self._task.pose(drawn[i]) for i in some])
            last = self._settle(np.array(some, np.int32), poses, steps)
            self._known |= {key: (self._batch.motion(i), tau) for (key, i), tau in zip(new.items(), last, strict=True)}
        for key, robots in alike.items():
            motion, self._tau[robots] = self._known[key]
            self._batch.set_motion(np.array(robots, np.int32), motion)
        for key in [*self._known][:-KNOWN]:
            del self._known[key]

    def _begin_pulses(self, i: int, entry: Mapping[str, Any] | None) -> None:
        if entry is not None and self._pulses is None:
            self._pulses = self._task.pulses(self.num_envs)
        if self._pulses is not None:
            self._pulses.begin(i, entry, self.nominal_robot)
        self._pulsed[i] = entry is not None

    def _settle(self, some: NDArray[np.int32], poses: Array, steps: int) -> Array:
        """Let some robots stand still in `poses` (n, 12) (rad) for `steps` time steps; return their last torques."""
        tau = np.zeros_like(poses)
        for _ in range(steps):
            tau = self._task.hold(poses, *self._batch.joints(some))
            self._batch.step(tau, some)
        return np.clip(tau, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT)

    def _affected(self) -> Mask:
        return self._pulsed | super()._affected()

    def _acting(self, torques: Array, some: Mask, step: int) -> Array:
        if self._pulses is not None:
            forces = self._pulses.forces(self._batch.foot_loads(), self._k * self._task.substeps + step)
            self._batch.lift_feet(forces * some[:, None])
        return super()._acting(torques, some, step)

    def _truth(self) -> Array:
        state = self._state = self._batch.state()
        with np.errstate(invalid="ignore", over="ignore"):  # of a robot that has diverged
            self._tilt = roll_pitch(state.quat_xyzw, _ARCTANGENT, _ARCSINE)
        out = np.empty((self.num_envs, self.observation_layout.size))
        out[:, COLUMNS["q"]], out[:, COLUMNS["qd"]] = state.q, state.qd
        plan = self._task.plan[self._k]
        out[:, PLAN], out[:, CLOCK] = plan[:, :-2], plan[:, -2:]
        out[:, COLUMNS["tau_applied"]] = self._tau
        base = (state.position[2], *self._tilt, *state.velocity, *state.angular_velocity)
        out[:, BASE] = np.stack(base, axis=1)
        out[:, COLUMNS["contact"]] = self._batch.foot_loads() > LOADED
        if self.observe_ground_force:
            out[:, CLOCK.stop :] = self._batch.ground_forces()
        return out

    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        state, tau, (roll, pitch) = self._state, self._tau, self._tilt
        with np.errstate(invalid="ignore", over="ignore"):  # of a robot that has diverged
            error = truth[:, COLUMNS["q_ref"]] - state.q
            change = tau - self._previous
            squares = square(error), roll * roll + pitch * pitch, square(tau), square(change)
            terms = task.reward_terms(*squares, _EXP)
            return terms, task.falls(state.quat_xyzw, state.position[2], square(state.qd))

    def _tell(self) -> dict[str, Array]:
        return {"foot_loads": self._batch.foot_loads().copy()}


def document(default: str) -> Callable[[type[BipedVectorEnv]], type[BipedVectorEnv]]:
    """Return a class decorator that inserts the sections shared by all tasks at `{shared}` in a docstring."""
    return filled(shared=_PAGE.format(observation=task.OBSERVATION.table(), default=default))
