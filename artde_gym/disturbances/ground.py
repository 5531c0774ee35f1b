"""The ground reaction pulse: an extra force on the foot that lands."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.multibody.dynamics import GRAVITY
from artde_gym.multibody.spec import RobotSpec

LOADED = 1.0  # N, from which on a foot touches the ground
CARRIED = 1e-6  # share of the weight, below which the plan takes a foot off: its blends end a rounding off zero
AIRBORNE = 0.25  # s without load that make a swing; a foot that has just landed bounces for up to 0.2 s


class GrfPulses:
    """Upward forces on both feet of `n` robots, one pulse for each landing; `begin` starts an episode of one robot.

    half_sine     A sin(pi x)                       double_hump     A (sin(pi x) + q sin(3 pi x))
    with x = time since the landing / duration, 0 to 1. Source: Dantu 2023, section 2.5.2.

    Each swing of the plan ends in one landing at most. With the trigger "plan" that is when the plan puts load on the
    foot again; with "contact" when the ground first carries the foot after `AIRBORNE` s of that swing in the air. A
    pulse that lifts the foot on which the robot stands does therefore not start another one.

    Args:
        n: number of robots.
        load_left: share of the weight that the plan puts on the left foot, one value a time step.
        time_step: of the physics (s).
    """

    def __init__(self, n: int, load_left: Array, time_step: float) -> None:
        carried = np.stack([load_left, 1.0 - load_left], axis=1) > CARRIED
        before = np.concatenate([carried[:1], carried[:-1]])
        self._lifts, self._lands = before & ~carried, carried & ~before
        self._time_step = time_step
        self._swing = round(AIRBORNE / time_step)
        self._robots = np.arange(n)[:, None]
        self._waves = np.zeros((n, 1))  # N, by robot and steps since the landing; the last one is zero
        self._by_plan = np.zeros((n, 1), np.bool_)
        self._due = np.zeros((n, 2), np.bool_)  # feet whose swing has not ended yet
        self._unloaded = np.zeros((n, 2), np.int64)  # steps
        self._since = np.zeros((n, 2), np.int64)  # steps

    def begin(self, robot: int, entry: Mapping[str, Any] | None, spec: RobotSpec) -> None:
        """Start an episode of a robot with a sampled disturbance, or without one; a share is one of its weight."""
        wave = np.zeros(1) if entry is None else _wave(entry, spec.mass * GRAVITY, self._time_step)
        longer = len(wave) - self._waves.shape[1]
        if longer > 0:
            self._waves = np.pad(self._waves, ((0, 0), (0, longer)))
        self._waves[robot] = 0.0
        self._waves[robot, : len(wave)] = wave
        self._by_plan[robot] = entry is not None and entry["trigger"] == "plan"
        self._due[robot], self._unloaded[robot] = False, 0
        self._since[robot] = self._waves.shape[1]  # long ago

    def forces(self, loads: Array, steps: NDArray[np.integer[Any]]) -> Array:
        """Compute forces (n, 2) (N) during the time `steps` (n,) of each robot, from `loads` (n, 2) (N) just before."""
        steps = np.minimum(steps, len(self._lifts) - 1)
        lifts, carried = self._lifts[steps], loads > LOADED
        self._due |= lifts
        landed = np.where(self._by_plan, self._lands[steps], carried & (self._unloaded >= self._swing)) & self._due
        self._due &= ~landed
        self._unloaded = np.where(carried, 0, np.where(lifts, 1, self._unloaded + 1))
        self._since = np.where(landed, 0, np.minimum(self._since + 1, self._waves.shape[1] - 1))
        return self._waves[self._robots, self._since]


def _wave(entry: Mapping[str, Any], weight: float, time_step: float) -> Array:
    """Force (N) in each time step after a landing, and a zero."""
    magnitude = entry["magnitude"] if "magnitude" in entry else entry["share"] * weight
    third = entry["q"] if entry["shape"] == "double_hump" else 0.0
    x = time_step * np.arange(math.ceil(entry["duration"] / time_step)) / entry["duration"]
    return np.append(magnitude * (np.sin(math.pi * x) + third * np.sin(3.0 * math.pi * x)) * (x < 1.0), 0.0)
