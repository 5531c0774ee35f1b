"""What lies between a commanded torque and the torque that acts: delay, lost actuators, motor lag."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.multibody.lag import follow, lag_shares


class Actuation:
    """Turns commands into acting torques; `start` begins an episode.

    Args:
        sampled: drawn disturbances, of which "action_delay", "actuator_effectiveness" and "motor_lag" matter here.
        joints: names of the actuated joints, in the order of commands.
        time_step: of the physics (s).
    """

    KINDS = ("action_delay", "actuator_effectiveness", "motor_lag")

    def __init__(self, sampled: Mapping[str, Any], joints: Sequence[str], time_step: float) -> None:
        self._delay: int = sampled.get("action_delay", {}).get("steps", 0)
        constant: float = sampled.get("motor_lag", {}).get("time_constant", 0.0)
        self._closed, self._closed_mean = lag_shares(constant, time_step)
        self._losses = [
            (joints.index(loss["joint"]), loss["factor"], round(loss["start"] / time_step))
            for loss in sampled.get("actuator_effectiveness", ())
        ]
        self._late: deque[Array] = deque()
        self._acting = np.zeros(len(joints))

    def start(self, tau: Array) -> None:
        """Begin with `tau` (n,) (Nm) acting, as it did for ever before."""
        self._late = deque([tau] * self._delay)
        self._acting = tau

    def target(self, command: Array) -> Array:
        """What the motors aim at during a control period that begins with `command` (n,) (Nm)."""
        self._late.append(command)
        return self._late.popleft()

    def advance(self, target: Array, step: int) -> Array:
        """Mean torques (n,) (Nm) over physics step `step`, counted from the start of the episode."""
        if self._losses:
            target = target.copy()
            for joint, factor, first in self._losses:
                if step >= first:
                    target[joint] *= factor
        if self._closed == 1.0:
            return target
        self._acting, mean = follow(self._acting, target, self._closed, self._closed_mean)
        return mean
