"""Whether time-delay estimation converges at the gains that are shipped, for `artde-gym doctor`."""

from __future__ import annotations

import functools
from collections.abc import Sequence

from artde_gym.doctor.check_result import CheckResult
from controllers.design import Design, preset_designs
from controllers.drive import DRIVES, Drive

REMEDY = "choose a smaller m_bar, or another actuator model"


def stability() -> list[CheckResult]:
    """Time-delay estimation converges: eigenvalues of M^-1 m_bar in (0, 2).

    Every robot: by the check that its drive brings, else all presets of all loops.
    """
    return [found for drive in DRIVES.values() for found in (drive.stability or functools.partial(_presets, drive))()]


def _presets(drive: Drive) -> list[CheckResult]:
    """Judge each loop that a drive lists at the presets of its laws."""
    outcomes: list[CheckResult] = []
    for loop in [] if drive.loops is None else drive.loops():
        designs = [one for tuned in (False, True) for one in preset_designs(loop, drive, tuned=tuned)]
        if designs:
            valid, found = judged(designs)
            status, remedy = ("ok", "") if valid else ("failed", REMEDY)
            outcomes.append(CheckResult(f"{drive.robot}, {loop.name}", status, found, remedy))
    return outcomes


def judged(designs: Sequence[Design]) -> tuple[bool, str]:
    """Tell whether all eigenvalues are valid, and their range."""
    low = min(one.eigenvalues.min() for one in designs)
    high = max(one.eigenvalues.max() for one in designs)
    return all(one.valid for one in designs), f"{low:.3f} to {high:.3f}"
