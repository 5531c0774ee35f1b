"""Sensors of a quadrotor: motion capture, and noise as a disturbance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import DTypeLike, NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.kinds import OWN
from artde_gym.disturbances.mocap import Mocap
from artde_gym.disturbances.vehicle_noise import VehicleNoise
from artde_gym.errors import OptionError
from artde_gym.layout import Layout
from artde_gym.robots.q450.task import POSITION, RATES, ROT, VELOCITY

Measurement = Literal["ideal", "mocap"]

SLOTS = int(OWN["cable_delay"].parameters[0].high) + 1  # samples that a delay has to remember


class Sensors:
    """The sensors of `n` vehicles, sampled every `period` seconds, for observations of a `layout`.

    Raises:
        OptionError: for an unknown `measurement`.
    """

    def __init__(self, n: int, measurement: Measurement, period: float, dtype: DTypeLike, layout: Layout) -> None:
        if measurement not in ("ideal", "mocap"):
            raise OptionError("measurement", measurement, "'ideal', 'mocap'")
        self._mocap = Mocap(n, period, dtype) if measurement == "mocap" else None
        self._noise: VehicleNoise | None = None  # once a vehicle needs it
        self._n, self._dtype = n, dtype
        parts = [layout.slices[name] for name in ("cable", "cable_rate", "cable_held") if name in layout.slices]
        self._cable = slice(parts[0].start, parts[-1].stop) if parts else None
        self._delay = np.zeros(n, np.int64)  # of the cable, in samples
        self._late: Array | None = None  # its last samples (SLOTS, 7, n), once a vehicle needs them
        self._keys = np.zeros((2, n), np.uint64)

    def begin(self, vehicle: int, sampled: Mapping[str, Any], keys: NDArray[np.uint64]) -> None:
        """Begin an episode of one vehicle with sampled disturbances and two keys of its noise."""
        self._keys[:, vehicle] = keys
        if self._noise is None and "sensor_noise" in sampled:
            self._noise = VehicleNoise(self._n, self._dtype)
        if self._noise is not None:
            self._noise.begin(vehicle, sampled)
        self._delay[vehicle] = sampled.get("cable_delay", {}).get("steps", 0)
        if self._late is None and self._delay[vehicle] and self._cable is not None:
            self._late = np.zeros((SLOTS, self._cable.stop - self._cable.start, self._n), self._dtype)

    @property
    def ideal(self) -> bool:
        """True if measurements have no error."""
        return self._mocap is None and self._noise is None and self._late is None

    def measure(self, observation: Array, sample: NDArray[np.int64], new: NDArray[np.bool_] | None = None) -> None:
        """Replace true values in observations (size, n) by measurements, `sample` (n,) periods after the start.

        `new` (n,) marks vehicles whose sample is read for the first time; None: all of them.
        """
        measured = (
            observation[POSITION],
            observation[VELOCITY],
            observation[ROT].reshape(3, 3, -1),  # a view, since the rows have a constant stride
            observation[RATES],
        )
        if self._mocap is not None:
            self._mocap.measure(*measured, sample, self._keys[0], new)
        if self._noise is not None:
            self._noise.measure(*measured, sample, self._keys[1])
        if self._cable is not None:
            self._measure_cable(observation[self._cable], sample)

    def _measure_cable(self, cable: Array, sample: NDArray[np.int64]) -> None:
        """Replace vector (3), rate (3) and whether it holds (1) of the cables (7, n)."""
        if self._noise is not None:
            self._noise.measure_cable(cable[:3], cable[3:6], cable[6] > 0, sample, self._keys[1])
        if self._late is not None:
            vehicles = np.arange(self._n)
            self._late[sample % SLOTS, :, vehicles] = cable.T
            cable[:] = self._late[np.maximum(sample - self._delay, 0) % SLOTS, :, vehicles].T
