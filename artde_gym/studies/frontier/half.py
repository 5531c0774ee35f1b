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

HALF = 0.5
RESAMPLES = 2000
COLUMNS = ["controller", "half", "low", "high", "episodes"]


def half_point(survived: ArrayLike, grid: Sequence[float]) -> Estimate:
    """Estimate where survival crosses one half, with a bootstrap interval over seeds.

    Survival is made to fall from level to level (isotonic regression) and is linear in between. Seeds are drawn anew
    with all their levels, since these share a seed's disturbances. A sample says between which two levels it crosses,
    so that the interval is never narrower than the grid: it runs from the 2.5 % quantile of the lower ones of those
    levels to the 97.5 % quantile of the upper ones.

    Args:
        survived: (seeds, levels) 1 or 0; NaN for an episode that was not run.
        grid: values of the levels, the easiest first.

    Returns:
        The value and its interval. Infinite, in the direction that is harder, where more than half survive the hardest
        level; in the other one where not even half survive the easiest.
    """
    table = np.asarray(survived, dtype=np.float64)
    seeds, rng = len(table), np.random.default_rng(0)
    value = _crossing(np.nanmean(table, axis=0), grid)[0]
    draws = rng.integers(seeds, size=(RESAMPLES, seeds))
    counts = np.stack([np.bincount(draw, minlength=seeds) for draw in draws])
    known = np.isfinite(table)
    totals = counts @ known
    rates = (counts @ np.where(known, table, 0.0)) / np.maximum(totals, 1)
    unique, times = np.unique(rates[(totals > 0).all(axis=1)], axis=0, return_counts=True)
    brackets = np.repeat([_crossing(row, grid)[1:] for row in unique], times, axis=0)
    tail, sign = (1 - CONFIDENCE) / 2, 1.0 if grid[-1] > grid[0] else -1.0
    easy = np.quantile(sign * brackets[:, 0], tail, method="inverted_cdf")
    hard = np.quantile(sign * brackets[:, 1], 1 - tail, method="inverted_cdf")
    low, high = sorted((sign * float(easy), sign * float(hard)))
    return Estimate(value, low, high, seeds)


def half_points(episodes: pd.DataFrame, names: Sequence[str], varied: Axis) -> pd.DataFrame:
    """Tabulate the half points of controllers from a grid's episodes, whose scenarios are the levels by number."""
    rows = []
    for name in names:
        own = episodes[episodes["controller"] == name]
        if own.empty:
            continue
        fell = own.assign(level=own["scenario"].astype(int)).pivot_table(
            index="episode", columns="level", values="fell"
        )
        table = 1.0 - fell.reindex(columns=range(len(varied.levels))).to_numpy(np.float64)
        if np.isfinite(table).any(axis=0).all():
            rows.append((name, *half_point(table, varied.levels)))
    return pd.DataFrame(rows, columns=COLUMNS)


def half_text(row: dict[Any, Any], varied: Axis) -> str:
    """Write a half point with its interval: "37.0 (36..38)", "> 60" where it lies beyond the grid."""
    beyond = {math.inf: f"> {varied.high:g}", -math.inf: f"< {varied.low:g}"}
    value = beyond.get(row["half"]) or f"{row['half']:.1f}"
    if row["low"] == row["high"]:
        return value
    low, high = (beyond.get(row[end]) or f"{row[end]:g}" for end in ("low", "high"))
    return f"{value} ({low}..{high})"


def _crossing(rates: Array, grid: Sequence[float]) -> tuple[float, float, float]:
    """The value at which the falling curve through some rates crosses one half, and the levels on either side."""
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
