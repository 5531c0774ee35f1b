"""`QuadInfinity-Payload-v0` for many vehicles at once in NumPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import numpy as np
from gymnasium.vector import AutoresetMode

from artde_gym.arguments import known_arguments, steps_per_period
from artde_gym.arrays import Array
from artde_gym.disturbances.noise import draw_keys
from artde_gym.disturbances.wind import GRID
from artde_gym.envs.documentation import filled
from artde_gym.envs.quadrotor_batch_sim import QuadrotorBatchSim
from artde_gym.envs.quadrotor_sensors import Measurement, Sensors
from artde_gym.envs.vector import BaseVectorEnv, Mask
from artde_gym.errors import OptionError
from artde_gym.robots.q450 import model as robot
from artde_gym.robots.q450 import task

FLEET = 4096  # vehicles simulated together; larger arrays do not fit into caches


@filled(shared=task.DOCUMENTATION)
class QuadInfinityPayloadVectorEnv(BaseVectorEnv):
    """Many quadrotors at once fly an infinity-shaped path with a payload, drop it, and fly the path again.

    ## Description
    The task of `artde_gym.envs.quadrotor` for `gym.make_vec(..., vectorization_mode="vector_entry_point")`, with the
    same layouts, disturbances, seeds and winds, but rigid bodies in NumPy instead of an engine (within 1 mm after
    10 s). Vehicle and payload are one rigid body until the drop. Each environment has its own random generator, and
    its results are bitwise independent of the number of environments.

    A finished flight restarts with the next step, which ignores its action; with `autoreset_mode="SameStep"` it
    restarts in the same step, with its last observation and info in `info["final_obs"]` and `info["final_info"]`; with
    `"Disabled"` it stays as it is until a reset whose mask (option `"reset_mask"`, (n,)) includes it.
    Observations are a transposed array, (size, n) in memory, so that each component is contiguous.

    {shared}
    | `num_envs` | 1 | from 1 | number of vehicles |
    | `dtype` | "float64" | "float64", "float32" | data type of all numbers, including observations and actions |
    | `engine` | None | None, "numpy" | physics engine; None warns that `gym.make` uses another one |
    | `autoreset_mode` | "NextStep" | "NextStep", "SameStep", "Disabled" | Gymnasium's `AutoresetMode` |
    | `max_episode_steps` | None | from 1 | steps after which a flight is truncated, if its duration is longer |
    | `render_mode` | None | None | use `vectorization_mode="sync"` to render |

    ## Info
    As in the single environment, each entry `x` with a mask `_x` (n,), in nested dictionaries too: numbers and
    Booleans (n,), arrays (n, ...). `env.unwrapped.sampled_disturbances` is a list.

    ## Versions
    * v0: first version.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    order = "F"
    action_layout = task.ACTION
    observation_layout = task.OBSERVATION
    robot_name: ClassVar[str] = "q450"
    metrics_spec = task.METRICS_SPEC
    reward_scales: ClassVar[Mapping[str, float]] = task.REWARD_SCALES
    default_disturbances: ClassVar[Mapping[str, Any]] = task.DEFAULT_DISTURBANCES
    lift: ClassVar[float] = 0.0
    fall_reasons: ClassVar[Sequence[str]] = task.FALL_REASONS
    allowed_action = "[u1 (N), u2, u3, u4 (Nm)]"
    own_engine = "numpy"
    words = task.WORDS

    @known_arguments
    def __init__(
        self,
        num_envs: int = 1,
        *,
        disturbances: Mapping[str, Any] | None = None,
        control_period: float = 0.015,
        measurement: Measurement = "ideal",
        duration: float = 70.0,
        dtype: Literal["float64", "float32"] = "float64",
        engine: Literal["numpy"] | None = None,
        render_mode: None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
    ) -> None:
        if dtype not in ("float64", "float32"):
            raise OptionError("dtype", dtype, "'float64', 'float32'")
        super().__init__(
            num_envs,
            dtype,
            engine=engine,
            render_mode=render_mode,
            autoreset_mode=autoreset_mode,
            max_episode_steps=max_episode_steps,
        )
        steps = steps_per_period(control_period, GRID)
        self.control_period = steps * GRID
        self.measurement = measurement
        self.duration = duration
        self._sensors = Sensors(num_envs, measurement, self.control_period, self.dtype, self.observation_layout)
        self.nominal_robot = robot.q450()
        self._plan = np.ascontiguousarray(task.plan(duration, self.control_period, self.lift).T, dtype=self.dtype)
        self._set_episodes(self._plan.shape[1] - 1, disturbances)
        sizes = [min(FLEET, num_envs - first) for first in range(0, num_envs, FLEET)]
        self._fleets = [
            (slice(first, first + size), QuadrotorBatchSim(size, steps, self.dtype, self.lift))
            for first, size in zip(range(0, num_envs, FLEET), sizes, strict=True)
        ]
        self._before: list[Array] = []  # thrusts of each fleet one control period ago

    def _start(self, drawn: Mapping[int, Mapping[str, Any]]) -> None:
        keys = np.array([draw_keys(self._np_random[i], task.STREAMS) for i in drawn])
        vehicles, sampled = np.fromiter(drawn, np.intp, len(drawn)), list(drawn.values())
        for part, fleet in self._fleets:
            rows = slice(*np.searchsorted(vehicles, [part.start, part.stop]).tolist())
            if sampled[rows]:
                fleet.begin(vehicles[rows] - part.start, sampled[rows], keys[rows, 0])
        for i, own, some in zip(drawn, sampled, keys[:, 1:], strict=True):
            self._sensors.begin(i, own, some)

    def _advance(self, commands: Array, goes_on: Mask) -> dict[int, list[str]]:
        self._before = [fleet.thrusts for _, fleet in self._fleets]
        waits = self.autoreset_mode is AutoresetMode.DISABLED and not goes_on.all()
        events: dict[int, list[str]] = {}
        for part, fleet in self._fleets:
            still = np.flatnonzero(~goes_on[part]) if waits else np.zeros(0, np.int64)
            motion = fleet.motion(still) if still.size else []
            told = fleet.advance(commands[part].T).items()
            if motion:
                fleet.stop(still, motion)
            events.update((part.start + vehicle, words) for vehicle, words in told if goes_on[part.start + vehicle])
        return events

    def _end(self, ended: Mask) -> None:
        for i in np.flatnonzero(ended).tolist():
            part, fleet = self._fleets[i // FLEET]
            fleet.rest(i - part.start)

    def _truth(self) -> Array:
        out = np.empty((self.observation_layout.size, self.num_envs), self.dtype)
        together = self._k.min() == self._k.max()
        for part, fleet in self._fleets:
            block, bodies = out[:, part], fleet.bodies
            block[task.POSITION] = bodies.origin()
            block[task.VELOCITY] = bodies.origin_velocity()
            block[task.ROT] = bodies.rot.reshape(9, -1)
            block[task.RATES] = bodies.rates
            plan = self._plan[:, self._k[:1]] if together else self._plan.take(self._k[part], axis=1)
            block[task.REFERENCE] = plan[:-1]
            block[task.WRENCH] = fleet.wrenches
            block[task.THRUST] = fleet.thrusts
            block[task.PHASE] = plan[-1]
            self._look(block, fleet)
        return out.T

    def _look(self, block: Array, fleet: QuadrotorBatchSim) -> None:
        """Fill in what else is observed of a fleet."""

    def _measure(self, observations: Array, new: Mask) -> None:
        if not self._sensors.ideal:
            self._sensors.measure(observations.T, self._k, None if new.all() else new)

    def _score(self, truth: Array) -> tuple[dict[str, Array], Sequence[Mask]]:
        terms = {name: np.empty(self.num_envs, self.dtype) for name in task.REWARD_SCALES}
        falls = np.empty((len(task.FALL_REASONS), self.num_envs), np.bool_)
        for (part, fleet), thrusts in zip(self._fleets, self._before, strict=True):
            block = truth.T[:, part]
            error = block[task.OBSERVATION["position_ref"]] - block[task.POSITION]
            velocity_error = block[task.OBSERVATION["velocity_ref"]] - block[task.VELOCITY]
            up = fleet.bodies.rot[2, 2]
            change = fleet.thrusts - thrusts
            own = task.reward_terms(
                square(error), square(velocity_error), up, square(fleet.thrusts), square(change), np.exp
            )
            for name, values in own.items():
                terms[name][part] = values
            x, y, z = block[task.POSITION]
            falls[:, part] = task.falls((x, y, z), up, square(block[task.RATES]))
        return terms, list(falls)


def square(vectors: Array) -> Array:
    """Return squared norms of vectors (size, n), summed in a fixed order."""
    squares = vectors * vectors
    total = squares[0]
    for component in squares[1:]:
        total += component
    return total
