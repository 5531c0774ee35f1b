"""A tracking policy behind encoders: it sees angles, and estimates the velocities itself."""

from __future__ import annotations

from typing import Any, NamedTuple

from controllers.laws.errors import GainError
from controllers.laws.tracking import Array, JointInput, LawState
from controllers.laws.velocity_estimate import EstimateState, estimate, estimate_init
from controllers.policies import ControlInterface, TrackingPolicy


class EncoderState(NamedTuple):
    """The estimator's memory and the law's."""

    estimate: EstimateState
    law: Any


class EncoderPolicy(TrackingPolicy):
    """`inner` on velocities estimated from the observed angles, with a low-pass of `cutoff_hz` (Hz).

    Raises:
        GainError: for a cut-off frequency that is not above zero and below half the sampling rate.
    """

    def __init__(self, inner: TrackingPolicy, interface: ControlInterface, cutoff_hz: float) -> None:
        nyquist = 0.5 / interface.control_period
        if not 0 < cutoff_hz < nyquist:
            raise GainError("velocity_cutoff_hz", cutoff_hz, f"above 0 and below {nyquist:g} Hz")
        super().__init__(inner.name, interface, inner.gains)
        self._inner = inner
        self._cutoff_hz = cutoff_hz
        self._period = interface.control_period

    @property
    def code(self) -> tuple[Any, ...]:
        return self._inner.code

    def start(self, signals: JointInput) -> LawState:
        state = estimate_init(signals, self._period)
        seen, _ = estimate(self._cutoff_hz, state, signals, self._period)
        return EncoderState(state, self._inner.start(seen))

    def step(self, state: Any, signals: JointInput, observation: Array) -> tuple[Array, LawState]:
        seen, estimated = estimate(self._cutoff_hz, state.estimate, signals, self._period)
        force, law = self._inner.step(state.law, seen, observation)
        return force, EncoderState(estimated, law)
