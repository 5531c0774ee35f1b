"""The quadrotor's policies that look at the cable of a load."""

from __future__ import annotations

from typing import Any

import numpy as np

from artde_gym.errors import OptionError
from controllers.law_spec import LawSpec
from controllers.law_table import LAWS
from controllers.laws.cascade import CascadeGains, QuadrotorInput, cascade
from controllers.laws.load import LoadGains, load_control, load_start
from controllers.laws.swing import Cable, swing_term
from controllers.laws.tracking import Array, JointInput, Law, LawState
from controllers.policies import ControlInterface
from controllers.presets import preset_gains
from controllers.quadrotor import AXES, QuadrotorPolicy, loop_laws, make_quadrotor

SWING = "+swing"
"""Suffix of a law's name with the swing term."""
LOAD = "geometric-load"


class SlungPolicy(QuadrotorPolicy):
    """A cascade that observes a cable.

    Raises:
        OptionError: for an environment that has none.
    """

    def __init__(
        self, name: str, interface: ControlInterface, gains: CascadeGains, *, laws: tuple[LawSpec, LawSpec]
    ) -> None:
        if "cable" not in interface.observation.slices:
            raise OptionError("controller", name, "choose QuadSling-Payload-v0 or another one",
                              "needs an environment that observes a cable")  # fmt: skip
        super().__init__(name, interface, gains, laws=laws)

    def cable(self, observation: Array) -> Cable:
        """Return the cable in an observation."""
        vector, rate, held = (observation[..., self._at[name]] for name in ("cable", "cable_rate", "cable_held"))
        return Cable(vector, rate, held[..., 0] > 0.5)


class SwingPolicy(SlungPolicy):
    """Any law of the position with the swing term; where nothing hangs, the law alone."""

    def read(self, observation: Array) -> QuadrotorInput:
        flight, own = super().read(observation), self.gains.position
        du = swing_term(own.k_p, own.k_d, self.cable(observation), flight.acceleration_ref, flight.jerk_ref)
        return self.with_residual(flight, du)


class LoadPolicy(SlungPolicy):
    """Geometric control of the load above a time-delay attitude; where nothing hangs, PID of the position."""

    def step(self, state: Any, signals: QuadrotorInput, observation: Array) -> tuple[Array, LawState]:
        cable = self.cable(observation)

        def position(gains: LoadGains, own: Any, tracked: JointInput, period: float) -> tuple[Array, LawState]:
            return load_control(gains, own, tracked, cable, period)

        law = Law(self._position.start, position)
        return cascade(law, self._attitude, self.gains, state, signals, self._period)


def _load_start(gains: LoadGains, signals: JointInput, _period: float) -> LawState:
    return load_start(gains, signals)


def _no_load(gains: LoadGains, state: Any, signals: JointInput, period: float) -> tuple[Array, LawState]:
    """Compute the law where nothing hangs."""
    still = np.zeros_like(signals.q)
    return load_control(gains, state, signals, Cable(still, still, np.zeros(still.shape[:-1], np.bool_)), period)


LOAD_LAW = LawSpec(Law(_load_start, _no_load))


def make_quadrotor_or_slung(env: Any, *, law: str, preset: str | None = None, **gains: Any) -> QuadrotorPolicy:
    """Build the policy of a law for a quadrotor's environment, with or without a cable.

    Args:
        env: the environment that it will drive.
        law: name of the law: as for `controllers.quadrotor.make_quadrotor`, that with "+swing", or "geometric-load".
        preset: name of its gains; None for the law's default.
        gains: in place of the preset's, as for `controllers.quadrotor.make_quadrotor`.

    Raises:
        UnknownNameError: for a law that the quadrotor does not have, or an unknown preset.
        GainError: for an unknown gain or a value that is not allowed.
        OptionError: for a law that needs a cable, in an environment without one.
    """
    if law != LOAD and not law.endswith(SWING):
        return make_quadrotor(env, law=law, preset=preset, **gains)
    interface = ControlInterface.of(env)
    own = preset_gains(interface.robot, law, preset, AXES, gains)
    if law.endswith(SWING):
        return SwingPolicy(law, interface, own, laws=loop_laws(law.removesuffix(SWING)))
    return LoadPolicy(law, interface, own, laws=(LOAD_LAW, LAWS["tde"]))
