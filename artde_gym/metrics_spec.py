"""What an environment tracks and what it spends on it, as data: metrics, tables and claims go by it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import TypeAlias

from artde_gym.arrays import Array
from artde_gym.deprecation import renamed_arguments

Fields: TypeAlias = Mapping[str, Array]
"""Observations by field name, each (..., size)."""


@dataclasses.dataclass(frozen=True)
class TrackedSignal:
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
class EffortSignal:
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


@renamed_arguments(
    {
        "band": "settling_band",
        "limited": "saturated_field",
        "means": "diagnostic_means",
        "near": "saturation_margin",
        "told": "recorded_info",
    }
)
@dataclasses.dataclass(frozen=True)
class WatchedSignal:
    """A size that has no reference of its own, such as a swing.

    Attributes:
        name: as columns spell it.
        unit: in which it is reported, likewise.
        scale: how many of it make one SI unit.
        size: observations and told entries of `info` -> values (...), in SI; NaN where there is none.
        settling_band: value that counts as settled after a push, in SI; infinite where settling means nothing.
    """

    name: str
    unit: str
    scale: float
    size: Callable[[Fields], Array]
    settling_band: float


@dataclasses.dataclass(frozen=True)
class MetricsSpec:
    """Everything that metrics have to know of an environment.

    Attributes:
        errors: the first one is what recovery, IAE and ITAE are measured by.
        norm: whether that one's components make one number by their Euclidean norm (of a vector in space) or by their
            root mean square (of joints).
        settling_band: size of error that counts as recovered, in SI.
        efforts: what was applied.
        power: observations -> power spent (...), W.
        saturated_field: field whose values saturate at its bounds.
        saturation_margin: share of the field's range that counts as at the bound; a lag approaches it without
            reaching it.
        tde_errors: column -> diagnostic of a policy that is an error of time-delay estimation.
        diagnostic_means: column -> diagnostic of a policy, one number, whose mean is reported.
        recorded_info: entries of `info` that belong into an episode's traces too, numbers each.
        watched: what else is measured, from observations and told entries.
        speed: observations -> speed of travel (...), m/s, where a cost of transport makes sense.
    """

    errors: tuple[TrackedSignal, ...]
    norm: bool
    settling_band: float
    efforts: tuple[EffortSignal, ...]
    power: Callable[[Fields], Array]
    saturated_field: str
    saturation_margin: float
    tde_errors: Mapping[str, str]
    diagnostic_means: Mapping[str, str]
    recorded_info: tuple[str, ...] = ()
    watched: tuple[WatchedSignal, ...] = ()
    speed: Callable[[Fields], Array] | None = None

    @property
    def diagnosed(self) -> bool:
        """Whether metrics need a policy's diagnostics at every control period."""
        return any(tracked.diagnostic is not None for tracked in self.errors)
