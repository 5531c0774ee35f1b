"""The half point: the value at which a controller survives half of the episodes, from a whole grid of levels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.optimize import isotonic_regression

from artde_gym.arrays import Array
from artde_gym.evaluation.statistics import CONFIDENCE, Estimate
from artde_gym.studies.frontier.axis import Axis
from artde_gym.studies.frontier.result import HALF, Frontier

RESAMPLES = 2000
COLUMNS = ["controller", "half", "low", "high", "episodes"]


def half_point(survived: ArrayLike, grid: Sequence[float]) -> Estimate:
    """Estimate where survival crosses one half, with a bootstrap interval over seeds.

    Survival is made to fall from level to level (isotonic regression) and is linear in between; where it rises, see
    `artde_gym.studies.frontier.result.rising_note`. Seeds are drawn anew with all their levels, since these share a
    seed's disturbances. A sample says between which two levels it crosses, so that the interval is never narrower than
    the grid: it runs from the 2.5 % quantile of the lower ones of those levels to the 97.5 % one of the upper ones.

    Args:
        survived: (seeds, levels) 1 or 0; NaN for an episode that was not run.
        grid: values of the levels, the easiest first.

    Returns:
        The value and its interval. Infinite, in the direction that is harder, where more than half survive the hardest
        level; in the other one where not even half survive the easiest. NaN where half survive the hardest level but
        not the easiest one: then survival rises where it should fall. It is over the fewest episodes of a level, and
        the interval of a single one is NaN.
    """
    table = np.asarray(survived, dtype=np.float64)
    count = _fewest(table)
    if count == 0:
        return Estimate(math.nan, math.nan, math.nan, 0)
    rates = np.nanmean(table, axis=0)
    if rates[0] < HALF < rates[-1]:
        return Estimate(math.nan, math.nan, math.nan, count)
    value = float(f"{_crossing(rates, grid)[0]:.10g}")  # without the noise of interpolation
    if count == 1:
        return Estimate(value, math.nan, math.nan, 1)
    brackets = _brackets(table, grid)
    return Estimate(value, *_interval(brackets[:, 0], brackets[:, 1]), count)


def half_difference(first: ArrayLike, second: ArrayLike, grid: Sequence[float]) -> Estimate:
    """By how much the half point of `first` exceeds that of `second` on the same seeds; as for `half_point`.

    The interval runs from the smallest difference that the brackets allow to the largest. An end is infinite, or NaN,
    where the grid does not reach far enough; the value is NaN where it reaches neither half point, or one is NaN.
    """
    tables = [np.asarray(table, dtype=np.float64) for table in (first, second)]
    values = [half_point(table, grid).value for table in tables]
    count = min(map(_fewest, tables))
    if np.isnan(values).any() or count == 1:
        return Estimate(values[0] - values[1], math.nan, math.nan, count)
    (low, high), (other_low, other_high) = (_brackets(table, grid).T for table in tables)
    with np.errstate(invalid="ignore"):
        value = values[0] - values[1]
        return Estimate(value, *_interval(low - other_high, high - other_low), count)


def survival_table(found: Frontier, name: str) -> Array | None:
    """Tabulate who survived (seeds, levels) of a controller's episodes in a grid; None where a level has none."""
    if found.episodes is None or found.episodes.empty:
        return None
    own = found.episodes[found.episodes["controller"] == name]
    if own.empty:
        return None
    rows = own.assign(level=own["scenario"].astype(int), fell=own["fell"].astype(float))
    fell = rows.pivot_table(index="episode", columns="level", values="fell")
    table = 1.0 - fell.reindex(columns=range(len(found.axis.levels))).to_numpy(np.float64)
    return table if np.isfinite(table).any(axis=0).all() else None


def half_points(found: Frontier) -> pd.DataFrame:
    """Tabulate the half points of all controllers that have a whole grid."""
    tables = {str(name): survival_table(found, str(name)) for name in found.table["controller"]}
    levels = found.axis.levels
    rows = [(name, *half_point(table, levels)) for name, table in tables.items() if table is not None]
    return pd.DataFrame(rows, columns=COLUMNS)


def half_text(row: dict[Any, Any], varied: Axis, *, unit: bool = False) -> str:
    """Write a half point with its interval: "37.0 (36..38)", "> 60" where it lies beyond the grid."""
    if math.isnan(row["half"]):
        return "none, since survival rises"
    beyond = {math.inf: f"> {varied.high:g}", -math.inf: f"< {varied.low:g}"}
    text = beyond.get(row["half"]) or f"{rounded(row['half'], varied):g}"
    if row["low"] < row["high"]:  # not NaN, of a single episode
        low, high = (beyond.get(row[end]) or f"{row[end]:g}" for end in ("low", "high"))
        text += f" ({low}..{high})"
    return f"{text} {varied.unit}" if unit and varied.unit != "1" else text


def rounded(value: float, varied: Axis) -> float:
    """Round to three digits, or to a tenth of the grid's step where that is finer."""
    if value == 0 or not math.isfinite(value):
        return value
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(varied.tolerance)) + 2
    return float(f"{value:.{max(3, digits)}g}")


def _fewest(table: Array) -> int:
    """Return the number of episodes at the level that has the fewest."""
    return int(np.isfinite(table).sum(axis=0).min())


def _brackets(table: Array, grid: Sequence[float]) -> Array:
    """Return the ends (resamples, 2) between which bootstrap samples of the seeds cross one half, the smaller first."""
    seeds = len(table)
    draws = np.random.default_rng(0).integers(seeds, size=(RESAMPLES, seeds))
    counts = np.stack([np.bincount(draw, minlength=seeds) for draw in draws])
    known = np.isfinite(table)
    totals = counts @ known
    rates = (counts @ np.where(known, table, 0.0)) / np.maximum(totals, 1)
    rates[totals == 0] = np.nan
    rates = np.where(np.isnan(rates), np.nanmean(table, axis=0), rates)  # of a sample without an episode of a level
    unique, places = np.unique(rates, axis=0, return_inverse=True)
    return np.sort([_crossing(row, grid)[1:] for row in unique], axis=1)[places.reshape(-1)]


def _interval(lows: Array, highs: Array) -> tuple[float, float]:
    tail = (1 - CONFIDENCE) / 2
    low = np.quantile(lows, tail, method="inverted_cdf")
    return float(low), float(np.quantile(highs, 1 - tail, method="inverted_cdf"))


def _crossing(rates: Array, grid: Sequence[float]) -> tuple[float, float, float]:
    """Return where the falling curve through some rates crosses one half, and the levels on either side."""
    harder = math.inf if grid[-1] > grid[0] else -math.inf
    curve = np.round(isotonic_regression(rates, increasing=False).x, 12)
    if curve[-1] > HALF:
        return harder, grid[-1], harder
    if curve[0] < HALF:
        return -harder, -harder, grid[0]
    last, first = int(np.flatnonzero(curve >= HALF)[-1]), int(np.flatnonzero(curve <= HALF)[0])
    if last >= first:  # it stays at one half from level to level
        outer = max(first - 1, 0), min(last + 1, len(grid) - 1)
        return (grid[first] + grid[last]) / 2, grid[outer[0]], grid[outer[1]]
    share = (curve[last] - HALF) / (curve[last] - curve[first])
    return grid[last] + share * (grid[first] - grid[last]), grid[last], grid[first]
