"""Whether time-delay estimation converges at the gains that are shipped, for `artde-gym doctor`."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from artde_gym.doctor.outcome import Outcome
from artde_gym.multibody.dynamics import RigidBodyTree, joint_space_inertia
from artde_gym.robots.ojas.model import ActuatorInertia, ojas
from artde_gym.robots.ojas.walking import walking_pattern
from artde_gym.robots.q450.model import q450
from controllers.laws.validity import tde_eigenvalues, tde_is_valid
from controllers.presets import PRESETS, named_gains

DELAYED = ("tde", "atde", "artde", "tde+c", "tde+kd")
"""Laws that estimate by time delay."""
INVALID = "none"
"""The actuator model that is there to show what happens outside (0, 2)."""
REMEDY = "choose a smaller m_bar, or another actuator model"


def validity() -> list[Outcome]:
    """Every robot and actuator model, at the nominal inertias of the laws that need it."""
    outcomes = [_biped(actuator) for actuator in get_args(ActuatorInertia)]
    return outcomes + [outcome for loop in ("position", "attitude") for outcome in _quadrotor(loop)]


def _biped(actuator: ActuatorInertia) -> Outcome:
    """Along the walk at the default speed."""
    pattern = walking_pattern(0.1, 1.0, 8.0, 0.001)
    inertia = joint_space_inertia(RigidBodyTree(ojas(actuator)).mass_matrix(pattern.q[::50]))
    valid, found = _judged(inertia, _nominal("ojas", "m_bar", tuned=False))
    what = f"biped, actuators {actuator!r}"
    if actuator == INVALID and not valid:
        return Outcome(what, "ok", f"{found}: outside, as its documentation says")
    return Outcome(what, "ok", found) if valid else Outcome(what, "failed", found, REMEDY)


def _quadrotor(loop: str) -> list[Outcome]:
    """One loop of the bare vehicle; tuned gains may lie outside, where the rotors' lag leaves room."""
    robot = q450()
    inertia = np.eye(3) * robot.mass if loop == "position" else np.diag(robot.base.inertia)
    outcomes: list[Outcome] = []
    for tuned in (False, True):
        what = f"quadrotor, {loop}" + (", presets 'tuned'" if tuned else "")
        valid, found = _judged(inertia, _nominal("q450", f"m_bar_{'p' if loop == 'position' else 'q'}", tuned))
        status = "ok" if valid else "missing" if tuned else "failed"
        remedy = "" if valid else "fly with the default preset where you need the margin" if tuned else REMEDY
        outcomes.append(Outcome(what, status, found, remedy))
    return outcomes


def _nominal(robot: str, gain: str, tuned: bool) -> set[Any]:
    """All nominal inertias of the presets that tuning found, or of the others."""
    return {
        named_gains(entry.gains)[gain]
        for (law, preset), entry in PRESETS[robot].items()
        if law in DELAYED and (preset == "tuned") == tuned
    }


def _judged(inertia: NDArray[Any], nominal: set[Any]) -> tuple[bool, str]:
    """Whether all eigenvalues are valid, and their range."""
    eigenvalues = np.array([tde_eigenvalues(inertia, m_bar) for m_bar in sorted(nominal)])
    valid = all(tde_is_valid(inertia, m_bar).all() for m_bar in nominal)
    return valid, f"{eigenvalues.min():.3f} to {eigenvalues.max():.3f}"
