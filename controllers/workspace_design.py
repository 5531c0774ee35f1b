"""Gains of time-delay control for an arm, judged over its workspace: for `artde-gym design` and `doctor`.

The largest error after a step of the torque is L dtau / (m_bar e omega), as that of dry friction when a joint reverses.
Rounding of encoders makes torques chatter (`controllers.mode`); a low-pass on the velocity lowers that, and with it the
bandwidth that is stable.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.multibody.spec import RobotSpec
from artde_gym.robots.arm.workspace import largest_weight, smallest_inertia, workspace_inertia
from artde_gym.robots.joint_task import TIME_STEP
from controllers.arm_design import LEVEL, LOADED, MARGIN, ArmGains, design_arm, stable_factors
from controllers.laws.errors import GainError
from controllers.laws.stability import largest_m_bar, tde_eigenvalues
from controllers.laws.tde import TdeGains
from controllers.mode import force_noise, spectral_radius

CHATTER = 0.05
"""Share of a joint's largest torque above which a low-pass is proposed for chatter."""
CUTOFFS = tuple(0.45 / 1.25**i for i in range(24))
"""Low-passes that are tried, as shares of the sampling rate."""
SLOWER = tuple(np.geomspace(1.0, 0.05, 40).tolist())
"""Factors of the bandwidth that are tried behind each of them."""

Array = NDArray[np.floating[Any]]


@dataclasses.dataclass(frozen=True)
class WorkspaceDesign:
    """Gains for an arm over its workspace.

    Attributes:
        spec: the arm.
        gains: of the law.
        period: L (s).
        bits: of encoders per turn; None for exact angles.
    """

    spec: RobotSpec
    gains: ArmGains
    period: float
    bits: float | None = None

    @functools.cached_property
    def eigenvalues(self) -> Array:
        """Eigenvalues of M^-1 m_bar (poses, n), in rising order."""
        return tde_eigenvalues(workspace_inertia(self.spec), self.gains.m_bar)

    @functools.cached_property
    def scalar(self) -> float:
        """One m_bar for all joints whose largest eigenvalue is the design's."""
        return float(largest_m_bar(workspace_inertia(self.spec)).min()) * LEVEL / 2

    @functools.cached_property
    def scalar_eigenvalues(self) -> Array:
        """Eigenvalues of M^-1 with the scalar m_bar (poses, n), in rising order."""
        return tde_eigenvalues(workspace_inertia(self.spec), self.scalar)

    @property
    def valid(self) -> bool:
        """True if time-delay estimation converges in all poses, and the gains are stable there."""
        return bool(self.eigenvalues.min() > 0 and self.eigenvalues.max() < 2) and min(self.factors) > 1

    @property
    def margin(self) -> float:
        """Factor by which m_bar may grow up to the edge, the largest eigenvalue 2."""
        return 2.0 / float(self.eigenvalues.max())

    @property
    def omega(self) -> float:
        """Bandwidth (rad/s)."""
        return math.sqrt(self.gains.k_p)

    @property
    def factors(self) -> tuple[float, float]:
        """Factors of the bandwidth at which the largest and the smallest eigenvalue, with a payload, are unstable."""
        low, high = self._range
        return stable_factors(self.gains.k_p, self.gains.k_d, low, high, self.period) if high < 2 else (0.0, 0.0)

    @property
    def stiffness(self) -> Array:
        """K_d m_bar / L of each joint (n,) (Nm/rad or N/m)."""
        return self.gains.k_d * self._m_bar / self.period

    @property
    def friction_error(self) -> Array:
        """Largest error of each joint (n,) (rad or m) when its dry friction reverses."""
        return self.period * 2 * self._of_links("coulomb") / (self._m_bar * math.e * self.omega)

    @property
    def slip(self) -> Array:
        """Speed (n,) (rad/s or m/s) that dry friction needs where an explicit time step is to be stable."""
        return self._of_links("coulomb") * TIME_STEP / smallest_inertia(self.spec)

    @functools.cached_property
    def weight(self) -> Array:
        """Share of each joint's torque (n,) that the arm's weight takes in the worst pose."""
        return largest_weight(self.spec) / np.asarray(self.spec.torque_limits)

    def chatter(self, cutoff_hz: float | None = None, slower: float = 1.0) -> Array:
        """Return the standard deviation of torques behind the encoders over their limits (n,); zero without encoders.

        Args:
            cutoff_hz: low-pass on the velocity (Hz); None without.
            slower: factor of the bandwidth.
        """
        if self.bits is None:
            return np.zeros(len(self.spec.actuated))
        noise = 2 * math.pi / 2**self.bits / math.sqrt(12)
        k_p, k_d = self.gains.k_p * slower**2, self.gains.k_d * slower
        gain = max(force_noise(lam, k_p, k_d, self.period, cutoff_hz) for lam in self._range)
        return self._m_bar * noise * gain / np.asarray(self.spec.torque_limits)

    @functools.cached_property
    def low_pass(self) -> tuple[float, float] | None:
        """The highest low-pass (Hz) that keeps chatter below `CHATTER`, and the factor of the bandwidth behind it.

        None where chatter is below it without one, or where none helps.
        """
        if self.chatter().max() <= CHATTER:
            return None
        tried = ((share / self.period, self._slower(share / self.period)) for share in CUTOFFS)
        return next(((hz, by) for hz, by in tried if by is not None and self.chatter(hz, by).max() <= CHATTER), None)

    def to_dict(self) -> dict[str, Any]:
        """Return all of it in JSON's types."""
        low, high = float(self.eigenvalues.min()), float(self.eigenvalues.max())
        scalar = self.scalar_eigenvalues
        return {
            "period_s": self.period,
            "valid": self.valid,
            "poses": len(self.eigenvalues),
            "eigenvalues": [low, high],
            "margin": self.margin,
            "scalar_m_bar": {"m_bar": self.scalar, "eigenvalues": [float(scalar.min()), float(scalar.max())]},
            "k_p": self.gains.k_p,
            "k_d": self.gains.k_d,
            "bandwidth": self.omega,
            "stable_factors": dict(zip(("largest", "smallest"), map(_finite, self.factors), strict=True)),
            "encoder_bits": self.bits,
            "low_pass": None if self.low_pass is None else dict(zip(("hz", "factor"), self.low_pass, strict=True)),
            "joints": [self._joint(i) for i in range(len(self.spec.actuated))],
            "advice": advice(self),
        }

    def _joint(self, i: int) -> dict[str, Any]:
        name = self.spec.actuated[i]
        link = self.spec.by_name[name]
        return {
            "name": name,
            "prismatic": link.prismatic,
            "limits": [*map(_finite, link.limits)],
            "speed": _finite(link.speed),
            "effort": self.spec.torque_limits[i],
            "damping": link.damping,
            "dry_friction": link.coulomb,
            "armature": self.spec.armature[i],
            "m_bar": self.gains.m_bar[i],
            "stiffness": float(self.stiffness[i]),
            "weight": float(self.weight[i]),
            "friction_error": float(self.friction_error[i]),
            "chatter": _finite(float(self.chatter()[i])),
        }

    def _slower(self, cutoff_hz: float) -> float | None:
        """Return the largest factor of the bandwidth that is stable behind a low-pass with the design's margin."""

        def stable(factor: float) -> bool:
            k_p, k_d = self.gains.k_p * factor**2, self.gains.k_d * factor
            return all(spectral_radius(lam, k_p, k_d, self.period, cutoff_hz) < 1 for lam in self._range)

        return next((factor for factor in SLOWER if stable(factor) and stable(MARGIN * factor)), None)

    def _of_links(self, field: str) -> Array:
        return np.array([getattr(self.spec.by_name[name], field) for name in self.spec.actuated])

    @property
    def _m_bar(self) -> Array:
        return np.asarray(self.gains.m_bar)

    @property
    def _range(self) -> tuple[float, float]:
        """Smallest eigenvalue with a payload, and the largest."""
        return LOADED * float(self.eigenvalues.min()), float(self.eigenvalues.max())


def workspace_design(
    spec: RobotSpec, period: float, gains: Mapping[str, Any], bits: float | None = None
) -> WorkspaceDesign:
    """Design gains for an arm, with some replaced.

    Args:
        spec: the arm.
        period: L (s).
        gains: `m_bar` (a number, or one a joint), `k_p` and `k_d` in place of the designed ones.
        bits: of encoders per turn; None for exact angles.

    Raises:
        GainError: for any other gain, or a value that is not allowed.
    """
    own = design_arm(spec, period, warns=False)
    for name in gains:
        if name not in own._fields:
            raise GainError("gain", name, ", ".join(own._fields))
    chosen = TdeGains(**{**own._asdict(), **gains})
    k_p, k_d = (float(np.asarray(value)) if np.ndim(value) == 0 else math.nan for value in (chosen.k_p, chosen.k_d))
    m_bar = np.asarray(chosen.m_bar, dtype=np.float64)
    if math.isnan(k_p + k_d):
        raise GainError("k_p, k_d", (chosen.k_p, chosen.k_d), "one number for all joints")
    if m_bar.shape not in ((), (len(spec.actuated),)):
        raise GainError("m_bar", chosen.m_bar, f"a number, or {len(spec.actuated)} of them")
    return WorkspaceDesign(spec, ArmGains(tuple(np.broadcast_to(m_bar, len(spec.actuated)).tolist()), k_p, k_d),
                           period, bits)  # fmt: skip


def advice(design: WorkspaceDesign) -> list[str]:
    """Return what limits a design, and what to change where it does not fit."""
    return [*_of_inertia(design), *_of_weight(design), *_of_friction(design), *_of_encoders(design)]


def _of_inertia(design: WorkspaceDesign) -> list[str]:
    low, high = float(design.eigenvalues.min()), float(design.eigenvalues.max())
    if high >= 2:
        return [f"m_bar is too large by a factor of {high / 2:.3g}: time-delay estimation diverges."]
    found = [] if design.valid else ["The bandwidth is too large: lower k_p and k_d, or shorten the control period."]
    quick, slow = design.factors
    binds = "the smallest eigenvalue, with a payload," if slow < quick else "the largest eigenvalue"
    found.append(f"The bandwidth is bound by {binds} and by L: half the control period doubles it.")
    if not any(design.spec.armature):
        found.append(
            f"The joints have no reflected rotor inertia, so that eigenvalues spread by a factor of {high / low:.0f}: "
            "pass armature= (1e-5 to 1e-4 kg m^2 times the gear ratio squared) if the arm is geared."
        )
    return found


def _of_weight(design: WorkspaceDesign) -> list[str]:
    return [
        f"{name} cannot hold the arm in all poses: its weight takes up to {100 * share:.0f} % of the effort. Keep the "
        "reference away from them, or check the file's effort."
        for name, share in zip(design.spec.actuated, design.weight, strict=True)
        if share > 1
    ]


def _of_friction(design: WorkspaceDesign) -> list[str]:
    links = (design.spec.by_name[name] for name in design.spec.actuated)
    return [
        f"Dry friction of {link.name} is smoothed below {slip:.3g} in place of {link.slip:g} rad/s or m/s: a time step "
        "cannot resolve it at the joint's small inertia. More armature would."
        for link, slip in zip(links, design.slip, strict=True)
        if slip > link.slip
    ]


def _of_encoders(design: WorkspaceDesign) -> list[str]:
    if design.bits is None:
        return []
    worst = float(design.chatter().max())
    found = [f"Encoders of {design.bits:g} bits let torques chatter by up to {100 * worst:.2g} % of a limit (rms)."]
    if worst <= CHATTER:
        return found
    if design.low_pass is None:
        return [*found, "No low-pass lowers that enough: take finer encoders or a longer control period."]
    hz, factor = design.low_pass
    k_p, k_d = design.gains.k_p * factor**2, design.gains.k_d * factor
    gains = "these gains" if factor == 1 else f"a lower bandwidth of {factor * design.omega:.3g} rad/s"
    return [*found, f"A low-pass keeps it below {100 * CHATTER:g} %: velocity_cutoff_hz={hz:.3g} at {gains} "
                    f"(k_p={k_p:.4g}, k_d={k_d:.4g})."]  # fmt: skip


def _finite(value: float) -> float | None:
    """Return the value as JSON can write it."""
    return value if math.isfinite(value) else None
