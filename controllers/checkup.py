"""Whether time-delay estimation converges at the gains that are shipped, for `artde-gym doctor`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

from artde_gym.doctor.outcome import Outcome
from artde_gym.robots.ojas.model import ActuatorInertia
from controllers.design import Design, Loop, loops, preset_designs

INVALID = "none"
"""The actuator model that is there to show what happens outside (0, 2)."""
REMEDY = "choose a smaller m_bar, or another actuator model"


def validity() -> list[Outcome]:
    """Time-delay estimation converges: eigenvalues of M^-1 m_bar in (0, 2).

    Every robot and actuator model, at the nominal inertias of the laws that need it.
    """
    outcomes = [_biped(actuator) for actuator in get_args(ActuatorInertia)]
    return outcomes + [outcome for loop in loops("q450") for outcome in _quadrotor(loop)]


def _biped(actuator: ActuatorInertia) -> Outcome:
    """Along the walk at the default speed."""
    (loop,) = loops("ojas", actuator)
    valid, found = _judged(preset_designs(loop, "ojas", tuned=False))
    what = f"biped, actuators {actuator!r}"
    if actuator == INVALID and not valid:
        return Outcome(what, "ok", f"{found}: outside, as its documentation says")
    return Outcome(what, "ok", found) if valid else Outcome(what, "failed", found, REMEDY)


def _quadrotor(loop: Loop) -> list[Outcome]:
    """One loop of the bare vehicle; tuned gains may lie outside, where the rotors' lag leaves room."""
    outcomes: list[Outcome] = []
    for tuned in (False, True):
        what = f"quadrotor, {loop.name}" + (", presets 'tuned'" if tuned else "")
        valid, found = _judged(preset_designs(loop, "q450", tuned=tuned))
        status = "ok" if valid else "missing" if tuned else "failed"
        remedy = "" if valid else "fly with the default preset where you need the margin" if tuned else REMEDY
        outcomes.append(Outcome(what, status, found, remedy))
    return outcomes


def _judged(designs: Sequence[Design]) -> tuple[bool, str]:
    """Whether all eigenvalues are valid, and their range."""
    low = min(one.eigenvalues.min() for one in designs)
    high = max(one.eigenvalues.max() for one in designs)
    return all(one.valid for one in designs), f"{low:.3f} to {high:.3f}"
