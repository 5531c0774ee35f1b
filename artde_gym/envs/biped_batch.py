"""Ojas walks, many robots at once in MuJoCo: what all its tasks share."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array, each
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.ground import LOADED
from artde_gym.disturbances.schedule import NEVER
from artde_gym.disturbances.sensing import Sensing
from artde_gym.envs import biped_task as task
from artde_gym.envs.batch import BatchEnv, Mask
from artde_gym.envs.biped_course import Course
from artde_gym.envs.documentation import filled
from artde_gym.errors import OptionError
from artde_gym.robots import ojas as robot
from artde_gym.robots.ojas import ActuatorInertia
from artde_gym.sim.factory import make_batch
from artde_gym.sim.rotation import arcsine, roll_pitch

_PAGE = (
    task.DOCUMENTATION
    + """
| `num_envs` | 1 | from 1 | number of robots |
| `engine` | "mujoco" | "mujoco" | physics engine; Bullet has no batches |
| `threads` | 1 | from 1 | that step the robots; no result depends on it |
| `autoreset` | True | False, True | whether a walk that is over begins anew, or waits for a reset |

`reset(options={{"disturbances": ..., "scenario": "S2"}})` replaces the disturbances of this and the following
episodes, by a mapping or by those of a named scenario. The option `"reset_mask"` (n,) says where to reset.

## Many at once
This is for `gym.make_vec(..., vectorization_mode="vector_entry_point")`: each robot does the same to the bit as the one
of `gym.make(..., engine="mujoco")` with the same seed and the same actions, whatever the number of robots and of
threads. Each has a generator of its own. A walk that is over begins anew with the next step, which ignores its action
(Gymnasium's next-step autoreset); with `autoreset=False` it waits, unmoved, until a reset whose mask it is in.

## Info
As Gymnasium's vector environments give it, every entry `x` with a mask `_x`: `time_s`, `reward_terms`, `foot_loads`
(normal force on each foot, N) (n, 2); where a walk begins `disturbances` (an array of mappings); `events` (of lists);
`fall_reason` (of words)."""
)

COLUMNS = task.OBSERVATION.slices
PLAN = slice(COLUMNS["q_ref"].start, COLUMNS["qdd_ref"].stop)
CLOCK = slice(COLUMNS["load_left_ref"].start, COLUMNS["phase"].stop)
BASE = slice(COLUMNS["base_height"].start, COLUMNS["base_angular_velocity"].stop)

_ARCTANGENT, _ARCSINE, _EXP = each(math.atan2), each(arcsine), each(math.exp)


class BipedVectorEnv(BatchEnv):
    """What all tasks of many robots share; a subclass says what disturbs the walk by default.

    Args:
        num_envs: number of robots.
        engine: "mujoco".
        threads: that step the robots.
        autoreset: whether a walk that is over begins anew by itself.
        disturbances: as all further arguments, see `artde_gym.envs.biped.BipedEnv`.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    default_disturbances: ClassVar[Mapping[str, Any]] = {}
    action_layout = task.ACTION
    robot_name: ClassVar[str] = "ojas"
    tracking = task.TRACKING
    reward_scales = task.REWARD_SCALES
    fall_reasons = task.FALL_REASONS
    allowed_action = "torques (Nm)"

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
        engine: Literal["mujoco"] = "mujoco",
        threads: int = 1,
        autoreset: bool = True,
    ) -> None:
        if isinstance(threads, bool) or not (isinstance(threads, int) and threads >= 1):
            raise OptionError("threads", threads, "a whole number >= 1")
        self.observe_ground_force = observe_ground_force
        self.observation_layout = task.observation_layout(observe_ground_force)
        super().__init__(num_envs, autoreset=autoreset)
        walk = self._walk = task.Walk.of(
            control_period, actuator_inertia, arms, self_collision, speed, step_duration, duration
        )
        self.nominal_robot, self.pattern, self.control_period = walk.nominal_robot, walk.pattern, walk.control_period
        self._last = walk.last
        self._disturbances = self._parse(self.default_disturbances if disturbances is None else disturbances)
        self.engine_name = engine
        self._batch = make_batch(engine, walk.robot, num_envs, task.TIME_STEP, threads)
        self._courses: dict[int, Course] = {}
        self._wakes = np.full(num_envs, NEVER)  # time step of each walk in which its course is to be asked again
        self._sensing: dict[int, Sensing] = {}  # where sensors err
        self._readings: dict[int, Array] = {}  # what they measured last
        self._tau = self._previous = np.zeros((num_envs, task.N_JOINTS))
        first = np.zeros(1, np.int32)
        self._batch.worlds[0].set_friction(task.FRICTION)
        self._batch.place(0, walk.position, walk.start)
        self._still = self._settle(first, walk.start[None], task.SETTLE_STEPS)[0]
        self._settled = self._batch.snapshot(0)

    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        return self._walk.parse(disturbances)

    def _start(self, drawn: Mapping[int, Mapping[str, Any]]) -> None:
        batch, walk = self._batch, self._walk
        batch.restore(np.fromiter(drawn, np.int32), self._settled)
        self._tau = self._tau.copy()
        restless: dict[int, list[int]] = {}
        for i, realised in drawn.items():
            walk.set_up(batch.worlds[i], realised)
            course = self._courses[i] = Course(realised, walk, self._np_random[i])
            course.start(batch.worlds[i])
            self._wakes[i] = course.wakes(0)
            self._sensing.pop(i, None)
            if course.sensing is not None:
                self._sensing[i] = course.sensing
            self._tau[i] = self._still
            if steps := task.settling(realised):
                restless.setdefault(steps, []).append(i)
        for steps, some in restless.items():
            poses = np.array([walk.pose(drawn[i]) for i in some])
            self._tau[some] = self._settle(np.array(some, np.int32), poses, steps)
        for i in drawn:
            self._courses[i].settled(self._tau[i].copy())

    def _settle(self, some: NDArray[np.int32], poses: Array, steps: int) -> Array:
        """Let some robots stand still in `poses` (n, 12) (rad) for so many time steps; returns their last torques."""
        tau = np.zeros_like(poses)
        for _ in range(steps):
            tau = self._walk.hold(poses, *self._batch.joints(some))
            self._batch.step(tau, some)
        return np.clip(tau, -robot.TORQUE_LIMIT, robot.TORQUE_LIMIT)

    def _advance(self, commands: Array, goes_on: Mask) -> dict[int, list[str]]:
        if not goes_on.all():
            np.copyto(commands, self._tau, where=~goes_on[:, None])
        self._previous, self._tau = self._tau, commands
        steps = self._walk.substeps
        awake = goes_on & (self._wakes < (self._k + 1) * steps)
        if not awake.any():
            self._step(commands, goes_on, steps)
            return {}
        if steps > 1:
            self._step(commands, goes_on & ~awake, steps)
        return self._disturbed(commands, awake, goes_on if steps == 1 else awake)

    def _disturbed(self, commands: Array, awake: Mask, some: Mask) -> dict[int, list[str]]:
        """Advance `some` robots by a control period in which something happens to those that are `awake`.

        What acts on these takes the place of what was commanded. Returns events.
        """
        steps, torques = self._walk.substeps, commands.copy()
        happening = [(i, self._courses[i], int(self._k[i]) * steps) for i in np.flatnonzero(awake).tolist()]
        events: dict[int, list[str]] = {i: [] for i, _, _ in happening}
        for i, course, _ in happening:
            course.begin(commands[i].copy())
        for step in range(steps):
            for i, course, first in happening:
                torques[i] = course.act(first + step, self._batch.worlds[i], events[i])
            self._step(torques, some, 1)
        for i, course, first in happening:
            commands[i] = course.applied()
            self._wakes[i] = course.wakes(first + steps)
        return {i: words for i, words in events.items() if words}

    def _step(self, torques: Array, some: Mask, steps: int) -> None:
        """Advance some robots by so many time steps under their rows of `torques`."""
        if some.all():
            self._batch.step(torques, steps=steps)
        else:
            worlds = np.flatnonzero(some).astype(np.int32)
            self._batch.step(torques[worlds], worlds, steps)

    def _truth(self) -> Array:
        state = self._state = self._batch.read()
        with np.errstate(invalid="ignore", over="ignore"):  # of a robot that has diverged
            self._tilt = roll_pitch(state.quat_xyzw, _ARCTANGENT, _ARCSINE)
        out = np.empty((self.num_envs, self.observation_layout.size))
        out[:, COLUMNS["q"]], out[:, COLUMNS["qd"]] = state.q, state.qd
        plan = self._walk.plan[self._k]
        out[:, PLAN], out[:, CLOCK] = plan[:, :-2], plan[:, -2:]
        out[:, COLUMNS["tau_applied"]] = self._tau
        base = (state.position[2], *self._tilt, *state.velocity, *state.angular_velocity)
        out[:, BASE] = np.stack(base, axis=1)
        out[:, COLUMNS["contact"]] = self._batch.foot_loads() > LOADED
        if self.observe_ground_force:
            out[:, CLOCK.stop :] = self._batch.ground_forces()
        return out

    def _measure(self, observations: Array, new: Mask) -> None:
        for i, sensing in self._sensing.items():
            if new[i]:
                self._readings[i] = sensing.disturb(observations[i]).copy()
            else:
                observations[i] = self._readings[i]

    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        state, tau, (roll, pitch) = self._state, self._tau, self._tilt
        with np.errstate(invalid="ignore", over="ignore"):  # likewise
            error = truth[:, COLUMNS["q_ref"]] - state.q
            change = tau - self._previous
            squares = _square(error), roll * roll + pitch * pitch, _square(tau), _square(change)
            terms = task.reward_terms(*squares, _EXP)
            return terms, task.falls(state.quat_xyzw, state.position[2], _square(state.qd))

    def _tell(self) -> dict[str, Array]:
        return {"foot_loads": self._batch.foot_loads().copy()}


def _square(vectors: Array) -> Array:
    """Squared norms of vectors (n, size), each summed as that of a single one is."""
    return np.vecdot(vectors, vectors)


def document(default: str) -> Callable[[type[BipedVectorEnv]], type[BipedVectorEnv]]:
    """Class decorator: fill the sections that all tasks share into a docstring, at `{shared}`."""
    return filled(shared=_PAGE.format(observation=task.OBSERVATION.table(), default=default))
