"""`QuadInfinity-Payload-v0`, many vehicles at once in NumPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.noise import draw_keys
from artde_gym.disturbances.wind import GRID
from artde_gym.envs import quadrotor_task as task
from artde_gym.envs.documentation import filled
from artde_gym.envs.options import disturbances_in, steps_per_period
from artde_gym.envs.quadrotor_fleet import Fleet
from artde_gym.envs.quadrotor_sensors import Measurement, Sensors
from artde_gym.errors import ActionError, OptionError
from artde_gym.robots import q450 as robot

FLEET = 4096  # vehicles that are simulated together; with more, arrays no longer fit into caches

Mask = NDArray[np.bool_]


@filled(shared=task.DOCUMENTATION)
class QuadInfinityPayloadVectorEnv(VectorEnv[Array, ArrayLike, NDArray[Any]]):
    """Many quadrotors at once fly an infinity-shaped path with a payload, drop it half-way, and fly it once more.

    ## Description
    The task of `artde_gym.envs.quadrotor`, for `gym.make_vec(..., vectorization_mode="vector_entry_point")`: same
    layouts, disturbances, seeds and winds, with rigid bodies in NumPy in place of an engine (within 1 mm after 10 s).
    Vehicle and payload are one rigid body until the drop. An environment does the same to the bit whatever the number
    of environments beside it. Each has a generator of its own.

    A flight that is over begins anew with the next step, which ignores its action (Gymnasium's next-step autoreset).
    Observations are a transposed array, (size, n) in memory, so that each component is contiguous.

    {shared}
    | `num_envs` | 1 | from 1 | number of vehicles |
    | `dtype` | "float64" | "float64", "float32" | of all numbers, observations and actions included |

    ## Info
    As Gymnasium's vector environments give it, every entry `x` with a mask `_x`: `time_s`, `reward_terms`; where a
    flight begins `disturbances` (an array of mappings); `events` (of lists); `fall_reason` (of words).

    ## Versions
    * v0: first version.

    Raises:
        OptionError: for an argument out of range.
        DisturbanceError: for a malformed disturbance.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    action_layout = task.ACTION
    observation_layout = task.OBSERVATION
    robot_name: ClassVar[str] = "q450"
    tracking = task.TRACKING
    _np_random: Any  # a list: one for each environment, as for the seeds
    _np_random_seed: Any

    def __init__(
        self,
        num_envs: int = 1,
        *,
        disturbances: Mapping[str, Any] | None = None,
        control_period: float = 0.015,
        measurement: Measurement = "ideal",
        duration: float = 70.0,
        dtype: Literal["float64", "float32"] = "float64",
    ) -> None:
        if isinstance(num_envs, bool) or not (isinstance(num_envs, int) and num_envs >= 1):
            raise OptionError("num_envs", num_envs, "a whole number >= 1")
        if dtype not in ("float64", "float32"):
            raise OptionError("dtype", dtype, "'float64', 'float32'")
        self.num_envs = num_envs
        self.dtype = np.dtype(dtype)
        self._disturbances = task.parse(task.DEFAULT_DISTURBANCES if disturbances is None else disturbances)
        steps = steps_per_period(control_period, GRID)
        self.control_period = steps * GRID
        self.measurement = measurement
        self.duration = duration
        self._sensors = Sensors(num_envs, measurement, self.control_period, self.dtype)
        self.nominal_robot = robot.q450()
        self._plan = np.ascontiguousarray(task.plan(duration, self.control_period).T, dtype=self.dtype)
        self._last = self._plan.shape[1] - 1
        self.single_observation_space = task.OBSERVATION.box(self.dtype)
        self.single_action_space = task.ACTION.box(self.dtype)
        self._low, self._high = self.single_action_space.low[:, None], self.single_action_space.high[:, None]
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        sizes = [min(FLEET, num_envs - first) for first in range(0, num_envs, FLEET)]
        self._fleets = [
            (slice(first, first + size), Fleet(size, steps, self.dtype))
            for first, size in zip(range(0, num_envs, FLEET), sizes, strict=True)
        ]
        seeded = [seeding.np_random() for _ in range(num_envs)]
        self._np_random, self._np_random_seed = map(list, zip(*seeded, strict=True))
        self._k = np.zeros(num_envs, np.int64)
        self._over: Mask | None = None  # where the next step begins a new flight; None before the first reset

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute, once for each environment."""
        return (getattr(self, name),) * self.num_envs

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start flights.

        Args:
            seed: one for each environment, or a number from which on they count; without, the generators go on.
            options: those of the class' documentation, and Gymnasium's "reset_mask" (n,), where to reset.

        Raises:
            OptionError: for an unknown option or value, or a scenario that needs another environment.
            DisturbanceError: for a malformed disturbance.
        """
        options = dict(options or {})
        mask = self._mask(options.pop("reset_mask", None))
        seeds = self._seeds(seed)
        disturbances = disturbances_in(options, self)
        if disturbances is not None:
            self._disturbances = task.parse(disturbances)
        for i in np.flatnonzero(mask).tolist():
            if seeds[i] is not None:
                self._np_random[i], self._np_random_seed[i] = seeding.np_random(seeds[i])
        info = {**self._begin(mask), "time_s": self._k * self.control_period, "_time_s": mask.copy()}
        self._over = np.zeros(self.num_envs, np.bool_) if self._over is None else self._over & ~mask
        return self._measured(self._truth()).T, info

    def step(self, actions: ArrayLike) -> tuple[Array, Array, Mask, Mask, dict[str, Any]]:
        """Apply wrenches for one control period; flights that were over begin anew instead.

        Raises:
            ActionError: for a wrong shape, or a value that is not finite in a flight that goes on.
            gymnasium.error.ResetNeeded: before the first reset.
        """
        if self._over is None:
            raise gym.error.ResetNeeded("the flights have not begun: call reset()")
        over, commands = self._over, self._commands(actions)
        before = [fleet.thrusts for _, fleet in self._fleets]
        events: dict[int, list[str]] = {}
        for part, fleet in self._fleets:
            told = fleet.advance(commands[:, part]).items()
            events.update((part.start + vehicle, words) for vehicle, words in told if not over[part.start + vehicle])
        self._k += 1
        info = {**self._begin(over), "time_s": self._k * self.control_period, "_time_s": np.ones_like(over)}
        observation = self._truth()
        rewards, terms, reasons = self._score(observation, before)
        observation = self._measured(observation)
        rewards[over] = 0.0
        goes_on = ~over
        terminated = (reasons != 0) & goes_on
        truncated = (self._k >= self._last) & goes_on
        self._over = terminated | truncated
        info["reward_terms"] = {**terms, **{f"_{name}": goes_on.copy() for name in terms}}
        info["_reward_terms"] = goes_on
        if terminated.any():
            words = {i: task.FALL_REASONS[reasons[i] - 1] for i in np.flatnonzero(terminated).tolist()}
            info["fall_reason"], info["_fall_reason"] = self._objects(words)
        if events:
            info["events"], info["_events"] = self._objects(events)
        return observation.T, rewards, terminated, truncated, info

    def _commands(self, actions: ArrayLike) -> Array:
        """Checked actions as an array of ours (4, n)."""
        given = np.asarray(actions)
        if given.shape != (self.num_envs, 4):
            raise ActionError("shape of the actions", given.shape, f"({self.num_envs}, 4)")
        with np.errstate(over="ignore"):  # of a cast to float32
            commands = np.array(given.T, dtype=self.dtype, order="C")
        commands[:, self._over] = 0.0
        if not np.isfinite(commands).all():
            i = int(np.flatnonzero(~np.isfinite(commands).all(axis=0))[0])
            raise ActionError(f"action of environment {i}", given[i].tolist(), "finite [u1 (N), u2, u3, u4 (Nm)]")
        return np.clip(commands, self._low, self._high, out=commands)

    def _mask(self, given: Any) -> Mask:
        if given is None:
            return np.ones(self.num_envs, np.bool_)
        mask = np.asarray(given)
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
            raise OptionError("reset_mask", given, f"({self.num_envs},) truth values, one of them true at least")
        if self._over is None and not mask.all():
            raise OptionError("reset_mask", given, "all true in the first reset")
        return mask

    def _seeds(self, given: int | Sequence[int | None] | None) -> list[int | None]:
        if given is None:
            return [None] * self.num_envs
        if isinstance(given, (int, np.integer)):
            return [int(given) + i for i in range(self.num_envs)]
        if len(given) != self.num_envs:
            raise OptionError("number of seeds", len(given), f"{self.num_envs}, one for each environment")
        return [None if seed is None else int(seed) for seed in given]

    def _begin(self, mask: Mask) -> dict[str, Any]:
        """Begin new flights where the mask is true; returns what is to be told of them."""
        if not mask.any():
            return {}
        drawn: dict[int, Mapping[str, Any]] = {}
        for part, fleet in self._fleets:
            for vehicle in np.flatnonzero(mask[part]).tolist():
                i = part.start + vehicle
                drawn[i] = self._disturbances.draw(self._np_random[i])
                keys = draw_keys(self._np_random[i], task.STREAMS)
                fleet.begin(vehicle, drawn[i], keys[0])
                self._sensors.begin(i, drawn[i], keys[1:])
        self._k[mask] = 0
        values, known = self._objects(drawn)
        return {"disturbances": values, "_disturbances": known}

    def _objects(self, known: Mapping[int, Any]) -> tuple[NDArray[Any], Mask]:
        """What is known of some environments as an array, and the mask of these."""
        values, mask = np.full(self.num_envs, None, dtype=object), np.zeros(self.num_envs, np.bool_)
        for i, value in known.items():
            values[i], mask[i] = value, True
        return values, mask

    def _truth(self) -> Array:
        """The observation without errors of measurement (size, n)."""
        out = np.empty((task.OBSERVATION.size, self.num_envs), self.dtype)
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
        return out

    def _measured(self, truth: Array) -> Array:
        """What the sensors make of it, in place."""
        if not self._sensors.ideal:
            self._sensors.measure(truth, self._k)
        return truth

    def _score(self, truth: Array, before: Sequence[Array]) -> tuple[Array, dict[str, Array], NDArray[np.int8]]:
        """Rewards, their terms, and the number of the reason of a fall, counted from 1, 0 without one; all (n,)."""
        terms = {name: np.empty(self.num_envs, self.dtype) for name in task.REWARD_SCALES}
        rewards, reasons = np.empty(self.num_envs), np.zeros(self.num_envs, np.int8)
        for (part, fleet), thrusts in zip(self._fleets, before, strict=True):
            block = truth[:, part]
            error = block[task.OBSERVATION["position_ref"]] - block[task.POSITION]
            velocity_error = block[task.OBSERVATION["velocity_ref"]] - block[task.VELOCITY]
            up = fleet.bodies.rot[2, 2]
            change = fleet.thrusts - thrusts
            own = task.reward_terms(
                _square(error), _square(velocity_error), up, _square(fleet.thrusts), _square(change), np.exp
            )
            total: Any = 0.0
            for name, scale in task.REWARD_SCALES.items():
                total = total + scale * own[name]
                terms[name][part] = own[name]
            rewards[part] = self.control_period * total
            x, y, z = block[task.POSITION]
            falls = task.falls((x, y, z), up, _square(block[task.RATES]))
            for number in range(len(falls), 0, -1):  # the first reason wins
                reasons[part][falls[number - 1]] = number
        return rewards, terms, reasons


def _square(vectors: Array) -> Array:
    """Squared norms of vectors (size, n), the order of the sum fixed."""
    squares = vectors * vectors
    total = squares[0]
    for component in squares[1:]:
        total += component
    return total
