"""TDE, ATDE and ARTDE with a nominal inertia and adaptive gains for each phase of support.

With a foot on the ground the joints feel another inertia than without (`controllers.laws.stability`). These laws take

    m_bar(b) = b m_left + (1 - b) m,   0 <= b <= 1;     m_bar(b) = -b m_right + (1 + b) m,   -1 <= b <= 0

with b = 1 on the left foot, -1 on the right one, and 0 on both feet or none. The phase is that of the *observed*
contact, once it has lasted for `dwell`; b follows it at the constant rate 1 / blend. The adaptive gains of a phase are
those that it had when it was left. Nothing else changes at a switch, and no memory is reset: time-delay estimation is
incremental, so that for the same u its force changes by (m_2 - m_1) (u - a) alone.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from controllers.laws.artde import ArtdeGains, artde, artde_init
from controllers.laws.atde import AtdeGains, atde, atde_init
from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace
from controllers.laws.tde import Inertia, TdeGains, as_matrix, check_inertia, tde, tde_init
from controllers.laws.tracking import Array, JointInput, check_non_negative

PHASES = (1.0, 0.0, -1.0)
"""Phases of support: left foot, both feet or none, right foot."""
KEPT = "kept_"
"""Prefix of the adaptive gains of all phases, (..., 3), before the name of the gain in the law's state."""

Matrices: TypeAlias = tuple[Array, Array, Array]


@dataclasses.dataclass(frozen=True)
class SwitchedTdeGains(TdeGains):
    """Gains of TDE with a nominal inertia for each phase of support.

    Attributes:
        m_bar: nominal inertia on both feet, and on none; as all three a number, one a joint, or a positive definite
            matrix.
        m_bar_left, m_bar_right: nominal inertia on the left and on the right foot alone.
        dwell: time (s) for which another contact has to last before it counts as a phase.
        blend: time (s) from the nominal inertia on one foot to that on both.
    """

    m_bar_left: Inertia = dataclasses.field(kw_only=True)
    m_bar_right: Inertia = dataclasses.field(kw_only=True)
    dwell: float = dataclasses.field(kw_only=True)
    blend: float = dataclasses.field(kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in ("m_bar_left", "m_bar_right"):
            check_inertia(field, getattr(self, field))
        for field in ("dwell", "blend"):
            check_non_negative(field, getattr(self, field))
        sizes = {np.size(m) if np.ndim(m) < 2 else len(np.asarray(m)) for m in self._inertias}
        if len(sizes - {1}) > 1:
            raise GainError("m_bar_left", self.m_bar_left, "of as many joints as m_bar and m_bar_right")

    @property
    def _inertias(self) -> tuple[Inertia, Inertia, Inertia]:
        return self.m_bar_left, self.m_bar, self.m_bar_right

    @functools.cached_property
    def _known(self) -> dict[tuple[int, Any], Matrices]:
        return {}

    def matrices(self, n: int, dtype: Any) -> Matrices:
        """Return the nominal inertia of each phase in `PHASES`, (n, n), in NumPy."""
        if (n, dtype) not in self._known:
            left, both, right = (as_matrix(m, n).astype(dtype) for m in self._inertias)
            self._known[n, dtype] = left, both, right
        return self._known[n, dtype]


@dataclasses.dataclass(frozen=True)
class SwitchedAtdeGains(SwitchedTdeGains, AtdeGains):
    """Gains of ATDE with a nominal inertia for each phase of support."""


@dataclasses.dataclass(frozen=True)
class SwitchedArtdeGains(SwitchedTdeGains, ArtdeGains):
    """Gains of ARTDE with a nominal inertia for each phase of support."""


class SupportState(NamedTuple):
    """Support in the numbers of `PHASES`, each (...): phase, contact that may become it, its age (s), and b."""

    phase: Array
    candidate: Array
    held: Array
    blend: Array


class NothingKept(NamedTuple):
    """Adaptive gains of TDE in all phases."""


class AtdeKept(NamedTuple):
    """Adaptive gain of ATDE in each phase, as it was when the phase was left, (..., 3)."""

    kept_c: Array


class ArtdeKept(NamedTuple):
    """Adaptive gains of ARTDE in each phase, as they were when the phase was left, (..., 3)."""

    kept_beta_0: Array
    kept_beta_1: Array


class SwitchedState(NamedTuple):
    """State of the law, with the adaptive gains of its phase, of the support, and adaptive gains of all phases."""

    law: Any
    support: SupportState
    kept: Any


def switched_tde_init(gains: SwitchedTdeGains, signals: JointInput, period: float) -> SwitchedState:
    """Memory before the first sample: as TDE's, with weight on both feet."""
    del gains
    return SwitchedState(tde_init(signals, period), _on_both_feet(signals), NothingKept())


def switched_atde_init(gains: SwitchedAtdeGains, signals: JointInput, period: float) -> SwitchedState:
    """Memory before the first sample: as ATDE's, with weight on both feet."""
    law = atde_init(gains, signals, period)
    return SwitchedState(law, _on_both_feet(signals), AtdeKept(_in_all(law.c)))


def switched_artde_init(gains: SwitchedArtdeGains, signals: JointInput, period: float) -> SwitchedState:
    """Memory before the first sample: as ARTDE's, with weight on both feet."""
    law = artde_init(gains, signals, period)
    return SwitchedState(law, _on_both_feet(signals), ArtdeKept(_in_all(law.beta_0), _in_all(law.beta_1)))


def switched_tde(
    gains: SwitchedTdeGains,
    state: SwitchedState,
    signals: JointInput,
    period: float,
    contact: Array,
    du: Array | None = None,
) -> tuple[Array, SwitchedState]:
    """One sample of TDE; `contact` (..., 2) is 1 where the left, right foot carries load, else 0."""
    return _switched(tde, gains, state, signals, period, contact, du)


def switched_atde(
    gains: SwitchedAtdeGains,
    state: SwitchedState,
    signals: JointInput,
    period: float,
    contact: Array,
    du: Array | None = None,
) -> tuple[Array, SwitchedState]:
    """One sample of ATDE; `contact` (..., 2) as for `switched_tde`."""
    return _switched(atde, gains, state, signals, period, contact, du)


def switched_artde(
    gains: SwitchedArtdeGains,
    state: SwitchedState,
    signals: JointInput,
    period: float,
    contact: Array,
    du: Array | None = None,
) -> tuple[Array, SwitchedState]:
    """One sample of ARTDE; `contact` (..., 2) as for `switched_tde`."""
    return _switched(artde, gains, state, signals, period, contact, du)


def support_phase(
    gains: SwitchedTdeGains, state: SupportState, contact: Array, period: float, xp: Any = np
) -> SupportState:
    """Return the support after one more observation of the contact (..., 2)."""
    on = xp.asarray(contact > 0.5, dtype=contact.dtype)
    seen = on[..., 0][()] - on[..., 1][()]  # numbers of one robot: ten times as fast as 0-d arrays
    held = (state.held + period) * (seen == state.candidate)
    # arithmetic in place of np.where: exact for these numbers, and much faster for a single robot
    phase = state.phase + (held >= gains.dwell - 0.5 * period) * (seen - state.phase)
    most = period / gains.blend if gains.blend > 0.5 * period else 2.0
    return SupportState(phase, seen, held, state.blend + xp.minimum(xp.maximum(phase - state.blend, -most), most))


def nominal_inertia(gains: SwitchedTdeGains, blend: Array, n: int, xp: Any = np) -> Array:
    """Return m_bar(b) of the equation at the top, (..., n, n)."""
    if xp is np:
        left, both, right = gains.matrices(n, blend.dtype)
        if blend.ndim == 0 and float(blend) in PHASES:  # what follows would give the same bits
            return (left, both, right)[PHASES.index(float(blend))]
    else:
        left, both, right = (xp.asarray(m, dtype=blend.dtype) for m in gains.matrices(n, np.dtype(np.float64)))
    b = blend[..., None, None]
    return xp.maximum(b, 0.0) * left + (1.0 - xp.abs(b)) * both + xp.maximum(-b, 0.0) * right


def _switched(
    law: Callable[..., tuple[Array, Any]],
    gains: SwitchedTdeGains,
    state: SwitchedState,
    signals: JointInput,
    period: float,
    contact: Array,
    du: Array | None,
) -> tuple[Array, SwitchedState]:
    xp = namespace(signals.q)
    support = support_phase(gains, state.support, contact, period, xp)
    inner, kept = state.law, state.kept
    switches = support.phase != state.support.phase
    if kept and (xp is not np or switches.any()):  # elsewhere truth may be unknown; without a switch, nothing changes
        inner, kept = _exchanged(inner, kept, state.support.phase, support.phase, switches, xp)
    m_bar = nominal_inertia(gains, support.blend, signals.q.shape[-1], xp)
    tau, inner = law(gains, inner, signals, period, du, m_bar)
    return tau, SwitchedState(inner, support, kept)


def _exchanged(
    law: Any, kept: Any, left: Array, entered: Array, switches: NDArray[np.bool_], xp: Any
) -> tuple[Any, Any]:
    """Put the adaptive gains of the phase that is left away, and take out those of the one that is entered."""
    own: dict[str, Array] = {}
    stored: dict[str, Array] = {}
    phases = xp.asarray(PHASES)
    for name, values in kept._asdict().items():
        gain = getattr(law, name.removeprefix(KEPT))
        here = (left[..., None] == phases) & switches[..., None]
        stored[name] = xp.where(here, gain[..., None], values)
        there = xp.where(entered[..., None] == phases, stored[name], xp.zeros_like(values)).sum(axis=-1)
        own[name.removeprefix(KEPT)] = xp.where(switches, there, gain)
    return law._replace(**own), kept._replace(**stored)


def _on_both_feet(signals: JointInput) -> SupportState:
    zero = namespace(signals.q).full(signals.q.shape[:-1], 0.0, dtype=signals.q.dtype)
    return SupportState(zero, zero, zero, zero)


def _in_all(gain: Array) -> Array:
    return namespace(gain).stack([gain] * len(PHASES), axis=-1)
