"""The laws on `JointInput` by name, behind one pair of signatures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from controllers.laws.artde import ArtdeGains, artde, artde_init
from controllers.laws.asmc import AsmcGains, asmc, asmc_init
from controllers.laws.atde import AtdeGains, atde, atde_init
from controllers.laws.indi import IndiGains, indi, indi_init
from controllers.laws.pid import PidGains, identity_gains, pid, pid_init
from controllers.laws.positional_pid import PositionalPidGains, positional_pid, positional_pid_init
from controllers.laws.rigid_attitude import RigidAttitudeGains, rigid_attitude
from controllers.laws.switched import (
    SwitchedArtdeGains,
    SwitchedAtdeGains,
    SwitchedTdeGains,
    switched_artde,
    switched_artde_init,
    switched_atde,
    switched_atde_init,
    switched_tde,
    switched_tde_init,
)
from controllers.laws.tde import ConstantGains, TdeGains, constant_gain_tde, equivalent_gains, tde, tde_init
from controllers.laws.tracking import Array, JointInput, Law, LawState


class Entry(NamedTuple):
    """A law, and how a preset's gains (with the sampling period) become its own.

    Attributes:
        gains: dataclass of its presets' gains, if it drives joints; it is then a controller under its name.
        text: description of that controller.
        reads: fields of the observation that it takes after the sampling period.
    """

    law: Law
    convert: Callable[[Any, float], Any]
    gains: type[Any] | None = None
    text: str = ""
    reads: tuple[str, ...] = ()


class Nothing(NamedTuple):
    """The memory of a law without one."""


def _tde_init(_gains: TdeGains, signals: JointInput, period: float) -> LawState:
    return tde_init(signals, period)


def _pid_init(_gains: PidGains, signals: JointInput, period: float) -> LawState:
    return pid_init(signals, period)


def _positional_pid_init(gains: PositionalPidGains, signals: JointInput, _period: float) -> LawState:
    return positional_pid_init(gains, signals)


def _asmc_init(gains: AsmcGains, signals: JointInput, _period: float) -> LawState:
    return asmc_init(gains, signals)


def _indi_init(_gains: IndiGains, signals: JointInput, period: float) -> LawState:
    return indi_init(signals, period)


def _rigid_attitude_init(_gains: RigidAttitudeGains, _signals: JointInput, _period: float) -> LawState:
    return Nothing()


def _rigid_attitude(
    gains: RigidAttitudeGains, state: LawState, signals: JointInput, _period: float
) -> tuple[Array, LawState]:
    return rigid_attitude(gains, signals), state


def _switched(law: Law, gains: type[Any], name: str) -> Entry:
    return Entry(law, _same, gains, f"biped: {name} with gains for each phase of support", ("contact",))


def _same(gains: Any, _period: float) -> Any:
    return gains


def _equivalent(gains: ConstantGains, _period: float) -> TdeGains:
    return equivalent_gains(gains)


LAWS: dict[str, Entry] = {
    "tde": Entry(Law(_tde_init, tde), _same, TdeGains, "time-delay estimation"),
    "atde": Entry(Law(atde_init, atde), _same, AtdeGains, "TDE + one adaptive gain"),
    "artde": Entry(Law(artde_init, artde), _same, ArtdeGains, "TDE + adaptive-robust term, as printed in the thesis"),
    "pid": Entry(
        Law(_pid_init, pid), identity_gains, TdeGains, "PID; biped: equal to TDE, quadrotor: positional, in both loops"
    ),
    "tde+c": Entry(
        Law(_tde_init, constant_gain_tde), _same, ConstantGains, "TDE + robust term of constant gain (ablation)"
    ),
    "tde+kd": Entry(
        Law(_tde_init, tde), _equivalent, ConstantGains, "TDE at the stiffer gains equivalent to it (ablation)"
    ),
    "asmc": Entry(Law(_asmc_init, asmc), _same, AsmcGains, "quadrotor: adaptive sliding mode (this project's own law)"),
    "indi": Entry(Law(_indi_init, indi), _same, IndiGains, "quadrotor: incremental nonlinear dynamic inversion"),
    "tde-switched": _switched(Law(switched_tde_init, switched_tde), SwitchedTdeGains, "TDE"),
    "atde-switched": _switched(Law(switched_atde_init, switched_atde), SwitchedAtdeGains, "ATDE"),
    "artde-switched": _switched(Law(switched_artde_init, switched_artde), SwitchedArtdeGains, "ARTDE"),
    "positional-pid": Entry(Law(_positional_pid_init, positional_pid), _same),
    "rigid-attitude": Entry(Law(_rigid_attitude_init, _rigid_attitude), _same),
}

GAINS: dict[str, type[Any]] = {name: entry.gains for name, entry in LAWS.items() if entry.gains is not None}
"""Law -> the gains that drive joints with it."""
