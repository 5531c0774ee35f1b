"""The biped's policies: one law for all joints."""

from __future__ import annotations

from typing import Any

from controllers.encoders import EncoderPolicy
from controllers.law_table import LAWS
from controllers.laws.tracking import Array, Memory, Signals
from controllers.policies import Plant, TrackingPolicy
from controllers.presets import preset_gains


class LawPolicy(TrackingPolicy):
    """One of the laws that need nothing but the signals and the sampling period."""

    def __init__(self, name: str, plant: Plant, gains: Any) -> None:
        self._law, convert = LAWS[name]
        super().__init__(name, plant, convert(gains, plant.control_period))
        self._period = plant.control_period

    def start(self, signals: Signals) -> Memory:
        return self._law.start(self.gains, signals, self._period)

    def step(self, memory: Any, signals: Signals, observation: Array) -> tuple[Array, Memory]:
        return self._law.step(self.gains, memory, signals, self._period)


def make_biped(
    env: Any, *, law: str, preset: str | None = None, velocity_cutoff_hz: float | None = None, **gains: Any
) -> TrackingPolicy:
    """The policy of a law for a biped's environment, at preset gains with some replaced.

    Args:
        env: the environment that it will drive.
        law: name of the law.
        preset: name of its gains; None for the law's default.
        velocity_cutoff_hz: with a number, velocities are estimated from the observed angles by a low-pass of this
            bandwidth, as behind encoders; without, the observed velocities are used.
        gains: in place of the preset's.

    Raises:
        UnknownNameError: for a law that the robot does not have, or an unknown preset.
        GainError: for an unknown gain or a value that is not allowed.
    """
    plant = Plant.of(env)
    policy = LawPolicy(law, plant, preset_gains(plant.robot, law, preset, plant.action.size, gains))
    if velocity_cutoff_hz is None:
        return policy
    return EncoderPolicy(policy, plant, velocity_cutoff_hz)
