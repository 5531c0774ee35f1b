"""User-defined metrics: a signal at each sample, and its reduction to one number per episode."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterable
from typing import Any, Literal, get_args

from artde_gym.arguments import check_choice
from artde_gym.arrays import Array
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.metrics_spec import Fields
from artde_gym.registry import Registry

TAKEN = (
    "cell", "controller", "disturbances", "duration_s", "env", "episode", "fall_reason", "fall_rate", "fell", "point",
    "reward", "scenario", "seed", "time_to_fall_s", "world",
)  # fmt: skip
"""Columns that identify an episode and its ending."""
RECOVERY, RECOVERED, PEAK = "recovery_time_s_", "recovered_", "peak_error_"
"""Beginnings of what is measured after an event: a time that may be infinite, the share that it is not, an error."""

Reduction = Literal["mean", "rms", "max", "min"]
Signal = Callable[[Fields, Fields], Array | None]
"""Computes values (samples, n) of n episodes from observations by name (samples, n, size) and a policy's diagnostics.

Diagnostics exist at some samples only, and not at the end: the mapping is then empty. Return None for no value, e.g.
for another robot or a policy without these diagnostics.
"""


@dataclasses.dataclass(frozen=True)
class Metric:
    """A column of the table of episodes.

    Attributes:
        name: of the column, in lowercase letters, digits and underscores, ending with the unit.
        signal: computes a value at each sample, elementwise.
        reduction: from an episode's samples to their mean, root mean square, largest or smallest value.

    Raises:
        OptionError: for an invalid name, or an unknown reduction.
    """

    name: str
    signal: Signal
    reduction: Reduction = "mean"

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and re.fullmatch("[a-z][a-z0-9_]*", self.name)):
            raise OptionError("name of a metric", self.name, "lowercase letters, digits and underscores")
        if self.name in TAKEN:
            raise OptionError("name of a metric", self.name, f"any name except {', '.join(TAKEN)}")
        if self.name.startswith(after := (RECOVERY, RECOVERED, PEAK)):
            raise OptionError("name of a metric", self.name, f"any name that begins with none of {', '.join(after)}")
        check_choice("reduction", self.reduction, get_args(Reduction))


METRICS: Registry[Metric] = Registry("metric", "artde_gym.metrics", lambda metric: {_checked(metric).name: metric})
"""Metrics by name, from plug-ins and `register_metric`, in addition to those of `artde_gym.evaluation.metrics`."""


def register_metric(name: str, signal: Signal, reduction: Reduction = "mean", *, replace: bool = False) -> None:
    """Add a metric to all later evaluations: their tables of episodes, summaries, comparisons and reports.

    Worker processes know the metrics of entry points, and those registered when the script that calls `evaluate`, or a
    module imported by it, is imported: outside of `if __name__ == "__main__":`.

    Raises:
        OptionError: for a name that is taken or invalid, or an unknown reduction.
    """
    METRICS.register(name, Metric(name, signal, reduction), replace=replace)


def require_metrics(names: Iterable[str]) -> None:
    """Check that this process knows the metrics of the process that started it.

    Raises:
        UnknownNameError: for an unknown metric.
    """
    for name in names:
        if name not in METRICS:
            place = "register it at import, above `if __name__ == '__main__':`, or by an entry point"
            raise UnknownNameError("metric in a worker process", name, f"{suggest_names(name, METRICS)}; {place}")


def _checked(loaded: Any) -> Metric:
    if not isinstance(loaded, Metric):
        raise OptionError("entry point of artde_gym.metrics", loaded, "a Metric")
    return loaded
