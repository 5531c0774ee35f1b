"""What lies between a commanded wrench and the thrusts of a vehicle's rotors: delay, limits, losses, lag."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

from artde_gym.robots import q450 as robot
from artde_gym.robots.lag import follow, lag_shares

Thrusts = tuple[float, float, float, float]


class Rotors:
    """The four rotors of one vehicle during one episode, on plain numbers.

    Args:
        realised: drawn disturbances, of which "torque_delay", "actuator_loss" and "motor_lag" matter here.
        thrusts: with which they turn at the start (N), as they did for ever before.
        time_step: of the physics (s).
    """

    def __init__(self, realised: Mapping[str, Any], thrusts: Sequence[float], time_step: float) -> None:
        self.thrusts = list(thrusts)
        self._closed, self._closed_mean = lag_shares(
            realised.get("motor_lag", {}).get("time_constant", robot.ROTOR_LAG), time_step
        )
        self._losses = [
            (robot.ROTORS.index(loss["joint"]), loss["factor"], round(loss["start"] / time_step))
            for loss in realised.get("actuator_loss", ())
        ]
        self._late = deque([self.thrusts] * realised.get("torque_delay", {}).get("samples", 0))
        self._aim = self._target = self.thrusts

    def command(self, wrench: Sequence[float]) -> None:
        """Begin a control period with the wrench [u1 (N), u2, u3, u4 (Nm)]."""
        self._late.append([min(max(thrust, 0.0), robot.MAX_THRUST) for thrust in robot.thrusts(*wrench)])
        self._target = self._late.popleft()

    def advance(self, step: int) -> list[float]:
        """Mean thrusts (N) over physics step `step`, counted from the start of the episode."""
        target = self._target
        if self._losses:
            target = list(target)
            for rotor, factor, first in self._losses:
                if step >= first:
                    target[rotor] *= factor
        closed, closed_mean = self._closed, self._closed_mean
        both = [follow(thrust, aim, closed, closed_mean) for thrust, aim in zip(self.thrusts, target, strict=True)]
        self.thrusts = [end for end, _ in both]
        return [mean for _, mean in both]
