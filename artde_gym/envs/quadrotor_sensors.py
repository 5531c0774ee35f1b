"""From a quadrotor's state to its observation: motion capture, and noise as a disturbance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike, NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.mocap import Mocap
from artde_gym.disturbances.vehicle_noise import VehicleNoise
from artde_gym.errors import OptionError
from artde_gym.robots.q450.task import POSITION, RATES, ROT, VELOCITY

Measurement = Literal["ideal", "mocap"]


class Sensors:
    """The sensors of `n` vehicles that are sampled every `period` seconds.

    Raises:
        OptionError: for an unknown `measurement`.
    """

    def __init__(self, n: int, measurement: Measurement, period: float, dtype: DTypeLike) -> None:
        if measurement not in ("ideal", "mocap"):
            raise OptionError("measurement", measurement, "'ideal', 'mocap'")
        self._mocap = Mocap(n, period, dtype) if measurement == "mocap" else None
        self._noise: VehicleNoise | None = None  # once a vehicle needs it
        self._n, self._dtype = n, dtype
        self._keys = np.zeros((2, n), np.uint64)

    def begin(self, vehicle: int, sampled: Mapping[str, Any], keys: NDArray[np.uint64]) -> None:
        """Begin an episode of one vehicle, with sampled disturbances and two keys of its noise."""
        self._keys[:, vehicle] = keys
        if self._noise is None and "sensor_noise" in sampled:
            self._noise = VehicleNoise(self._n, self._dtype)
        if self._noise is not None:
            self._noise.begin(vehicle, sampled)

    @property
    def ideal(self) -> bool:
        """Whether what is measured is the truth."""
        return self._mocap is None and self._noise is None

    def measure(self, observation: Array, sample: NDArray[np.int64], new: NDArray[np.bool_] | None = None) -> None:
        """Replace the truth in observations (size, n) by what is measured, `sample` periods after the start (n,).

        `new` (n,) says where a sample is looked at for the first time; without, everywhere.
        """
        measured = (
            observation[POSITION],
            observation[VELOCITY],
            observation[ROT].reshape(3, 3, -1),  # a view, as rows lie apart by the same distance
            observation[RATES],
        )
        if self._mocap is not None:
            self._mocap.measure(*measured, sample, self._keys[0], new)
        if self._noise is not None:
            self._noise.measure(*measured, sample, self._keys[1])
