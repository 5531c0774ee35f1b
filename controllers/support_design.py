"""Nominal inertias for the phases of support of a robot that walks: their validity, and how to derive them.

With feet that stand, tau moves the joints by qdd = A tau + ..., A the joint block of the constrained inverse inertia.
Time-delay estimation converges where the eigenvalues of A m_bar are below 2; those of directions that the contacts
block are zero. The derived inertia of a phase is mean(A)^-1 with bounded eigenvalues.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import UnknownNameError, suggest_names
from controllers.drive import DRIVES, Drive
from controllers.law_table import LAWS, is_switched, known_laws
from controllers.laws.stability import BLOCKED, largest_support_m_bar, support_eigenvalues, support_m_bar
from controllers.laws.switched import SwitchedTdeGains
from controllers.laws.tde import Inertia
from controllers.loop import SupportPhase
from controllers.motion import check_motion
from controllers.presets import law_presets, preset_gains

Array = NDArray[np.floating[Any]]

SWITCHED = tuple(name for name in LAWS if is_switched(name))
"""Laws of this project with a nominal inertia for each phase of support."""


@dataclasses.dataclass(frozen=True)
class SupportDesign:
    """Validity of the nominal inertia of one phase of support.

    Attributes:
        phase: in which it is used.
        m_bar: the nominal inertia.
        eigenvalues: of A m_bar along the phase (k, n).
        largest: the largest eigenvalue in any phase of support.
        limit: scalar m_bar below which all eigenvalues are valid in this phase.
        derived: from spec and gait (n, n); None where contacts block a direction.
    """

    phase: SupportPhase
    m_bar: Inertia
    eigenvalues: Array
    largest: float
    limit: float
    derived: Array | None

    @property
    def valid(self) -> bool:
        """Tell whether it converges in every phase, also where the contact is told wrongly."""
        return self.largest < 2.0

    @property
    def felt(self) -> tuple[float, float]:
        """Smallest and largest eigenvalue of A m_bar in directions that the contacts do not block."""
        free = self.eigenvalues[self.eigenvalues > BLOCKED]
        return float(free.min()), float(free.max())

    @property
    def blocked(self) -> int:
        """Number of directions that the contacts block."""
        return int((self.eigenvalues <= BLOCKED).sum(axis=-1).max())

    def to_dict(self) -> dict[str, Any]:
        """Return all of it in JSON's types."""
        return {
            "phase": self.phase.name,
            "share": self.phase.share,
            "blocked": self.blocked,
            "eigenvalues": list(self.felt),
            "largest_in_any_phase": self.largest,
            "largest_m_bar": self.limit,
            "valid": self.valid,
            "m_bar": np.asarray(self.m_bar).tolist(),
            "derived": None if self.derived is None else self.derived.tolist(),
        }


def design_supports(
    robot: str,
    law: str = "tde-switched",
    preset: str | None = None,
    cap: float = 0.09,
    *,
    gains: dict[str, Any] | None = None,
    **motion: Any,
) -> list[SupportDesign]:
    """Judge a law's nominal inertias in every phase of support, and derive those of this robot and gait.

    Args:
        robot: that has a drive with phases of support.
        law: one of `SWITCHED`, or of your own with their gains.
        preset: name of its gains; None for the law's default.
        cap: largest eigenvalue of what is derived (kg m^2).
        gains: in place of the preset's.
        motion: arguments of the stride and the model; of the biped `actuator_inertia`, `speed`, `step_duration`.

    Raises:
        UnknownNameError: for a robot without such phases, an unknown preset, or a law that does not switch.
        GainError: for a gain or a cap that is not allowed.
        OptionError: for an argument of the motion that is not allowed.
    """
    able = {name: drive.supports for name, drive in DRIVES.items() if drive.supports is not None}
    if robot not in able:
        raise UnknownNameError("robot with phases of support", robot, suggest_names(robot, able))
    if law not in (laws := switched()):
        raise UnknownNameError("law that switches", law, suggest_names(law, laws))
    check_motion(robot, able[robot], motion)
    phases = able[robot](**motion)
    chosen = preset_gains(robot, law, preset, len(phases[0].joints), gains or {})
    return judge_supports(phases, chosen, cap)


def judge_supports(phases: Sequence[SupportPhase], gains: SwitchedTdeGains, cap: float) -> list[SupportDesign]:
    """Judge the nominal inertia of each phase in all of them.

    Raises:
        GainError: for an inertia that does not fit the joints, or a cap that is not above zero.
    """
    own: Mapping[str, Inertia] = {"left": gains.m_bar_left, "both": gains.m_bar, "right": gains.m_bar_right}
    found: list[SupportDesign] = []
    for phase in phases:
        m_bar = own[phase.name]
        everywhere = [support_eigenvalues(other.inverse_inertia, m_bar) for other in phases]
        eigenvalues = support_eigenvalues(phase.inverse_inertia, m_bar)
        limit = float(largest_support_m_bar(phase.inverse_inertia).min())
        largest = max(float(values.max()) for values in everywhere)
        found.append(SupportDesign(phase, m_bar, eigenvalues, largest, limit, _derived(phase, cap)))
    return found


def switched() -> list[str]:
    """Return the laws with a nominal inertia for each phase of support, those from outside included."""
    return [name for name in known_laws() if is_switched(name)]


def preset_supports(phases: Sequence[SupportPhase], drive: Drive) -> list[SupportDesign]:
    """Judge all presets of laws that switch."""
    chosen = [preset.gains for law in switched() for preset in law_presets(drive, law).values()]
    return [one for gains in chosen for one in judge_supports(phases, gains, 1.0)]


def derived_gains(designs: Sequence[SupportDesign]) -> dict[str, Any]:
    """Return the derived inertias as gains, to be given in place of a preset's."""
    return {f"m_bar_{one.phase.name}": one.derived.tolist() for one in designs if one.derived is not None}


def _derived(phase: SupportPhase, cap: float) -> Array | None:
    if np.linalg.eigvalsh(phase.inverse_inertia.mean(axis=0))[0] <= BLOCKED:
        return None
    return support_m_bar(phase.inverse_inertia, cap)
