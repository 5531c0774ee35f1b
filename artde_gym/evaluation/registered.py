"""Metrics of one's own: a signal of each sample, and how an episode's samples become one number."""

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
    "cell", "controller", "duration_s", "env", "episode", "fall_reason", "fall_rate", "fell", "point", "reward",
    "scenario", "seed", "time_to_fall_s",
)  # fmt: skip
"""Columns that say which episode it is and how it ended."""

Reduction = Literal["mean", "rms", "max", "min"]
Signal = Callable[[Fields, Fields], Array | None]
"""Computes values (samples, n) of n episodes from observations by name (samples, n, size) and a policy's diagnostics.

Diagnostics are there at some samples only, and none at the end: the mapping is empty then. None is no value, as for
another robot or a policy that does not tell.
"""


@dataclasses.dataclass(frozen=True)
class Metric:
    """A column of the table of episodes.

    Attributes:
        name: of the column, in small letters, digits and underscores, with the unit at its end.
        signal: computes a value of each sample, elementwise.
        reduction: what an episode's samples become: their mean, root mean square, largest or smallest value.

    Raises:
        OptionError: for a name that is no column, or an unknown reduction.
    """

    name: str
    signal: Signal
    reduction: Reduction = "mean"

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and re.fullmatch("[a-z][a-z0-9_]*", self.name)):
            raise OptionError("name of a metric", self.name, "small letters, digits and underscores")
        if self.name in TAKEN:
            raise OptionError("name of a metric", self.name, f"a new name; these are taken: {', '.join(TAKEN)}")
        check_choice("reduction", self.reduction, get_args(Reduction))


METRICS: Registry[Metric] = Registry("metric", "artde_gym.metrics", lambda metric: {_checked(metric).name: metric})
"""Metrics by name, beside those of `artde_gym.evaluation.metrics`: of plug-ins, and those registered."""


def register_metric(name: str, signal: Signal, reduction: Reduction = "mean", *, replace: bool = False) -> None:
    """Add a metric to every evaluation from now on: to its table of episodes, summary, comparisons and reports.

    Worker processes know metrics of entry points, and those that are registered when the script that calls `evaluate`,
    or a module that it imports, is imported: outside of `if __name__ == "__main__":`.

    Raises:
        OptionError: for a name that is taken or no column, or an unknown reduction.
    """
    METRICS.register(name, Metric(name, signal, reduction), replace=replace)


def require_metrics(names: Iterable[str]) -> None:
    """See that this process knows the metrics of the one that has started it.

    Raises:
        UnknownNameError: if it does not.
    """
    for name in names:
        if name not in METRICS:
            place = "register it where the script is imported, above `if __name__ == '__main__':`, or by an entry point"
            raise UnknownNameError("metric in a worker process", name, f"{suggest_names(name, METRICS)}; {place}")


def _checked(loaded: Any) -> Metric:
    if not isinstance(loaded, Metric):
        raise OptionError("entry point of artde_gym.metrics", loaded, "a Metric")
    return loaded
