"""Whether time-delay estimation converges at the gains that are shipped, for `artde-gym doctor`."""

from __future__ import annotations

from collections.abc import Sequence

from artde_gym.doctor.outcome import Outcome
from controllers.design import Design
from controllers.drive import DRIVES

REMEDY = "choose a smaller m_bar, or another actuator model"


def validity() -> list[Outcome]:
    """Every robot whose drive has a check of it."""
    return [found for drive in DRIVES.values() if drive.stability is not None for found in drive.stability()]


def judged(designs: Sequence[Design]) -> tuple[bool, str]:
    """Tell whether all eigenvalues are valid, and their range."""
    low = min(one.eigenvalues.min() for one in designs)
    high = max(one.eigenvalues.max() for one in designs)
    return all(one.valid for one in designs), f"{low:.3f} to {high:.3f}"
