"""What an evaluation found: episodes, their summary, and paired comparisons."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd

from artde_gym.arrays import Array
from artde_gym.errors import UnknownNameError, among
from artde_gym.evaluation import statistics

_NOT_METRICS = ("seed", "episode", "fell", "duration_s")
_OF_ALL = ("fell", "time_to_fall_s", "reward")
"""Metrics that mean something for an episode that ended in a fall too."""


@dataclasses.dataclass(frozen=True)
class Result:
    """Episodes of several controllers on the same seeds.

    Attributes:
        episodes: one row an episode and controller; see `artde_gym.evaluation.metrics` for the columns.
        folder: where they are stored, if they are.
        complete: False if the evaluation was interrupted.
    """

    episodes: pd.DataFrame
    folder: Path | None = None
    complete: bool = True

    @property
    def controllers(self) -> list[str]:
        return list(dict.fromkeys(self.episodes["controller"].tolist()))

    @property
    def scenarios(self) -> list[str]:
        return list(dict.fromkeys(self.episodes["scenario"].tolist()))

    @property
    def metrics(self) -> list[str]:
        """Columns that a comparison makes sense for."""
        numbers = self.episodes.select_dtypes("number").columns
        return [name for name in numbers if name not in _NOT_METRICS and not name.startswith("disturbance.")]

    def rows(self, scenario: str, controller: str) -> pd.DataFrame:
        """The episodes of one controller in one scenario, indexed by their number."""
        chosen = (self.episodes["scenario"] == scenario) & (self.episodes["controller"] == controller)
        frame: pd.DataFrame = self.episodes.loc[chosen]
        return frame.set_index("episode")

    def values(self, scenario: str, controller: str, metric: str) -> Array:
        """A metric over the episodes of one controller in one scenario."""
        return self.rows(scenario, controller)[metric].to_numpy(dtype=np.float64)

    def falls(self, scenario: str, controller: str) -> tuple[int, statistics.Estimate]:
        """Number of falls, and their rate with Wilson's interval."""
        fell = self.rows(scenario, controller)["fell"].to_numpy(dtype=np.bool_)
        return int(fell.sum()), statistics.rate(int(fell.sum()), len(fell))

    def summary(self) -> pd.DataFrame:
        """Mean, 95 % interval and number of episodes, indexed by scenario, controller and metric.

        `fall_rate` has Wilson's interval, everything else a bootstrap one. Metrics of tracking cover fallen episodes up
        to the fall.
        """
        lines = []
        for scenario in self.scenarios:
            for controller in self.controllers:
                rows = self.rows(scenario, controller)
                estimates = {"fall_rate": self.falls(scenario, controller)[1]}
                estimates.update({metric: statistics.mean(rows[metric]) for metric in self.metrics})
                lines += [(scenario, controller, metric, *estimate) for metric, estimate in estimates.items()]
        columns = ["scenario", "controller", "metric", "mean", "low", "high", "n"]
        return pd.DataFrame(lines, columns=columns).set_index(columns[:3])

    def pairs(self, scenario: str, first: str, second: str, metric: str) -> tuple[Array, Array]:
        """The metric's finite values of two controllers on the same seeds; see `compare` for which seeds."""
        return _pairs(self.rows(scenario, first), self.rows(scenario, second), metric)

    def compare(self, first: str, second: str) -> pd.DataFrame:
        """Paired differences first - second on the same seeds, indexed by scenario and metric.

        Columns: means of both, their `difference` with its 95 % bootstrap interval `low`, `high`, `percent` (difference
        of the means relative to second), `win_probability` (share of pairs in which first is smaller) and `pairs`.
        Metrics of tracking use the pairs in which nobody fell: an error up to a fall is no error of a walk.

        Raises:
            UnknownNameError: for a controller that was not evaluated.
        """
        for name in (first, second):
            if name not in self.controllers:
                raise UnknownNameError("controller", name, among(name, self.controllers))
        lines = []
        for scenario in self.scenarios:
            mine, theirs = (self.rows(scenario, name) for name in (first, second))
            for metric in ("fell", *self.metrics):
                a, b = _pairs(mine, theirs, metric)
                difference = statistics.mean(a - b)
                mean_a, mean_b = (float(side.mean()) if len(side) else np.nan for side in (a, b))
                percent = 100 * difference.value / mean_b if mean_b else np.nan
                win = statistics.win_probability(a, b)
                lines.append((scenario, metric, mean_a, mean_b, *difference[:3], percent, win, difference.n))
        columns = ["scenario", "metric", first, second, "difference", "low", "high"]
        columns += ["percent", "win_probability", "pairs"]
        return pd.DataFrame(lines, columns=columns).set_index(["scenario", "metric"])


def _pairs(mine: pd.DataFrame, theirs: pd.DataFrame, metric: str) -> tuple[Array, Array]:
    both = mine.index.intersection(theirs.index)
    mine, theirs = mine.loc[both], theirs.loc[both]
    a, b = (rows[metric].to_numpy(dtype=np.float64) for rows in (mine, theirs))
    used = np.isfinite(a) & np.isfinite(b)
    if metric not in _OF_ALL:
        used &= ~(mine["fell"] | theirs["fell"]).to_numpy(dtype=np.bool_)
    return a[used], b[used]
