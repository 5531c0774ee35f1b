"""A tracking policy behind encoders: it sees angles, and estimates the velocities itself."""

from __future__ import annotations

from typing import Any, NamedTuple

from controllers.laws.errors import GainError
from controllers.laws.tracking import Array, Memory, Signals
from controllers.laws.velocity_estimate import EstimateMemory, estimate, estimate_start
from controllers.policies import Plant, TrackingPolicy


class EncoderMemory(NamedTuple):
    """The estimator's memory and the law's."""

    estimate: EstimateMemory
    law: Any


class EncoderPolicy(TrackingPolicy):
    """`inner` on velocities estimated from the observed angles, with a low-pass of `cutoff_hz` (Hz).

    Raises:
        GainError: for a cut-off frequency that is not above zero and below half the sampling rate.
    """

    def __init__(self, inner: TrackingPolicy, plant: Plant, cutoff_hz: float) -> None:
        nyquist = 0.5 / plant.control_period
        if not 0 < cutoff_hz < nyquist:
            raise GainError("velocity_cutoff_hz", cutoff_hz, f"above 0 and below {nyquist:g} Hz")
        super().__init__(inner.name, plant, inner.gains)
        self._inner = inner
        self._cutoff_hz = cutoff_hz
        self._period = plant.control_period

    def start(self, signals: Signals) -> Memory:
        memory = estimate_start(signals, self._period)
        seen, _ = estimate(self._cutoff_hz, memory, signals, self._period)
        return EncoderMemory(memory, self._inner.start(seen))

    def step(self, memory: Any, signals: Signals, observation: Array) -> tuple[Array, Memory]:
        seen, estimated = estimate(self._cutoff_hz, memory.estimate, signals, self._period)
        force, law = self._inner.step(memory.law, seen, observation)
        return force, EncoderMemory(estimated, law)
