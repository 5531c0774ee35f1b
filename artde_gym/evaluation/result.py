"""The result of an evaluation: episodes, their summary, and paired comparisons."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from artde_gym.arrays import Array
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation import statistics
from artde_gym.evaluation.pairing import DRAWN, episode_key, paired
from artde_gym.evaluation.registered import RECOVERED, RECOVERY
from artde_gym.evaluation.replay import replay_folder
from artde_gym.evaluation.store import read_episodes, read_record, wanted_episodes
from artde_gym.evaluation.wide_table import WideTable
from artde_gym.motion.replay import Replay

_NOT_METRICS = ("seed", "episode", "fell", "duration_s")
_OF_ALL = ("fell", "reward")
"""Metrics that are also meaningful for an episode that ended in a fall, as are times until an event."""
_TIME_TO_FALL = "time_to_fall_s"


class Recovery(NamedTuple):
    """Share and time of recoveries of the error after a disturbance.

    Attributes:
        share: recovered share of the episodes with a known outcome, with Wilson's interval.
        median: median recovery time (s); "never" counts as the largest.
    """

    share: statistics.Estimate
    median: statistics.Estimate


@dataclasses.dataclass(frozen=True)
class Result:
    """Episodes of several controllers on the same seeds.

    Attributes:
        episodes: one row per episode and controller; see `artde_gym.evaluation.metrics` for the columns.
        folder: the results folder, if they are stored.
        complete: False if the evaluation was interrupted.

    Raises:
        OptionError: if an episode is given twice.
    """

    episodes: pd.DataFrame
    folder: Path | None = None
    complete: bool = True

    def __post_init__(self) -> None:
        if self.episodes.empty:
            return
        twice = self.episodes.duplicated(["scenario", "controller", *episode_key(self.episodes)])
        if twice.any():
            first = self.episodes[twice].iloc[0]
            problem = f"of {first['controller']} in {first['scenario']} has two episodes"
            todo = "give each scenario, controller, seed and drawn disturbances once"
            raise OptionError("seed", int(first["seed"]), todo, problem)

    @property
    def controllers(self) -> list[str]:
        return self._different("controller")

    @property
    def scenarios(self) -> list[str]:
        return self._different("scenario")

    def replay(
        self,
        scenario: str | Sequence[str] | None = None,
        controllers: Sequence[str] | None = None,
        episode: int | None = None,
    ) -> Replay:
        """Show its episodes in a browser, or in a notebook; arguments and errors as for `replay_folder`.

        Raises:
            OptionError: if they are not stored in a folder.
        """
        if self.folder is None:
            raise OptionError(
                "folder", None, "store with evaluate(..., out=...), or use `artde_gym.replay`", "holds no result"
            )
        return replay_folder(self.folder, scenario, controllers, episode)

    def _different(self, column: str) -> list[str]:
        """Return the distinct values of a column, in order of appearance; an empty result has no columns."""
        return [] if self.episodes.empty else list(dict.fromkeys(self.episodes[column].tolist()))

    @property
    def metrics(self) -> list[str]:
        """Columns that can be compared."""
        numbers = self.episodes.select_dtypes("number").columns
        return [name for name in numbers if name not in _NOT_METRICS and not name.startswith(DRAWN)]

    def has(self, scenario: str, controller: str) -> bool:
        """Return True if a controller has an episode in a scenario; any names may be asked for."""
        if self.episodes.empty:
            return False
        return bool(((self.episodes["scenario"] == scenario) & (self.episodes["controller"] == controller)).any())

    def rows(self, scenario: str, controller: str) -> pd.DataFrame:
        """Return the episodes of one controller in one scenario, indexed by their number.

        Raises:
            UnknownNameError: for a scenario or controller of no episode; so do all methods that take names.
        """
        _check_known("scenario", scenario, self.scenarios)
        _check_known("controller", controller, self.controllers)
        chosen = (self.episodes["scenario"] == scenario) & (self.episodes["controller"] == controller)
        frame: pd.DataFrame = self.episodes.loc[chosen]
        return frame.copy().set_index("episode")  # a copy is one block: many columns would be slow otherwise

    def values(self, scenario: str, controller: str, metric: str) -> Array:
        """Return a metric over the episodes of one controller in one scenario."""
        rows = self.rows(scenario, controller)
        self._check_metric(metric)
        return rows[metric].to_numpy(dtype=np.float64)

    def _check_metric(self, metric: str) -> None:
        _check_known("metric", metric, [str(name) for name in self.episodes.select_dtypes(["number", "bool"])])

    def falls(self, scenario: str, controller: str) -> tuple[int, statistics.Estimate]:
        """Return the number of falls, and their rate with Wilson's interval."""
        fell = self.rows(scenario, controller)["fell"].to_numpy(dtype=np.bool_)
        return int(fell.sum()), statistics.rate(int(fell.sum()), len(fell))

    def recovery(self, scenario: str, controller: str, event: str) -> Recovery:
        """Return the recovery of one controller after an event, e.g. "push0", in one scenario."""
        events = [name.removeprefix(RECOVERY) for name in self.metrics if name.startswith(RECOVERY)]
        _check_known("event", event, events)
        times = self.values(scenario, controller, RECOVERY + event)
        known = times[~np.isnan(times)]
        return Recovery(statistics.rate(int(np.isfinite(known).sum()), len(known)), statistics.median(known))

    def summary(self) -> pd.DataFrame:
        """Return mean, 95 % interval, median and number of episodes, indexed by scenario, controller and metric.

        `fall_rate` and the share `recovered_<event>` have Wilson's interval, other means a bootstrap one. Times until
        an event (`recovery_time_s_<event>`, `time_to_fall_s`) have no mean: "never" counts as the largest time, and the
        interval is the median's. Tracking metrics cover fallen episodes up to the fall.
        """
        lines = []
        for scenario in self.scenarios:
            for controller in self.controllers:
                rows = self.rows(scenario, controller)
                fell = self.falls(scenario, controller)[1]
                lines.append((scenario, controller, "fall_rate", *fell[:3], rows["fell"].median(), fell.n))
                for metric in self.metrics:
                    lines += [(scenario, controller, *line) for line in _summarized(rows, metric)]
        columns = ["scenario", "controller", "metric", "mean", "low", "high", "median", "n"]
        return WideTable(lines, columns=columns).set_index(columns[:3])

    def pairs(self, scenario: str, first: str, second: str, metric: str) -> tuple[Array, Array]:
        """Return a metric's values of two controllers on the same seeds; see `compare` for the selection of seeds."""
        rows = self.rows(scenario, first), self.rows(scenario, second)
        self._check_metric(metric)
        return _comparable(*paired(*rows), metric)

    def compare(self, first: str, second: str) -> pd.DataFrame:
        """Compute paired differences first - second, indexed by scenario and metric.

        A pair is two episodes with the same seed and the same sampled disturbances. Columns: means of both, their
        `difference` with its 95 % bootstrap interval `low`, `high`, `percent` (difference of the means relative to
        second), `win_probability` (share of pairs in which first is smaller) and `pairs`. Tracking metrics use only
        pairs without a fall: an error up to a fall is not comparable. Times until an event
        (`recovery_time_s_<event>`, `time_to_fall_s`) count as the largest if it never happens: both columns hold
        medians, and there is no difference; `recovered_<event>` compares the shares.

        Raises:
            UnknownNameError: for a controller that was not evaluated.
        """
        for name in (first, second):
            _check_known("controller", name, self.controllers)
        lines = []
        for scenario in self.scenarios:
            mine, theirs = paired(*(self.rows(scenario, name) for name in (first, second)))
            for metric in ("fell", *self.metrics):
                a, b = _comparable(mine, theirs, metric)
                if not _is_time(metric):
                    lines.append((scenario, metric, *_difference(a, b)))
                    continue
                if metric.startswith(RECOVERY):
                    shares = _difference(np.isfinite(a).astype(np.float64), np.isfinite(b).astype(np.float64))
                    lines.append((scenario, RECOVERED + metric.removeprefix(RECOVERY), *shares))
                medians = (statistics.median(side).value for side in (a, b))
                win = statistics.win_probability(a, b)
                lines.append((scenario, metric, *medians, *[np.nan] * 4, win, len(a)))
        columns = ["scenario", "metric", first, second, "difference", "low", "high"]
        columns += ["percent", "win_probability", "pairs"]
        return WideTable(lines, columns=columns).set_index(["scenario", "metric"])


def read_result(folder: str | Path) -> Result:
    """Read a folder that `evaluate` wrote, finished or not; the evaluation may still be running.

    An ablation of `reproduce` is a folder of its own, `ablation/<scenario>`.

    Raises:
        StoreError: if the folder is not one, a file in it is damaged, or an episode is not of its configuration.
    """
    folder = Path(folder)
    wanted = read_record(folder)["configuration"]
    _, episodes = read_episodes(folder, wanted)
    return Result(episodes, folder, len(episodes) >= wanted_episodes(wanted))


def _check_known(field: str, name: str, known: Sequence[str]) -> None:
    if name not in known:
        raise UnknownNameError(field, name, suggest_names(name, known) if known else "none: no episode has any")


def _is_time(metric: str) -> bool:
    """Return whether a metric is a time until an event, which may never happen."""
    return metric == _TIME_TO_FALL or metric.startswith(RECOVERY)


def _values(rows: pd.DataFrame, metric: str) -> Array:
    """Return a metric's values; the time of a fall that never happened is infinite."""
    values = rows[metric].to_numpy(dtype=np.float64)
    return np.where(np.isnan(values), np.inf, values) if metric == _TIME_TO_FALL else values


def _summarized(rows: pd.DataFrame, metric: str) -> list[tuple[str, float, float, float, float, int]]:
    """Return lines of a summary: metric, mean, interval, median, number."""
    values = _values(rows, metric)
    if not _is_time(metric):
        mean = statistics.mean(values)
        return [(metric, *mean[:3], statistics.median(values[np.isfinite(values)]).value, mean.n)]
    middle = statistics.median(values)
    lines = [(metric, np.nan, middle.low, middle.high, middle.value, middle.n)]
    if metric.startswith(RECOVERY):
        back = np.isfinite(values[~np.isnan(values)])
        share = statistics.rate(int(back.sum()), len(back))
        half = float(np.median(back)) if len(back) else np.nan
        lines.insert(0, (RECOVERED + metric.removeprefix(RECOVERY), *share[:3], half, share.n))
    return lines


def _difference(a: Array, b: Array) -> tuple[float, ...]:
    """Return the columns of a comparison of means."""
    difference = statistics.mean(a - b)
    mean_a, mean_b = (float(side.mean()) if len(side) else np.nan for side in (a, b))
    percent = 100 * difference.value / mean_b if mean_b else np.nan
    return mean_a, mean_b, *difference[:3], percent, statistics.win_probability(a, b), difference.n


def _comparable(mine: pd.DataFrame, theirs: pd.DataFrame, metric: str) -> tuple[Array, Array]:
    """Return the values of the pairs that can be compared."""
    a, b = (_values(rows, metric) for rows in (mine, theirs))
    if _is_time(metric):
        used = ~(np.isnan(a) | np.isnan(b))
        return a[used], b[used]
    used = np.isfinite(a) & np.isfinite(b)
    if metric not in _OF_ALL:
        fallen = [rows["fell"].to_numpy(dtype=np.bool_) for rows in (mine, theirs)]
        used &= ~(fallen[0] | fallen[1])
    return a[used], b[used]
