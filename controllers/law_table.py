"""The laws on `JointInput` by name, behind one pair of signatures."""

from __future__ import annotations

from typing import Any, NamedTuple

from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.registration import registered_controllers, resolved
from controllers.law_spec import LawSpec
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


def _switched(law: Law, gains: type[Any], name: str) -> LawSpec:
    return LawSpec(law, gains, f"biped: {name} with gains for each phase of support", reads=("contact",))


def _equivalent(gains: ConstantGains, _period: float) -> TdeGains:
    return equivalent_gains(gains)


LAWS: dict[str, LawSpec] = {
    "tde": LawSpec(Law(_tde_init, tde), TdeGains, "time-delay estimation", delayed=True),
    "atde": LawSpec(Law(atde_init, atde), AtdeGains, "TDE + one adaptive gain", delayed=True),
    "artde": LawSpec(
        Law(artde_init, artde), ArtdeGains, "TDE + adaptive-robust term, as printed in the thesis", delayed=True
    ),
    "pid": LawSpec(
        Law(_pid_init, pid),
        TdeGains,
        "PID; biped: equal to TDE, quadrotor: positional, in both loops",
        like="tde",
        convert=identity_gains,
        delayed=False,
    ),
    "tde+c": LawSpec(
        Law(_tde_init, constant_gain_tde),
        ConstantGains,
        "TDE + robust term of constant gain (ablation)",
        delayed=True,
    ),
    "tde+kd": LawSpec(
        Law(_tde_init, tde),
        ConstantGains,
        "TDE at the stiffer gains equivalent to it (ablation)",
        like="tde+c",
        convert=_equivalent,
    ),
    "asmc": LawSpec(Law(_asmc_init, asmc), AsmcGains, "quadrotor: adaptive sliding mode (this project's own law)"),
    "indi": LawSpec(Law(_indi_init, indi), IndiGains, "quadrotor: incremental nonlinear dynamic inversion"),
    "tde-switched": _switched(Law(switched_tde_init, switched_tde), SwitchedTdeGains, "TDE"),
    "atde-switched": _switched(Law(switched_atde_init, switched_atde), SwitchedAtdeGains, "ATDE"),
    "artde-switched": _switched(Law(switched_artde_init, switched_artde), SwitchedArtdeGains, "ARTDE"),
    "positional-pid": LawSpec(Law(_positional_pid_init, positional_pid)),
    "rigid-attitude": LawSpec(Law(_rigid_attitude_init, _rigid_attitude)),
}


def known_laws() -> dict[str, LawSpec]:
    """Return the laws that are controllers: this project's, then those of `register_law` and of plug-ins, by name."""
    own = {name: spec for name, spec in LAWS.items() if spec.gains is not None}
    return own | {name: find_law(point) for name, point in _registered().items()}


def find_law(name: str) -> LawSpec:
    """Return a law by its key in `LAWS`, the name that it was registered under, or its "module:object".

    Raises:
        UnknownNameError: if there is none.
        OptionError: if the object is no `LawSpec`.
    """
    if name in LAWS:
        return LAWS[name]
    point = name if ":" in name else _registered().get(name)
    if point is None:
        known = [*LAWS, *_registered()]
        raise UnknownNameError("law", name, suggest_names(name, known))
    try:
        found: Any = resolved(point)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownNameError(
            "law", point, 'give a "module:object" that can', f"cannot be imported ({error})"
        ) from error
    if not isinstance(found, LawSpec):
        raise OptionError("law", point, "the module and name of a LawSpec, with a colon between them")
    return found


def is_delayed(name: str) -> bool:
    """Return whether a law estimates by time delay."""
    spec = find_law(name)
    return (spec.like is not None and is_delayed(spec.like)) if spec.delayed is None else spec.delayed


def is_switched(name: str) -> bool:
    """Return whether a law has a nominal inertia for each phase of support."""
    return issubclass(find_law(name).gains or object, SwitchedTdeGains)


def _registered() -> dict[str, str]:
    """Return the "module:object" of each law from outside by the name of its controller."""
    laws = {name: spec.kwargs.get("law") for name, spec in registered_controllers().items()}
    return {name: law for name, law in laws.items() if isinstance(law, str) and ":" in law}
