"""Tracked signals and efforts of an environment, as data for metrics, tables and claims."""

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
    """A vector that should follow its reference.

    Attributes:
        unit: unit of reported errors, as spelled in column names.
        scale: number of these units in one SI unit.
        axes: reported axis -> its component of the error.
        error: observations -> reference - measured (..., n), in SI.
        diagnostic: diagnostic of the policy that replaces this error where it exists; errors are then
            those at the policy's steps, without the final observation.
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
        name: name, as spelled in column names.
        unit: unit, as spelled in column names.
        field: field of the observation; its values acted over the control period that ends with the observation.
        part: components of the field with this unit.
        axes: reported axis -> its component of the part.
    """

    name: str
    unit: str
    field: str
    part: slice
    axes: Mapping[str, int]


@dataclasses.dataclass(frozen=True)
class WatchedSignal:
    """A size that has no reference of its own, such as a swing.

    Attributes:
        name: as columns spell it.
        unit: in which it is reported, as columns spell it.
        scale: how many of it make one SI unit.
        size: observations and told entries of `info` -> values (...), in SI; NaN where there is none.
        settling_band: value that counts as settled after a push, in SI; infinite where settling means nothing.
    """

    name: str
    unit: str
    scale: float
    size: Callable[[Fields], Array]
    settling_band: float


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
class MetricsSpec:
    """Everything that metrics need to know about an environment.

    Attributes:
        errors: tracked signals; recovery, IAE and ITAE use the first.
        norm: reduction of the first signal's components to one number: True for their Euclidean norm (a vector in
            space), False for their root mean square (joints).
        settling_band: size of error that counts as recovered, in SI.
        efforts: applied forces and torques.
        power: observations -> power spent (...), W.
        saturated_field: field whose values saturate at its bounds.
        saturation_margin: share of the field's range that counts as saturated; with a lag, values approach the bound
            without reaching it.
        tde_errors: column -> diagnostic of a policy that is an error of time-delay estimation.
        diagnostic_means: column -> scalar diagnostic of a policy whose mean is reported.
        recorded_info: numeric entries of `info` that are recorded in an episode's traces too.
        watched: further signals, from observations and recorded entries.
        speed: observations -> speed of travel (...), m/s; None if a cost of transport makes no sense.
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
        """True if metrics need a policy's diagnostics at every control period."""
        return any(tracked.diagnostic is not None for tracked in self.errors)
