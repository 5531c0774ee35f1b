"""Joint-space policies: one law for all joints of a robot."""

from __future__ import annotations

from typing import Any

from artde_gym.errors import OptionError
from controllers.encoders import EncoderPolicy
from controllers.law_table import find_law
from controllers.laws.tracking import Array, JointInput, LawState, check_positive_number
from controllers.policies import ControlInterface, TrackingPolicy
from controllers.presets import preset_gains


class LawPolicy(TrackingPolicy):
    """A law of the table on its signals, the sampling period, and the fields of the observation that it names.

    `time_base` is the period L that the law divides by, over the true one.

    Raises:
        OptionError: for an environment whose observation has no such field.
    """

    def __init__(self, name: str, interface: ControlInterface, gains: Any, time_base: float = 1.0) -> None:
        check_positive_number("time_base", time_base)
        entry = find_law(name)
        if missing := set(entry.reads) - set(interface.observation.slices):
            raise OptionError(f"observation of the environment of {name!r}", list(interface.observation.slices),
                              f"with {', '.join(sorted(missing))}, as that of BipedWalk-Payload-v0")  # fmt: skip
        self._further = [interface.observation[field] for field in entry.reads]
        self._law, self._period = entry.law, time_base * interface.control_period
        super().__init__(name, interface, entry.convert(gains, self._period))

    @property
    def code(self) -> tuple[Any, ...]:
        return self._law.start, self._law.step, self.gains.__class__

    def law(self) -> tuple[str, float]:
        return self.name, self._period

    def start(self, signals: JointInput) -> LawState:
        return self._law.start(self.gains, signals, self._period)

    def step(self, state: Any, signals: JointInput, observation: Array) -> tuple[Array, LawState]:
        if not self._further:  # of most laws; a microsecond faster
            return self._law.step(self.gains, state, signals, self._period)
        further = (observation[..., part] for part in self._further)
        return self._law.step(self.gains, state, signals, self._period, *further)


def make_joint_space(
    env: Any,
    *,
    law: str,
    preset: str | None = None,
    velocity_cutoff_hz: float | None = None,
    time_base: float = 1.0,
    **gains: Any,
) -> TrackingPolicy:
    """Build the policy of a law on all joints, at preset gains with some replaced.

    Args:
        env: the environment that it will drive; its observation has the fields of
            `controllers.laws.tracking.JointInput`.
        law: name of the law.
        preset: name of its gains; None for the law's default.
        velocity_cutoff_hz: with a number, velocities are estimated from the observed angles by a low-pass of this
            bandwidth, as behind encoders; without, the observed velocities are used.
        time_base: the period L that the law divides by, over the true one; 0.5 halves it, as if the law believed in
            twice the sampling rate.
        gains: in place of the preset's; of a robot without presets all that the law has no default for.

    Raises:
        UnknownNameError: for a law that the robot does not have, or an unknown preset.
        GainError: for an unknown gain or a value that is not allowed.
        OptionError: for a law that reads what the environment does not observe.
    """
    interface = ControlInterface.of(env)
    policy = LawPolicy(
        law, interface, preset_gains(interface.robot, law, preset, interface.action.size, gains), time_base
    )
    if velocity_cutoff_hz is None:
        return policy
    return EncoderPolicy(policy, interface, velocity_cutoff_hz)
