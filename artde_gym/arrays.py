"""The one array type of this project's signatures; shapes and units are in the docstrings."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.floating[Any]]


def vectorize(function: Callable[..., float]) -> Callable[..., Array]:
    """A function of numbers as one of arrays (n,): for those of `math`, since NumPy's own round otherwise."""

    def mapped(*arrays: Array) -> Array:
        return np.fromiter(map(function, *(array.tolist() for array in arrays)), np.float64, len(arrays[0]))

    return mapped


def total(values: Iterable[float]) -> float:
    """Add numbers from left to right, as a batch does: since Python 3.12, `sum` corrects the last bit."""
    return functools.reduce(operator.add, values, 0.0)
