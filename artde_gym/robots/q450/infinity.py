"""Infinity-shaped path of the quadrotor: two loops from the crossing point, each from rest to rest.

x = 1.2 sin th,   y = 0.6 sin 2 th,   z = 0.6 + 0.2 sin th          (m)

The angle th makes one turn per loop: its rate rises to a constant by a quintic within 4 s, and falls by the same
quintic at the end, so that position, velocity, acceleration and jerk are continuous. Loop 1 ends at 33 s, loop 2 lasts
from 37 s to 70 s; in between the path rests. Source: Dantu 2023, section 3.5, for shape and times; the sizes are this
project's.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from artde_gym.arguments import check_number
from artde_gym.arrays import Array

START = (0.0, 0.0, 0.6)  # m
LOOPS = ((0.0, 33.0), (37.0, 70.0))  # s
RAMP = 4.0  # s
LIFT = 1.0  # m, by which the path is raised where a load hangs under the vehicle
LIFTED_FAN = (0.9, 0.0, 1.7)  # m, a fan beside the raised path, as the default is beside the low one
MAX_DURATION = 7200.0  # s

_AMPLITUDE = np.array([1.2, 0.6, 0.2])
_FREQUENCY = np.array([1.0, 2.0, 1.0])  # waves per turn


@dataclasses.dataclass(frozen=True)
class InfinityPath:
    """The path sampled every `period` seconds; row k is time k * period.

    Attributes:
        position, velocity, acceleration, jerk: (samples, 3) (m, m/s, m/s^2, m/s^3), world axes; exact derivatives.
        yaw, yaw_rate: heading, (samples,) (rad, rad/s): zero throughout.
    """

    period: float
    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array
    yaw: Array
    yaw_rate: Array


def infinity_path(duration: float = 70.0, period: float = 0.015) -> InfinityPath:
    """Return the first `duration` seconds of the path; after loop 2 it rests.

    The result is cached and its arrays are read-only, so that all environments of a process share it.

    Raises:
        OptionError: for a path outside 0.1 to 7200 s, or a period outside 1e-6 to 0.1 s.
    """
    duration = check_number("duration", duration, 0.1, MAX_DURATION, f"0.1 to {MAX_DURATION:g} s")
    period = check_number("period", period, 1e-6, 0.1, "1e-6 to 0.1 s")
    return _path(duration, period)  # positional: the cache distinguishes keyword arguments


@functools.lru_cache(maxsize=8)
def _path(duration: float, period: float) -> InfinityPath:
    time = period * np.arange(math.floor(duration / period + 1e-9) + 1)
    angle, rate, curvature, third = (values[:, None] for values in _angle(time))
    wave = _FREQUENCY * angle
    sine, cosine = np.sin(wave), np.cos(wave)
    first, second, cubic = _FREQUENCY * rate, _FREQUENCY * curvature, _FREQUENCY * third  # derivatives of the wave
    path = InfinityPath(
        period=period,
        position=START + _AMPLITUDE * sine,
        velocity=_AMPLITUDE * cosine * first,
        acceleration=_AMPLITUDE * (cosine * second - sine * first**2),
        jerk=_AMPLITUDE * (cosine * (cubic - first**3) - 3 * sine * first * second),
        yaw=np.zeros_like(time),
        yaw_rate=np.zeros_like(time),
    )
    for values in (path.position, path.velocity, path.acceleration, path.jerk, path.yaw, path.yaw_rate):
        values.flags.writeable = False
    return path


def _angle(time: Array) -> Array:
    """Return the angle th and its first three derivatives at each time, (4, samples) (rad, s)."""
    out = np.zeros((4, len(time)))
    for start, end in LOOPS:
        rate = 2 * math.pi / (end - start - RAMP)  # of th while it is constant; each ramp covers half of it
        rise, fall = _ramp(time - start), _ramp(time - (end - RAMP))
        out += rate * (rise - fall)
    return out


def _ramp(time: Array) -> Array:
    """Return integral, value and two derivatives of a quintic that rises from 0 to 1 within `RAMP`, (4, samples)."""
    s = np.clip(time / RAMP, 0.0, 1.0)
    beyond = np.maximum(time - RAMP, 0.0)
    return np.array(
        [
            RAMP * s**4 * (2.5 - 3 * s + s**2) + beyond,
            s**3 * (10 - 15 * s + 6 * s**2),
            30 * (s * (1 - s)) ** 2 / RAMP,
            60 * s * (1 - s) * (1 - 2 * s) / RAMP**2,
        ]
    )
