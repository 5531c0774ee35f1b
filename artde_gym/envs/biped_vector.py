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
from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.effects import Effects, load_base
from artde_gym.disturbances.ground import LOADED, GrfPulses
from artde_gym.disturbances.loads import RobotStates
from artde_gym.disturbances.schedule import NEVER
from artde_gym.disturbances.sensing import Sensing
from artde_gym.envs.biped_disturbances import EpisodeDisturbances
from artde_gym.envs.documentation import filled
from artde_gym.envs.options import warn_of_idle
from artde_gym.envs.vector import BaseVectorEnv, Mask
from artde_gym.errors import OptionError
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas import task
from artde_gym.robots.ojas.model import ActuatorInertia
from artde_gym.sim.factory import make_batch
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


class BipedVectorEnv(BaseVectorEnv):
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

    default_disturbances: ClassVar[Mapping[str, Any]] = {}
    action_layout = task.ACTION
    robot_name: ClassVar[str] = "ojas"
    metrics_spec = task.METRICS_SPEC
    reward_scales = task.REWARD_SCALES
    fall_reasons = task.FALL_REASONS
    allowed_action = "torques (Nm)"
    own_engine = "mujoco"

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
        if isinstance(threads, bool) or not (isinstance(threads, int) and threads >= 1):
            raise OptionError("threads", threads, "a whole number >= 1")
        self.observe_ground_force = observe_ground_force
        self.observation_layout = task.observation_layout(observe_ground_force)
        super().__init__(
            num_envs,
            engine=engine,
            render_mode=render_mode,
            autoreset_mode=autoreset_mode,
            max_episode_steps=max_episode_steps,
        )
        walk = self._walk = task.Walk.of(
            control_period, actuator_inertia, arms, self_collision, speed, step_duration, duration
        )
        self.nominal_robot, self.control_period = walk.nominal_robot, walk.control_period
        self._last, self.words = min(walk.last, self._limit or walk.last), walk.words
        self._disturbances = self._parse(self.default_disturbances if disturbances is None else disturbances)
        warn_of_idle(self._disturbances, self._last * self.control_period)
        self._batch = make_batch("mujoco", walk.robot, num_envs, task.TIME_STEP, threads)
        self._active: dict[int, EpisodeDisturbances] = {}
        self._next_event = np.full(num_envs, NEVER)  # time step of each walk's next disturbance event
        self._pulses: GrfPulses | None = None
        self._pulsed = np.zeros(num_envs, np.bool_)  # robots with ground reaction pulses
        self._effects = Effects(num_envs, self.words)
        self._sensing: dict[int, Sensing] = {}  # robots with sensor errors
        self._readings: dict[int, Array] = {}  # their last measurements
        self._tau = self._previous = np.zeros((num_envs, task.N_JOINTS))
        self._high = np.full((num_envs, task.N_JOINTS), robot.TORQUE_LIMIT)
        self._low = -self._high
        first = np.zeros(1, np.int32)
        self._batch.worlds[0].set_friction(task.FRICTION)
        self._batch.reset(0, walk.position, walk.start)
        self._known: dict[bytes, tuple[Any, Array]] = {}  # settled robots and their torques
        self._still = self._settle(first, walk.start[None], task.SETTLE_STEPS)[0]
        self._settled = self._batch.save_state(0)

    def _parse(self, disturbances: Mapping[str, Any]) -> Disturbances:
        return self._walk.parse(disturbances)

    def _start(self, drawn: Mapping[int, Mapping[str, Any]]) -> None:
        batch, walk = self._batch, self._walk
        batch.restore_state(np.fromiter(drawn, np.int32), self._settled)
        self._tau = self._tau.copy()
        restless: dict[int, list[int]] = {}
        for i, sampled in drawn.items():
            walk.set_up(batch.worlds[i], sampled)
            self._high[i] = task.torque_limit(sampled)
            self._low[i] = -self._high[i]
            active = self._active[i] = EpisodeDisturbances(sampled, walk, self._np_random[i])
            active.start(batch.worlds[i])
            self._begin_pulses(i, sampled.get("grf_pulse"))
            self._effects.begin(i, sampled)
            self._next_event[i] = active.next_event_step(0)
            self._sensing.pop(i, None)
            if active.sensing is not None:
                self._sensing[i] = active.sensing
            self._tau[i] = self._still
            if steps := task.settling(sampled):
                restless.setdefault(steps, []).append(i)
        for steps, some in restless.items():
            self._settle_alike({i: drawn[i] for i in some}, steps)
        for i in drawn:
            self._active[i].begin_walk(self._tau[i].copy())

    def _settle_alike(self, drawn: Mapping[int, Mapping[str, Any]], steps: int) -> None:
        """Let robots settle, one for all that are disturbed alike; those known from an earlier reset not at all."""
        alike: dict[bytes, list[int]] = {}
        for i, sampled in drawn.items():
            alike.setdefault(task.settled_by(sampled), []).append(i)
        new = {key: robots[0] for key, robots in alike.items() if key not in self._known}
        if new:
            some = [*new.values()]
            poses = np.array([self._walk.pose(drawn[i]) for i in some])
            last = self._settle(np.array(some, np.int32), poses, steps)
            self._known |= {key: (self._batch.motion(i), tau) for (key, i), tau in zip(new.items(), last, strict=True)}
        for key, robots in alike.items():
            motion, self._tau[robots] = self._known[key]
            self._batch.set_motion(np.array(robots, np.int32), motion)
        for key in [*self._known][:-KNOWN]:
            del self._known[key]

    def _begin_pulses(self, i: int, entry: Mapping[str, Any] | None) -> None:
        if entry is not None and self._pulses is None:
            self._pulses = self._walk.pulses(self.num_envs)
        if self._pulses is not None:
            self._pulses.begin(i, entry, self.nominal_robot)
        self._pulsed[i] = entry is not None

    def _settle(self, some: NDArray[np.int32], poses: Array, steps: int) -> Array:
        """Let some robots stand still in `poses` (n, 12) (rad) for `steps` time steps; return their last torques."""
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
        awake = goes_on & (self._next_event < (self._k + 1) * steps)
        busy = awake | (goes_on & (self._pulsed | self._effects.acting))
        if not busy.any():
            self._step(commands, goes_on, steps)
            return {}
        if steps > 1:
            self._step(commands, goes_on & ~busy, steps)
        return self._disturbed(commands, awake, goes_on if steps == 1 else busy)

    def _disturbed(self, commands: Array, awake: Mask, some: Mask) -> dict[int, list[str]]:
        """Advance `some` robots by a control period in which disturbances act on those in `awake`.

        The torques that act on these replace the commanded ones. Return the events.
        """
        steps, torques = self._walk.substeps, commands.copy()
        happening = [(i, self._active[i], int(self._k[i]) * steps) for i in np.flatnonzero(awake).tolist()]
        events: dict[int, list[str]] = {i: [] for i, _, _ in happening}
        for i, active, _ in happening:
            active.begin_period(commands[i].copy())
        for step in range(steps):
            for i, active, first in happening:
                torques[i] = active.apply(first + step, self._batch.worlds[i], events[i])
            if self._pulses is not None:
                forces = self._pulses.forces(self._batch.foot_loads(), self._k * steps + step)
                self._batch.lift_feet(forces * some[:, None])
            self._step(self._affected(torques, some, step), some, 1)
        for i, active, first in happening:
            commands[i] = active.applied()
            self._next_event[i] = active.next_event_step(first + steps)
        return {i: words for i, words in events.items() if words}

    def _affected(self, torques: Array, some: Mask, step: int) -> Array:
        """Apply the effects to the bases of `some` robots; return the torques with those of the effects added."""
        acting = some & self._effects.acting
        if not acting.any():
            return torques
        load = self._effects.load(self._states(self._k * self._walk.substeps + step))
        for i in np.flatnonzero(acting).tolist():
            load_base(self._batch.worlds[i], load, i)
        if load.tau is not None:
            torques = torques.copy()
            torques[acting] += load.tau[acting]
        return torques

    def _states(self, steps: NDArray[np.int64]) -> RobotStates:
        """Return the states of all robots after `steps` (n,) time steps."""
        with np.errstate(invalid="ignore", over="ignore"):  # of a robot that has diverged
            state = self._batch.state()
        of_base = (state.position, state.quat_xyzw, state.velocity, state.angular_velocity)
        base = (np.stack(parts, axis=1) for parts in of_base)
        return RobotStates(steps * task.TIME_STEP, state.q, state.qd, *base)

    def _step(self, torques: Array, some: Mask, steps: int) -> None:
        """Advance some robots by `steps` time steps under their rows of `torques`."""
        if some.all():
            self._batch.step(torques, steps=steps)
        else:
            worlds = np.flatnonzero(some).astype(np.int32)
            self._batch.step(torques[worlds], worlds, steps)

    def _truth(self) -> Array:
        state = self._state = self._batch.state()
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
        with np.errstate(invalid="ignore", over="ignore"):  # of a robot that has diverged
            error = truth[:, COLUMNS["q_ref"]] - state.q
            change = tau - self._previous
            squares = _square(error), roll * roll + pitch * pitch, _square(tau), _square(change)
            terms = task.reward_terms(*squares, _EXP)
            return terms, task.falls(state.quat_xyzw, state.position[2], _square(state.qd))

    def _tell(self) -> dict[str, Array]:
        return {"foot_loads": self._batch.foot_loads().copy()}


def _square(vectors: Array) -> Array:
    """Return squared norms of vectors (n, size), summed in the same order as for a single vector."""
    return np.vecdot(vectors, vectors)


def document(default: str) -> Callable[[type[BipedVectorEnv]], type[BipedVectorEnv]]:
    """Return a class decorator that inserts the sections shared by all tasks at `{shared}` in a docstring."""
    return filled(shared=_PAGE.format(observation=task.OBSERVATION.table(), default=default))
