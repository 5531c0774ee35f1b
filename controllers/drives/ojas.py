"""Drive of Ojas, the biped: one law on all joints."""

from __future__ import annotations

from typing import get_args

import numpy as np

from artde_gym.doctor.check_result import CheckResult
from artde_gym.multibody.dynamics import RigidBodyTree, constrained_inverse_inertia, joint_space_inertia
from artde_gym.robots.ojas.model import ActuatorInertia, ojas
from controllers.design import preset_designs
from controllers.drive import Drive
from controllers.loop import Loop, SupportPhase
from controllers.presets.ojas import OJAS, OJAS_RANGES, STIFF_ACTUATORS, SUPPORT_ACTUATORS
from controllers.stability_check import REMEDY, judged
from controllers.support_design import preset_supports

INVALID = "none"
"""The actuator model that is there to show what happens outside (0, 2)."""
_WALKED, _SAMPLED = 8.0, 0.01  # s, of the reference walk and between its samples
_STEADY = 8  # steps, after which every stride is equal
_LOADED = 0.001  # share of the weight below which a foot does not stand


def loops(*, actuator_inertia: ActuatorInertia = "rotor", speed: float = 0.1, step_duration: float = 1.0) -> list[Loop]:
    """Return the joints along a walk.

    Raises:
        OptionError: for an argument out of range.
    """
    from artde_gym.robots.ojas.walking import walking_pattern  # SciPy's splines: only when the loops are asked for

    pattern = walking_pattern(speed, step_duration, _WALKED, _SAMPLED)
    spec = ojas(actuator_inertia)
    inertia = joint_space_inertia(RigidBodyTree(spec).mass_matrix(pattern.q))
    return [Loop("joints", spec.actuated, "kg m^2", _SAMPLED * np.arange(len(inertia)), inertia)]


def supports(
    *, actuator_inertia: ActuatorInertia = "rotor", speed: float = 0.1, step_duration: float = 1.0
) -> list[SupportPhase]:
    """Return the phases of support of a stride in steady walking, as planned.

    Raises:
        OptionError: for an argument out of range.
    """
    from artde_gym.robots.ojas.walking import STAND, check_gait, walking_pattern  # as above

    speed, step_duration = check_gait(speed, step_duration)
    first, last = (round((STAND + steps * step_duration) / _SAMPLED) for steps in (_STEADY, _STEADY + 2))
    pattern = walking_pattern(speed, step_duration, 2 * STAND + (_STEADY + 4) * step_duration, _SAMPLED)
    spec, load, q = ojas(actuator_inertia), pattern.load_left[first:last], pattern.q[first:last]
    tree, time = RigidBodyTree(spec), _SAMPLED * np.arange(first, last)
    left, right = (load > 1 - _LOADED), (load < _LOADED)
    feet = {"left": (left, spec.feet[:1]), "both": (~left & ~right, spec.feet), "right": (right, spec.feet[1:])}
    found: list[SupportPhase] = []
    for name, (chosen, standing) in feet.items():
        jacobian = np.concatenate([tree.jacobian(foot, q[chosen]) for foot in standing], axis=-2)
        inverse = constrained_inverse_inertia(tree.mass_matrix(q[chosen]), jacobian)
        found.append(SupportPhase(name, spec.actuated, time[chosen], inverse, float(chosen.mean())))
    return found


def stability() -> list[CheckResult]:
    """Judge the presets with every actuator model, the stiff one with its own, along the walk at the default speed."""
    return [*(_judged(actuator) for actuator in get_args(ActuatorInertia)), _judged_supports()]


def _judged(actuator: ActuatorInertia) -> CheckResult:
    (loop,) = loops(actuator_inertia=actuator)
    without = {"tuned"} if actuator == STIFF_ACTUATORS else {"tuned", "stiff"}
    valid, found = judged(preset_designs(loop, DRIVE, lambda preset: preset not in without))
    what = f"biped, actuators {actuator!r}" + (", presets 'stiff' too" if "stiff" not in without else "")
    if actuator == INVALID and not valid:
        return CheckResult(what, "ok", f"{found}: outside, as its documentation says")
    return CheckResult(what, "ok", found) if valid else CheckResult(what, "failed", found, REMEDY)


def _judged_supports() -> CheckResult:
    """Judge the presets of the laws that switch, each nominal inertia in every phase of support."""
    designs = preset_supports(supports(actuator_inertia=SUPPORT_ACTUATORS), DRIVE)
    found = f"at most {max(one.largest for one in designs):.3f} in any phase"
    what = "biped, laws that switch"
    valid = all(one.valid for one in designs)
    return CheckResult(what, "ok", found) if valid else CheckResult(what, "failed", found, REMEDY)


DRIVE = Drive("ojas", OJAS, OJAS_RANGES, period=0.001, loops=loops, supports=supports, stability=stability)
