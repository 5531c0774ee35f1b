"""The disturbance `sensor_noise` of vehicles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.noise import Integers, normal_noise
from artde_gym.sim.rigid_bodies import rotate_frames

BEYOND = np.uint64(2**40)  # samples, further than any flight goes: from there on the stream is the cable's


class VehicleNoise:
    """White Gaussian noise for `n` vehicles, each with its own standard deviations."""

    def __init__(self, n: int, dtype: DTypeLike) -> None:
        self._deviations = np.zeros((len(_NAMES), n), dtype)

    def begin(self, vehicle: int, sampled: Mapping[str, Any]) -> None:
        """Begin an episode of one vehicle with sampled disturbances."""
        noise = sampled.get("sensor_noise", {})
        self._deviations[:, vehicle] = [noise.get(name, 0.0) for name in _NAMES]

    def measure(
        self, position: Array, velocity: Array, rot: Array, rates: Array, sample: NDArray[np.int64], keys: Integers
    ) -> None:
        """Add noise in place; arguments as in `artde_gym.disturbances.mocap.Mocap.measure`."""
        noise = normal_noise(keys, sample.astype(np.uint64), 12).astype(position.dtype)
        of_position, of_velocity, of_attitude, of_rates = self._deviations
        position += of_position * noise[0:3]
        velocity += of_velocity * noise[3:6]
        np.copyto(rot, rotate_frames(rot, of_attitude * noise[6:9]), where=of_attitude > 0)
        rates += of_rates * noise[9:12]

    def measure_cable(
        self, cable: Array, rate: Array, held: NDArray[np.bool_], sample: NDArray[np.int64], keys: Integers
    ) -> None:
        """Add noise of positions and velocities to cables and their rates (3, n) in place, where they are held."""
        noise = normal_noise(keys, sample.astype(np.uint64) + BEYOND, 6).astype(cable.dtype)
        of_position, of_velocity, _, _ = self._deviations
        cable += np.where(held, of_position * noise[:3], 0.0)
        rate += np.where(held, of_velocity * noise[3:], 0.0)


_NAMES = ("position", "velocity", "tilt", "angular_velocity")
