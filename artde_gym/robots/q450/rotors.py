"""What lies between a commanded wrench and the thrusts of a vehicle's rotors: delay, limits, losses, lag."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.multibody.lag import follow, lag_shares
from artde_gym.robots.q450 import model as robot


class Rotors:
    """The four rotors of one vehicle during one episode.

    Args:
        sampled: drawn disturbances, of which "action_delay", "actuator_effectiveness" and "motor_lag" matter here.
        thrusts: with which they turn at the start (N), as they did for ever before.
        time_step: of the physics (s).
        steps: of the physics in a control period.

    Attributes:
        thrusts: now (4,) (N).
    """

    def __init__(self, sampled: Mapping[str, Any], thrusts: Sequence[float], time_step: float, steps: int) -> None:
        self.thrusts = np.array(thrusts)
        constant = sampled.get("motor_lag", {}).get("time_constant", robot.ROTOR_LAG)
        self._mean = lag_shares(constant, time_step)[1]
        self._ends = np.array(
            [[lag_shares(constant, step * time_step)[0] if step else 0.0] for step in range(steps + 1)]
        )
        self._steps = steps
        self._losses = [
            (round(loss["start"] / time_step), robot.ROTORS.index(loss["joint"]), loss["factor"])
            for loss in sampled.get("actuator_effectiveness", ())
        ]
        self._late = deque([self.thrusts] * sampled.get("action_delay", {}).get("steps", 0))

    def advance(self, wrench: Sequence[float], first: int) -> Array:
        """Mean thrusts (steps, 4) (N) over each physics step of a control period.

        Args:
            wrench: the command [u1 (N), u2, u3, u4 (Nm)] with which the period begins.
            first: its first physics step, counted from the start of the episode.
        """
        aim = np.array([min(max(thrust, 0.0), robot.MAX_THRUST) for thrust in robot.thrusts(*wrench)])
        self._late.append(aim)
        aim = self._late.popleft()
        if not self._losses:
            return self._follow(aim, self._steps)
        end = first + self._steps
        marks = sorted({first, end, *(start for start, _, _ in self._losses if first < start < end)})
        return np.concatenate([self._follow(self._left(aim, a), b - a) for a, b in pairwise(marks)])

    def _follow(self, target: Array, steps: int) -> Array:
        values, _ = follow(self.thrusts, target, self._ends[: steps + 1], 0.0)
        self.thrusts = values[-1]
        return follow(values[:-1], target, 0.0, self._mean)[1]

    def _left(self, aim: Array, step: int) -> Array:
        """What losses leave of an aim."""
        aim = aim.copy()
        for start, rotor, factor in self._losses:
            if step >= start:
                aim[rotor] *= factor
        return aim
