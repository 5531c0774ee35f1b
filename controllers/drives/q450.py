"""Drive of the Q450, the quadrotor: a cascade of two laws."""

from __future__ import annotations

import numpy as np

from artde_gym.doctor.check_result import CheckResult
from artde_gym.robots.q450.model import q450
from controllers.design import preset_designs
from controllers.drive import Drive
from controllers.loop import Loop
from controllers.presets.q450 import Q450, Q450_RANGES
from controllers.slung import make_quadrotor_or_slung
from controllers.stability_check import REMEDY, judged


def loops() -> list[Loop]:
    """Return position and attitude of the bare vehicle."""
    vehicle = q450()
    body, still = np.diag(vehicle.base.inertia), np.zeros(1)
    return [
        Loop("position", ("x", "y", "z"), "kg", still, vehicle.mass * np.eye(3)[None]),
        Loop("attitude", ("roll", "pitch", "yaw"), "kg m^2", still, body[None]),
    ]


def stability() -> list[CheckResult]:
    """Judge each loop's presets; tuned gains may lie outside, where the rotors' lag leaves room."""
    return [_judged(loop, tuned) for loop in loops() for tuned in (False, True)]


def _judged(loop: Loop, tuned: bool) -> CheckResult:
    what = f"quadrotor, {loop.name}" + (", presets 'tuned'" if tuned else "")
    valid, found = judged(preset_designs(loop, DRIVE, lambda preset: (preset == "tuned") == tuned))
    status = "ok" if valid else "missing" if tuned else "failed"
    remedy = "" if valid else "fly with the default preset where you need the margin" if tuned else REMEDY
    return CheckResult(what, status, found, remedy)


DRIVE = Drive("q450", Q450, Q450_RANGES, make_quadrotor_or_slung, period=0.015, loops=loops, stability=stability)
