"""Moving air: a steady wind, ambient air and the jet of a fan.

w = scale (steady + ambient + direction fan_speed exp(-r^2 / 2 fan_radius^2) (1 + turbulence))

r is the distance from the jet's axis. The three components of `ambient` and `turbulence` are Ornstein-Uhlenbeck
processes that start at zero, discretized exactly on a grid of `GRID`:

x_{k+1} = x_k exp(-GRID / T) + std sqrt(1 - exp(-2 GRID / T)) n_k        n white, mean 0, variance 1

so that the wind depends on neither control period nor physics step. The noise is uniform: the process has the same
mean, variance and correlation as with normal noise, and a nearly normal distribution (excess kurtosis -0.06 for
T = 0.1 s). Everything here is elementwise, on plain numbers for one vehicle or on arrays for many.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances.noise import uniform_noise

GRID = 0.005  # s
BLOCK_SIZE = 400  # grid points whose noise is generated at once for one vehicle

Number = TypeVar("Number", float, Array)
Vector3 = tuple[Number, Number, Number]
Vector4 = tuple[Number, Number, Number, Number]


class Air(NamedTuple, Generic[Number]):
    """Precomputed constants of a wind, with `scale` applied; m/s and m."""

    steady_x: Number
    steady_y: Number
    steady_z: Number
    jet_x: Number
    jet_y: Number
    jet_z: Number
    place_x: Number
    place_y: Number
    place_z: Number
    axis_x: Number
    axis_y: Number
    axis_z: Number
    fading: Number


def air(wind: Mapping[str, Any] | None) -> Air[float]:
    """Return the constants of a sampled disturbance `wind`, or of calm air."""
    if wind is None:
        return Air._make([0.0] * len(Air._fields))
    direction = wind["fan_direction"]
    axis = [component / math.hypot(*direction) for component in direction]
    numbers = (
        *(wind["scale"] * component for component in wind["steady"]),
        *(wind["scale"] * wind["fan_speed"] * component for component in axis),
        *wind["fan_position"],
        *axis,
        -0.5 / wind["fan_radius"] ** 2,
    )
    return Air._make(numbers)


def processes(wind: Mapping[str, Any] | None) -> tuple[list[float], list[float]]:
    """Return exp(-GRID / T) and std sqrt(1 - exp(-2 GRID / T)) of the four processes: ambient x, y, z, turbulence."""
    if wind is None:
        return [0.0] * 4, [0.0] * 4
    ambient, gust = (math.exp(-GRID / wind[name]) for name in ("ambient_time", "turbulence_time"))
    ambient_kick = wind["scale"] * wind["ambient"] * math.sqrt(1.0 - ambient**2)
    gust_kick = wind["turbulence"] * math.sqrt(1.0 - gust**2)
    return [ambient] * 3 + [gust], [ambient_kick] * 3 + [gust_kick]


def advance(keep: Number, kick: Number, state: Number, noise: Number) -> Number:
    """Advance an Ornstein-Uhlenbeck process by one grid step."""
    return keep * state + kick * noise


def velocity(
    air: Air[Number], states: Vector4[Number], position: Vector3[Number], exp: Callable[[Number], Number]
) -> Vector3[Number]:
    """Return the wind velocity at `position` for the states of the processes, in world axes.

    `exp` is the exponential function for this type of number.
    """
    ambient_x, ambient_y, ambient_z, turbulence = states
    x, y, z = position[0] - air.place_x, position[1] - air.place_y, position[2] - air.place_z
    along = x * air.axis_x + y * air.axis_y + z * air.axis_z
    radius_squared = x * x + y * y + z * z - along * along
    jet = exp(air.fading * radius_squared) * (1.0 + turbulence)
    return (
        air.steady_x + ambient_x + jet * air.jet_x,
        air.steady_y + ambient_y + jet * air.jet_y,
        air.steady_z + ambient_z + jet * air.jet_z,
    )


class Wind:
    """The wind around one vehicle during one episode, on the grid."""

    def __init__(self, wind: Mapping[str, Any], key: np.uint64) -> None:
        self._air = air(wind)
        self._keep, self._kick = processes(wind)
        self._key = np.array([key])
        self._noise: list[list[float]] = []
        self._read = 0  # grid points
        self._states: Vector4[float] = (0.0, 0.0, 0.0, 0.0)

    def at(self, position: Vector3[float]) -> Vector3[float]:
        """Return the wind velocity (m/s, world axes) at `position` (m) from this grid point to the next."""
        return velocity(self._air, self._states, position, math.exp)

    def next(self, position: Vector3[float]) -> Vector3[float]:
        """Return the wind velocity as `at`, then advance to the next grid point."""
        velocity_now = self.at(position)
        if not self._noise:
            block = np.arange(self._read, self._read + BLOCK_SIZE, dtype=np.uint64)
            self._noise = uniform_noise(self._key, block).T[::-1].tolist()  # read from the end
            self._read += BLOCK_SIZE
        x, y, z, turbulence = map(advance, self._keep, self._kick, self._states, self._noise.pop())
        self._states = x, y, z, turbulence
        return velocity_now
