"""What an environment tracks and what it spends on it, as data: metrics, tables and claims go by it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import TypeAlias

from artde_gym.arrays import Array

Fields: TypeAlias = Mapping[str, Array]
"""Observations by field name, each (..., size)."""


@dataclasses.dataclass(frozen=True)
class Tracked:
    """A vector that is meant to follow its reference.

    Attributes:
        unit: in which errors are reported, as columns spell it.
        scale: how many of it make one SI unit.
        axes: reported axis -> its component of the error.
        error: observations -> reference - measured (..., n), in SI.
        diagnostic: the policy's own account of this error, used in its place where a policy has one; errors are then
            those at its decisions, without the final observation.
    """

    unit: str
    scale: float
    axes: Mapping[str, int]
    error: Callable[[Fields], Array]
    diagnostic: str | None = None


@dataclasses.dataclass(frozen=True)
class Effort:
    """Forces or torques of one unit.

    Attributes:
        name: as columns spell it.
        unit: likewise.
        field: of the observation; its values acted over the control period that ends with the observation.
        part: components of the field that are of this kind.
        axes: reported axis -> its component of the part.
    """

    name: str
    unit: str
    field: str
    part: slice
    axes: Mapping[str, int]


@dataclasses.dataclass(frozen=True)
class Watched:
    """A size that has no reference of its own, such as a swing.

    Attributes:
        name: as columns spell it.
        unit: in which it is reported, likewise.
        scale: how many of it make one SI unit.
        size: observations and told entries of `info` -> values (...), in SI; NaN where there is none.
        band: value that counts as settled after a push, in SI; infinite where settling means nothing.
    """

    name: str
    unit: str
    scale: float
    size: Callable[[Fields], Array]
    band: float


@dataclasses.dataclass(frozen=True)
class Tracking:
    """Everything that metrics have to know of an environment.

    Attributes:
        errors: the first one is what recovery, IAE and ITAE are measured by.
        norm: whether that one's components make one number by their Euclidean norm (of a vector in space) or by their
            root mean square (of joints).
        band: size of error that counts as recovered, in SI.
        efforts: what was applied.
        power: observations -> power spent (...), W.
        limited: field whose values saturate at its bounds.
        near: share of the field's range that counts as at the bound; a lag approaches it without reaching it.
        tde_errors: column -> diagnostic of a policy that is an error of time-delay estimation.
        means: column -> diagnostic of a policy, one number, whose mean is reported.
        told: entries of `info` that belong into an episode's traces too, numbers each.
        watched: what else is measured, from observations and told entries.
        speed: observations -> speed of travel (...), m/s, where a cost of transport makes sense.
    """

    errors: tuple[Tracked, ...]
    norm: bool
    band: float
    efforts: tuple[Effort, ...]
    power: Callable[[Fields], Array]
    limited: str
    near: float
    tde_errors: Mapping[str, str]
    means: Mapping[str, str]
    told: tuple[str, ...] = ()
    watched: tuple[Watched, ...] = ()
    speed: Callable[[Fields], Array] | None = None

    @property
    def diagnosed(self) -> bool:
        """Whether metrics need a policy's diagnostics at every control period."""
        return any(tracked.diagnostic is not None for tracked in self.errors)
