"""Motion capture and inertial sensors, fused: what a vehicle in a laboratory knows of itself.

Cameras give position and attitude 60 times a second, the inertial unit angular rate and specific force at every control
period L; sensor errors are white and Gaussian. An observer goes along with the inertial unit and is corrected by the
first sample after each frame:

predict:   R <- R exp(L (w_k + w_{k-1}) / 2),   v' = v + L (R f - g),   p <- p + L (v + v') / 2,   v <- v'
correct:   p <- p + alpha e,   v <- v + beta / T e,   R <- R exp(kappa e_R)        e, e_R = camera - observer

with constant gains, those of the stationary Kalman filter for these errors: alpha and beta after P. R. Kalata, "The
tracking index: a generalized parameter for alpha-beta and alpha-beta-gamma target trackers", IEEE Transactions on
Aerospace and Electronic Systems 20(2), 1984; kappa = (sqrt(r^2 + 4 r) - r) / 2 for a random walk, r the ratio of the
variances of drift and measurement. Body rates are the gyroscope's own reading.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import DTypeLike, NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.noise import Integers, normal_noise
from artde_gym.multibody.dynamics import GRAVITY
from artde_gym.sim.rigid_bodies import cross, rotate_frames, times, transposed_times

FRAME = 1 / 60  # s
POSITION_NOISE = 3e-4  # m, standard deviation of each component, as all that follow
ATTITUDE_NOISE = math.radians(0.1)
GYROSCOPE_NOISE = 0.005  # rad/s
ACCELEROMETER_NOISE = 0.05  # m/s^2


class Mocap:
    """The observers of `n` vehicles that are sampled every `period` seconds."""

    def __init__(self, n: int, period: float, dtype: DTypeLike) -> None:
        self._period = period
        self._position = self._velocity = self._rates = self._true_velocity = np.zeros((3, n), dtype)
        self._rot = np.zeros((3, 3, n), dtype)
        samples = max(FRAME / period, 1.0)  # between two corrections
        interval = samples * period
        drift = ACCELEROMETER_NOISE / math.sqrt(samples)  # as if constant from one correction to the next
        self._alpha, beta = tracking_gains(drift * interval**2 / POSITION_NOISE)
        self._beta_rate = beta / interval
        ratio = samples * (GYROSCOPE_NOISE * period / ATTITUDE_NOISE) ** 2
        self._kappa = 0.5 * (math.sqrt(ratio**2 + 4 * ratio) - ratio)

    def measure(
        self,
        position: Array,
        velocity: Array,
        rot: Array,
        rates: Array,
        sample: NDArray[np.int64],
        keys: Integers,
        new: NDArray[np.bool_] | None = None,
    ) -> None:
        """Replace the truth by what is known of it.

        Args:
            position, velocity, rates: (3, n) (m, m/s, rad/s), changed in place.
            rot: body to world (3, 3, n), changed in place.
            sample: how many control periods since the start of the episode (n,); at 0 the observer has settled.
            keys: of each vehicle's noise (n,).
            new: whether this sample is looked at for the first time (n,); all are without. The others' stay as known.
        """
        before = self._known()
        period = self._period
        noise = normal_noise(keys, sample.astype(np.uint64), 12).astype(position.dtype)
        reading = rates + GYROSCOPE_NOISE * noise[0:3]
        force = (velocity - self._true_velocity) / period
        force[2] += GRAVITY
        force = transposed_times(rot, force) + ACCELEROMETER_NOISE * noise[3:6]

        attitude = rotate_frames(self._rot, (0.5 * period) * (self._rates + reading))
        change = period * times(attitude, force)
        change[2] -= period * GRAVITY
        place = self._position + period * (self._velocity + 0.5 * change)
        speed = self._velocity + change

        framed = _frame(sample, period) > _frame(sample - 1, period)
        error = framed * (position + POSITION_NOISE * noise[6:9] - place)
        error_rot = framed * _turn_between(attitude, rotate_frames(rot, ATTITUDE_NOISE * noise[9:12]))
        start = sample == 0
        self._true_velocity = velocity.copy()
        self._position = np.where(start, position, place + self._alpha * error)
        self._velocity = np.where(start, velocity, speed + self._beta_rate * error)
        self._rot = np.where(start, rot, rotate_frames(attitude, self._kappa * error_rot))
        self._rates = reading
        if new is not None:
            chosen = (np.where(new, now, then) for now, then in zip(self._known(), before, strict=True))
            self._position, self._velocity, self._rot, self._rates, self._true_velocity = chosen
        position[:], velocity[:], rot[:], rates[:] = self._position, self._velocity, self._rot, self._rates

    def _known(self) -> tuple[Array, ...]:
        return self._position, self._velocity, self._rot, self._rates, self._true_velocity


def tracking_gains(index: float) -> tuple[float, float]:
    """Kalata's stationary gains alpha, beta for a tracking index std(acceleration) T^2 / std(position)."""
    root = (4 + index - math.sqrt(8 * index + index**2)) / 4
    alpha = 1 - root**2
    return alpha, 2 * (2 - alpha) - 4 * math.sqrt(1 - alpha)


def _frame(sample: NDArray[np.int64], period: float) -> NDArray[np.int64]:
    """Number of the last frame at a sample."""
    return np.floor(sample * period / FRAME + 1e-6).astype(np.int64)


def _turn_between(rot: Array, other: Array) -> Array:
    """The small rotation vector (3, n) in body axes from one attitude to another."""
    turn = cross(rot[:, 0], other[:, 0]) + cross(rot[:, 1], other[:, 1]) + cross(rot[:, 2], other[:, 2])
    return transposed_times(rot, 0.5 * turn)
