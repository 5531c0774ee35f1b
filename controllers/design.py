"""The valid range of m_bar for a robot, and the joint stiffness that follows: for `artde-gym design` and `doctor`.

Time-delay estimation converges where every eigenvalue of M(q)^-1 m_bar lies in (0, 2), along the whole reference
motion. At the sampling period L the law then holds a joint with the stiffness K_d m_bar / L and the damping m_bar / L.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import UnknownNameError, suggest_names
from controllers.drive import DRIVES, Drive
from controllers.law_table import LAWS, find_law, is_delayed, known_laws
from controllers.laws.errors import GainError
from controllers.laws.stability import largest_joint_m_bar, largest_m_bar, tde_eigenvalues
from controllers.laws.tde import TdeGains
from controllers.laws.tracking import check_positive_number
from controllers.loop import Loop
from controllers.motion import check_motion
from controllers.presets import LOOPS, law_presets, preset_gains

Array = NDArray[np.floating[Any]]

DELAYED = tuple(name for name in LAWS if is_delayed(name))
"""Laws of this project that estimate by time delay."""


@dataclasses.dataclass(frozen=True)
class Design:
    """Validity and stiffness of one loop's gains at a sampling period.

    Attributes:
        loop: that they drive.
        gains: with m_bar and k_d.
        period: L that the law divides by (s).
        eigenvalues: of M^-1 m_bar along the reference (k, n).
        limit: scalar m_bar below which all of them are valid, along the reference (k,).
        joint_limits: m_bar of each joint below which they are, the other joints as chosen, the smallest along the
            reference (n,); zero where the others alone leave the range, NaN where m_bar is a matrix with products.
    """

    loop: Loop
    gains: TdeGains
    period: float
    eigenvalues: Array
    limit: Array
    joint_limits: Array

    @property
    def valid(self) -> bool:
        return bool((self.eigenvalues > 0).all() and (self.eigenvalues < 2).all())

    @property
    def largest(self) -> float:
        """Scalar m_bar below which the loop is valid along the whole reference."""
        return float(self.limit.min())

    @property
    def m_bar(self) -> Array:
        """The chosen m_bar of each joint (n,)."""
        chosen = np.asarray(self.gains.m_bar, dtype=np.float64)
        return np.diagonal(chosen) if chosen.ndim == 2 else np.broadcast_to(chosen, len(self.loop.joints))

    @property
    def stiffness(self) -> Array:
        """K_d m_bar / L of each joint (n,)."""
        with np.errstate(over="ignore"):
            return np.asarray(self.gains.k_d, dtype=np.float64) * self.m_bar / self.period

    @property
    def used(self) -> float:
        """Share of the valid range that the chosen m_bar uses; 1 is the edge."""
        return float(self.eigenvalues.max()) / 2.0

    @property
    def room(self) -> float:
        """Factor by which the whole m_bar may grow up to the edge."""
        return 1.0 / self.used

    def to_dict(self) -> dict[str, Any]:
        """Return all of it in JSON's types, NaN as None."""
        loop = self.loop
        joints = zip(loop.joints, self.m_bar, self.joint_limits, self.stiffness, strict=True)
        return {
            "loop": loop.name,
            "unit": loop.unit,
            "period_s": self.period,
            "valid": self.valid,
            "largest_m_bar": self.largest,
            "eigenvalues": [float(self.eigenvalues.min()), float(self.eigenvalues.max())],
            "used": self.used,
            "room": _number(self.room),
            "joints": [
                {
                    "name": name,
                    "m_bar": float(chosen),
                    "largest_m_bar": _number(limit),
                    "stiffness": _number(stiffness),
                    "damping": _number(chosen / self.period),
                }
                for name, chosen, limit, stiffness in joints
            ],
            "along_the_reference": {"time_s": loop.time.tolist(), "largest_m_bar": self.limit.tolist()},
        }


def loops(robot: str, **motion: Any) -> list[Loop]:
    """List the loops of a robot along its reference.

    Args:
        robot: that has a drive with such a model.
        motion: arguments of the reference and the model; of the biped `actuator_inertia`, `speed`, `step_duration`.

    Raises:
        UnknownNameError: for any other robot.
        OptionError: for an argument that the robot's motion does not have, or out of range.
    """
    able = designed()
    if robot not in able:
        raise UnknownNameError("robot", robot, suggest_names(robot, able))
    check_motion(robot, able[robot], motion)
    return able[robot](**motion)


def designed() -> dict[str, Callable[..., list[Loop]]]:
    """Return the robots whose loops can be judged, with the functions that list their loops."""
    return {robot: drive.loops for robot, drive in DRIVES.items() if drive.loops is not None}


def judge(loop: Loop, gains: TdeGains, period: float) -> Design:
    """Compare the gains of a loop with its limits.

    Raises:
        GainError: for an m_bar that does not fit the loop, or is so large or small that its limits cannot be computed,
            or a period that is not above zero.
    """
    check_positive_number("period", period)
    try:
        with np.errstate(all="ignore"):  # the result tells
            eigenvalues = tde_eigenvalues(loop.inertia, gains.m_bar)
            each = largest_joint_m_bar(loop.inertia, gains.m_bar).min(axis=0)
    except np.linalg.LinAlgError as error:
        raise GainError("m_bar", gains.m_bar, f"of a size that can be compared with the inertia's ({error})") from error
    return Design(loop, gains, period, eigenvalues, largest_m_bar(loop.inertia), each)


def design(
    robot: str,
    law: str = "tde",
    preset: str | None = None,
    period: float | None = None,
    *,
    gains: dict[str, Any] | None = None,
    **motion: Any,
) -> list[Design]:
    """Work out, loop by loop, how large m_bar may be and how stiff the chosen gains are.

    Args:
        robot: that has a drive with a model, as `loops`.
        law: one of `DELAYED`, or of your own that is like one of these.
        preset: name of its gains; None for the law's default.
        period: L that the law divides by (s); None for the robot's usual sampling period.
        gains: in place of the preset's.
        motion: see `loops`.

    Raises:
        UnknownNameError: for an unknown robot or preset, or a law without a time-delay estimate.
        GainError: for a gain or period that is not allowed.
        OptionError: for an argument of the motion that is not allowed.
    """
    found = loops(robot, **motion)
    if law not in (able := delayed()):
        raise UnknownNameError("law with a time-delay estimate", law, suggest_names(law, able))
    chosen = preset_gains(robot, law, preset, len(found[0].joints), gains or {})
    length = DRIVES[robot].period if period is None else period
    return [judge(loop, _of_loop(chosen, loop, law, length), length) for loop in found]


def delayed() -> list[str]:
    """Return the laws that estimate by time delay, those from outside included."""
    return [name for name in known_laws() if is_delayed(name)]


def preset_designs(loop: Loop, drive: Drive, chosen: Callable[[str], bool] | None = None) -> list[Design]:
    """Judge a loop at the chosen presets, by default all, of laws that estimate by time delay."""
    return [
        judge(loop, _of_loop(entry.gains, loop, law, drive.period), drive.period)
        for law in delayed()
        for preset, entry in law_presets(drive, law).items()
        if chosen is None or chosen(preset)
    ]


def _number(value: float) -> float | None:
    """Return the value as JSON can write it."""
    return float(value) if np.isfinite(value) else None


def _of_loop(gains: Any, loop: Loop, law: str, period: float) -> TdeGains:
    """Return the gains of one loop, of a cascade or whole, as the law runs them."""
    own = getattr(gains, loop.name) if loop.name in LOOPS else gains
    return find_law(law).convert(own, period)
