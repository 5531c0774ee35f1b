"""Confidence intervals for few, paired, seeded episodes."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy  # its `stats`, half a second, is imported when it is first used: not by workers
from numpy.typing import ArrayLike

from artde_gym.arrays import Array

RESAMPLES = 5000
CONFIDENCE = 0.95
MANY = 1000  # values


class Estimate(NamedTuple):
    """A value and its 95 % interval, over `n` episodes."""

    value: float
    low: float
    high: float
    n: int


def mean(values: ArrayLike) -> Estimate:
    """Compute the mean with its bootstrap interval (percentile); values that are not finite are left out.

    One value, or only equal ones, say nothing about the spread: the interval is NaN for one value, the value itself
    for equal ones. Beyond `MANY` values the interval is that of the central limit theorem, which agrees with the
    bootstrap's there.
    """
    finite = _finite(values)
    center = float(finite.mean()) if len(finite) else np.nan
    if len(finite) <= MANY:
        return _bootstrap((finite,), center, lambda x, axis: x.mean(axis=axis))
    return _central_limit(finite, center)


def median(values: ArrayLike) -> Estimate:
    """Compute the median with the exact interval of order statistics; infinite values are the largest, NaN is left out.

    Fewer than six values are too few: the interval is NaN.
    """
    array = np.asarray(values, dtype=np.float64)
    known = np.sort(array[~np.isnan(array)])
    count = len(known)
    if not count:
        return Estimate(np.nan, np.nan, np.nan, 0)
    rank = int(scipy.stats.binom.ppf((1 - CONFIDENCE) / 2, count, 0.5))
    low, high = (known[rank - 1], known[count - rank]) if rank else (np.nan, np.nan)
    return Estimate(float(np.median(known)), float(low), float(high), count)


def improvement(ours: ArrayLike, theirs: ArrayLike) -> Estimate:
    """Compute the percentage by which the mean of `ours` is below that of `theirs`, for paired values."""
    pairs = np.array([ours, theirs], dtype=np.float64).reshape(2, -1)
    a, b = pairs[:, np.isfinite(pairs).all(axis=0)]
    ratio = float(a.mean() / b.mean()) if len(a) else np.nan
    value = 100.0 * (1.0 - ratio)
    if len(a) <= MANY:
        return _bootstrap((a, b), value, lambda x, y, axis: 100.0 * (1.0 - x.mean(axis=axis) / y.mean(axis=axis)))
    return _central_limit(100.0 * (ratio * b - a) / b.mean(), value)  # error of the ratio, to first order


def change(ours: ArrayLike, theirs: ArrayLike) -> Estimate:
    """Compute by how many percent the mean of unpaired values is above that of others."""
    a, b = _finite(ours), _finite(theirs)
    value = 100.0 * (float(a.mean() / b.mean()) - 1.0) if len(a) and len(b) else np.nan
    few = min(len(a), len(b))
    if few < 2:
        return Estimate(value, np.nan, np.nan, few)

    def statistic(x: Array, y: Array, axis: int) -> Array:
        return 100.0 * (x.mean(axis=axis) / y.mean(axis=axis) - 1.0)

    return _bootstrap((a, b), value, statistic, paired=False)


def _bootstrap(
    samples: tuple[Array, ...], value: float, statistic: Callable[..., Array], *, paired: bool = True
) -> Estimate:
    count = min(map(len, samples))
    if count < 2:
        return Estimate(value, np.nan, np.nan, count)
    if all(np.ptp(sample) == 0 for sample in samples):
        return Estimate(value, value, value, count)
    interval = scipy.stats.bootstrap(
        samples,
        statistic,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        paired=paired,
        rng=np.random.default_rng(0),
    ).confidence_interval
    return Estimate(value, float(interval.low), float(interval.high), count)


def _central_limit(deviations: Array, value: float) -> Estimate:
    """Return an estimate whose error is the mean error of its values."""
    half = scipy.stats.norm.ppf(0.5 + CONFIDENCE / 2) * float(deviations.std()) / np.sqrt(len(deviations))
    return Estimate(value, value - half, value + half, len(deviations))


def rate(successes: int, trials: int) -> Estimate:
    """Compute a rate with Wilson's score interval."""
    if trials == 0:
        return Estimate(np.nan, np.nan, np.nan, 0)
    interval = scipy.stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return Estimate(successes / trials, float(interval.low), float(interval.high), trials)


def win_probability(first: ArrayLike, second: ArrayLike) -> float:
    """Compute the share of pairs in which `first` is smaller; ties count one half, infinite values are the largest."""
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    return float(np.mean((a < b) + 0.5 * (a == b))) if a.size else float("nan")


def _finite(values: ArrayLike) -> Array:
    array = np.asarray(values, dtype=np.float64)
    return array[np.isfinite(array)]
