"""What lies between the robot's state and its observation: noise and encoders."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.layout import Layout


class Sensing:
    """Disturbs observations in place; `start` begins an episode.

    Noise is white and Gaussian. An encoder rounds a (noisy) joint angle to its counts, and a joint velocity is then the
    difference of two readings over the control period: what a controller with encoders has before any filter.

    Args:
        sampled: drawn disturbances, of which "sensor_noise" and "encoder_bits" matter here.
        layout: of the observation.
        period: of control (s).
        rng: of the environment.
    """

    KINDS = ("sensor_noise", "encoder_bits")

    _FIELDS = (
        ("position", "q"),
        ("velocity", "qd"),
        ("tilt", "tilt"),
        ("angular_velocity", "base_angular_velocity"),
    )

    def __init__(self, sampled: Mapping[str, Any], layout: Layout, period: float, rng: np.random.Generator) -> None:
        noise = sampled.get("sensor_noise", {})
        self._noise = [(layout[field], noise[name]) for name, field in self._FIELDS if noise.get(name, 0.0) > 0]
        bits = sampled.get("encoder_bits", {}).get("bits")
        self._count = None if bits is None else 2 * math.pi / 2**bits
        self._q, self._qd = layout["q"], layout["qd"]
        self._period = period
        self._rng = rng
        self._before: Array | None = None

    def disturb(self, observation: Array) -> Array:
        """The observation as the sensors give it; changed in place and returned."""
        for part, deviation in self._noise:
            values = observation[part]
            values += self._rng.normal(0.0, deviation, values.shape)
        if self._count is not None:
            reading = np.round(observation[self._q] / self._count) * self._count
            before = reading if self._before is None else self._before
            observation[self._q] = reading
            observation[self._qd] = (reading - before) / self._period
            self._before = reading
        return observation
