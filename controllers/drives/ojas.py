"""Drive of Ojas, the biped: one law on all joints."""

from __future__ import annotations

from typing import get_args

import numpy as np

from artde_gym.doctor.check_result import CheckResult
from artde_gym.multibody.dynamics import RigidBodyTree, joint_space_inertia
from artde_gym.robots.ojas.model import ActuatorInertia, ojas
from controllers.design import preset_designs
from controllers.drive import Drive
from controllers.loop import Loop
from controllers.presets.ojas import OJAS, OJAS_RANGES, STIFF_ACTUATORS
from controllers.stability_check import REMEDY, judged

INVALID = "none"
"""The actuator model that is there to show what happens outside (0, 2)."""
_WALKED, _SAMPLED = 8.0, 0.01  # s, of the reference walk and between its samples


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


def stability() -> list[CheckResult]:
    """Judge the presets with every actuator model, the stiff one with its own, along the walk at the default speed."""
    return [_judged(actuator) for actuator in get_args(ActuatorInertia)]


def _judged(actuator: ActuatorInertia) -> CheckResult:
    (loop,) = loops(actuator_inertia=actuator)
    without = {"tuned"} if actuator == STIFF_ACTUATORS else {"tuned", "stiff"}
    valid, found = judged(preset_designs(loop, DRIVE, lambda preset: preset not in without))
    what = f"biped, actuators {actuator!r}"
    if actuator == INVALID and not valid:
        return CheckResult(what, "ok", f"{found}: outside, as its documentation says")
    return CheckResult(what, "ok", found) if valid else CheckResult(what, "failed", found, REMEDY)


DRIVE = Drive("ojas", OJAS, OJAS_RANGES, period=0.001, loops=loops, stability=stability)
