"""Counter-based white noise: a function of a key and an index, the same for one environment and for many at once.

Output `index` of the stream `key` is SplitMix64's (G. Steele, D. Lea and C. Flood, "Fast splittable pseudorandom number
generators", OOPSLA 2014). Streams have no state, and thousands of them are read in a few array operations, at a tenth
of the cost of as many generators.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import DTypeLike, NDArray
from scipy.special import ndtri

from artde_gym.arrays import Array

Integers = NDArray[np.uint64]

_STEP = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_SHIFTS = tuple(np.uint64(bits) for bits in (30, 27, 31, 11))
_TO_UNIT_VARIANCE = math.sqrt(12.0 / (2.0**32 - 1.0))  # of the 2^16 values of a uniform integer


def draw_keys(rng: np.random.Generator, count: int) -> Integers:
    """Draw keys of `count` new streams."""
    return rng.integers(2**64, size=count, dtype=np.uint64)


def uniform_noise(keys: Integers, index: Integers, dtype: DTypeLike = np.float64) -> Array:
    """Return four uniform numbers of mean 0 and variance 1 for each key and index, (4, ...) with their broadcast shape.

    After a filter they are nearly Gaussian, at a far lower cost than normal numbers.
    """
    bits = _random_bits(keys, index)
    integers = np.moveaxis(bits.view(np.int16).reshape(*bits.shape, 4), -1, 0)
    return (integers.astype(dtype) + 0.5) * _TO_UNIT_VARIANCE


def normal_noise(keys: Integers, index: Integers, size: int) -> Array:
    """Return `size` standard normal numbers for each key and index, (size, ...) with their broadcast shape."""
    numbers = np.arange(size, dtype=np.uint64).reshape(-1, *[1] * index.ndim)
    bits = _random_bits(keys, index * np.uint64(size) + numbers)
    return ndtri(((bits >> _SHIFTS[3]) + 0.5) * 2.0**-53)


def _random_bits(keys: Integers, index: Integers) -> Integers:
    z = keys + (index + np.uint64(1)) * _STEP
    z ^= z >> _SHIFTS[0]
    z *= _FIRST
    z ^= z >> _SHIFTS[1]
    z *= _SECOND
    z ^= z >> _SHIFTS[2]
    return z
