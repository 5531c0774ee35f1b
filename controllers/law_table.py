"""The laws on `Signals` by name, behind one pair of signatures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from controllers.laws.artde import ArtdeGains, artde, artde_start
from controllers.laws.asmc import AsmcGains, asmc, asmc_start
from controllers.laws.atde import AtdeGains, atde, atde_start
from controllers.laws.indi import IndiGains, indi, indi_start
from controllers.laws.pid import PidGains, identity_gains, pid, pid_start
from controllers.laws.positional_pid import PositionalPidGains, positional_pid, positional_pid_start
from controllers.laws.rigid_attitude import RigidAttitudeGains, rigid_attitude
from controllers.laws.tde import ConstantGains, TdeGains, constant_gain_tde, equivalent_gains, tde, tde_start
from controllers.laws.tracking import Array, Law, Memory, Signals


class Entry(NamedTuple):
    """A law, and how a preset's gains (with the sampling period) become its own."""

    law: Law
    convert: Callable[[Any, float], Any]


class Nothing(NamedTuple):
    """The memory of a law without one."""


def _tde_start(_gains: TdeGains, signals: Signals, period: float) -> Memory:
    return tde_start(signals, period)


def _pid_start(_gains: PidGains, signals: Signals, period: float) -> Memory:
    return pid_start(signals, period)


def _positional_pid_start(gains: PositionalPidGains, signals: Signals, _period: float) -> Memory:
    return positional_pid_start(gains, signals)


def _asmc_start(gains: AsmcGains, signals: Signals, _period: float) -> Memory:
    return asmc_start(gains, signals)


def _indi_start(_gains: IndiGains, signals: Signals, period: float) -> Memory:
    return indi_start(signals, period)


def _rigid_attitude_start(_gains: RigidAttitudeGains, _signals: Signals, _period: float) -> Memory:
    return Nothing()


def _rigid_attitude(
    gains: RigidAttitudeGains, memory: Memory, signals: Signals, _period: float
) -> tuple[Array, Memory]:
    return rigid_attitude(gains, signals), memory


def _same(gains: Any, _period: float) -> Any:
    return gains


def _equivalent(gains: ConstantGains, _period: float) -> TdeGains:
    return equivalent_gains(gains)


GAINS: dict[str, type[Any]] = {
    "tde": TdeGains,
    "atde": AtdeGains,
    "artde": ArtdeGains,
    "pid": TdeGains,
    "tde+c": ConstantGains,
    "tde+kd": ConstantGains,
    "asmc": AsmcGains,
    "indi": IndiGains,
}
"""Law -> the gains that drive joints with it."""

LAWS: dict[str, Entry] = {
    "tde": Entry(Law(_tde_start, tde), _same),
    "atde": Entry(Law(atde_start, atde), _same),
    "artde": Entry(Law(artde_start, artde), _same),
    "pid": Entry(Law(_pid_start, pid), identity_gains),
    "tde+c": Entry(Law(_tde_start, constant_gain_tde), _same),
    "tde+kd": Entry(Law(_tde_start, tde), _equivalent),
    "positional-pid": Entry(Law(_positional_pid_start, positional_pid), _same),
    "asmc": Entry(Law(_asmc_start, asmc), _same),
    "indi": Entry(Law(_indi_start, indi), _same),
    "rigid-attitude": Entry(Law(_rigid_attitude_start, _rigid_attitude), _same),
}
