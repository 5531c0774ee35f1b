"""Intervals for few, paired, seeded episodes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from artde_gym.arrays import Array

RESAMPLES = 5000
CONFIDENCE = 0.95


class Estimate(NamedTuple):
    """A value and its 95 % interval, over `n` episodes."""

    value: float
    low: float
    high: float
    n: int


def mean(values: ArrayLike) -> Estimate:
    """Mean with its bootstrap interval (percentile); not finite values are left out.

    With a single value, or only equal ones, the data say nothing of their spread: the interval is NaN for one value,
    the value itself for equal ones.
    """
    finite = _finite(values)
    if len(finite) == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    center = float(finite.mean())
    if len(finite) == 1:
        return Estimate(center, np.nan, np.nan, 1)
    if np.ptp(finite) == 0:
        return Estimate(center, center, center, len(finite))
    interval = stats.bootstrap(
        (finite,),
        np.mean,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(center, float(interval.low), float(interval.high), len(finite))


def improvement(ours: ArrayLike, theirs: ArrayLike) -> Estimate:
    """By how many percent the mean of ours is below that of theirs, for paired values, with a bootstrap interval."""
    pairs = np.array([ours, theirs], dtype=np.float64).reshape(2, -1)
    a, b = pairs[:, np.isfinite(pairs).all(axis=0)]
    if len(a) == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    value = 100.0 * (1.0 - float(a.mean() / b.mean()))
    if len(a) == 1:
        return Estimate(value, np.nan, np.nan, 1)
    interval = stats.bootstrap(
        (a, b),
        lambda x, y, axis: 100.0 * (1.0 - x.mean(axis=axis) / y.mean(axis=axis)),
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        paired=True,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(value, float(interval.low), float(interval.high), len(a))


def rate(successes: int, trials: int) -> Estimate:
    """A rate with Wilson's score interval."""
    if trials == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    interval = stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(successes / trials, float(interval.low), float(interval.high), trials)


def win_probability(first: ArrayLike, second: ArrayLike) -> float:
    """Share of pairs in which `first` is smaller, ties counting one half."""
    difference = np.asarray(first, dtype=np.float64) - np.asarray(second, dtype=np.float64)
    return float(np.mean((difference < 0) + 0.5 * (difference == 0))) if difference.size else float("nan")


def _finite(values: ArrayLike) -> Array:
    array = np.asarray(values, dtype=np.float64)
    return array[np.isfinite(array)]
