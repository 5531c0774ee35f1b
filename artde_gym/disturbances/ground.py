"""The ground reaction pulse: an extra force on the foot that lands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

LOADED = 1.0  # N, from which on a foot touches the ground
AIRBORNE = 0.25  # s without load that make a swing; a foot that has just landed bounces for up to 0.2 s


class GrfPulse:
    """Upward force on each foot since its last landing, found by contact and not by plan.

    half_sine     A sin(pi x)                       double_hump     A (sin(pi x) + q sin(3 pi x))
    with x = time since the landing / duration, 0 to 1. Source: Dantu 2023, section 2.5.2.
    """

    def __init__(self, entry: Mapping[str, Any], time_step: float) -> None:
        self._magnitude: float = entry["magnitude"]
        self._third: float = entry["q"] if entry["shape"] == "double_hump" else 0.0
        self._duration: float = entry["duration"]
        self._time_step = time_step
        self._unloaded = [0.0, 0.0]  # s
        self._since_landing = [math.inf, math.inf]  # s

    def forces(self, loads: Sequence[float]) -> list[float]:
        """Forces (N) for the next physics step, from the `loads` (N) of each foot in the last one."""
        forces = []
        for foot, load in enumerate(loads):
            self._since_landing[foot] += self._time_step
            if load <= LOADED:
                self._unloaded[foot] += self._time_step
            else:
                if self._unloaded[foot] >= AIRBORNE:
                    self._since_landing[foot] = 0.0
                self._unloaded[foot] = 0.0
            x = self._since_landing[foot] / self._duration
            wave = math.sin(math.pi * x) + self._third * math.sin(3 * math.pi * x) if x < 1 else 0.0
            forces.append(self._magnitude * wave)
        return forces
