"""Checks of what a user gives, whatever its type, each an error of ours."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import ActionError, ArtdeGymError, OptionError


def number(field: str, value: Any, low: float, high: float, allowed: str) -> float:
    """The value as a float, if it is a number from `low` to `high`.

    Raises:
        OptionError: if it is not; `allowed` says what is.
    """
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not (real and low <= value <= high):  # nan fails both comparisons
        raise OptionError(field, value, allowed)
    return float(value)


def whole(field: str, value: Any, low: int, high: int | None = None) -> int:
    """The value as an int, if it is a whole number from `low` to `high`; None for no upper end.

    Raises:
        OptionError: if it is not.
    """
    real = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not (real and low <= value and (high is None or value <= high)):
        raise OptionError(
            field, value, f"a whole number >= {low}" if high is None else f"a whole number, {low} to {high}"
        )
    return int(value)


def word(field: str, value: object, known: Collection[str]) -> str:
    """The value, if it is one of the known words.

    Raises:
        OptionError: if it is not.
    """
    if not (isinstance(value, str) and value in known):
        raise OptionError(field, value, ", ".join(map(repr, known)))
    return value


def flag(field: str, value: object) -> bool:
    """The value, if it is a truth value.

    Raises:
        OptionError: if it is not.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise OptionError(field, value, "True, False")
    return bool(value)


def action_array(action: Any, size: int, allowed: str) -> NDArray[np.float64]:
    """An action (size,) as floats.

    Raises:
        ActionError: for a wrong shape, or a value that is no finite number; `allowed` says what is.
    """
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ActionError("action", action, f"{size} numbers") from error
    if values.shape != (size,):
        raise ActionError("shape of the action", values.shape, f"({size},)")
    if not all(map(math.isfinite, values.tolist())):  # of few numbers faster than NumPy's
        raise ActionError("action", values.tolist(), f"finite {allowed}")
    return values


def file_name(field: str, value: object) -> str:
    """The value, if it is a word that can name a file in a folder of ours, and nothing outside.

    Raises:
        OptionError: if it is not.
    """
    if not (isinstance(value, str) and 0 < len(value) <= 100 and value[0] != "." and value.isprintable()):
        raise OptionError(field, value, "up to 100 printable characters, the first no dot")
    if "/" in value or "\\" in value:
        raise OptionError(field, value, "a name without slashes: files are named by it")
    return value


@contextlib.contextmanager
def reading(field: str, path: Path, allowed: str, kind: type[ArtdeGymError]) -> Iterator[None]:
    """What goes wrong inside, while a file is read that may be anybody's, becomes an error of the given kind.

    Everything, since damaged files make libraries raise almost anything: zlib.error, RecursionError, MemoryError, ...
    """
    try:
        yield
    except kind:
        raise
    except Exception as error:
        raise kind(field, str(path), f"{allowed} ({type(error).__name__}: {error})") from error
