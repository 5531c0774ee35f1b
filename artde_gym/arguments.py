"""Validation of user input of any type; each failure raises an `ArtdeGymError`."""

from __future__ import annotations

import contextlib
import functools
import inspect
import math
import operator
from collections.abc import Callable, Collection, Iterator
from pathlib import Path
from typing import Any, Concatenate, Literal, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import (
    ActionError,
    ArtdeGymError,
    MissingDependencyError,
    OptionError,
    UnknownArgumentError,
    suggest_names,
)

Owner = TypeVar("Owner")
Arguments = ParamSpec("Arguments")

NUMERIC_KINDS = "biufO"  # array kinds that can hold real numbers; objects are converted one by one

NAME_BYTES = 200
"""Longest name within a file name: file systems allow 255 bytes, less a number, a suffix and an extension."""


def check_number(field: str, value: Any, low: float, high: float, allowed: str) -> float:
    """Return the value as a float if it is a number from `low` to `high`.

    Raises:
        OptionError: if it is not; `allowed` describes valid values.
    """
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not (real and low <= value <= high):  # nan fails both comparisons
        raise OptionError(field, value, allowed)
    return float(value)


def check_integer(field: str, value: Any, low: int, high: int | None = None) -> int:
    """Return the value as an int if it is a whole number from `low` to `high` (None: no upper bound).

    Raises:
        OptionError: if it is not.
    """
    real = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not (real and low <= value and (high is None or value <= high)):
        raise OptionError(
            field, value, f"a whole number >= {low}" if high is None else f"a whole number, {low} to {high}"
        )
    return int(value)


def check_choice(field: str, value: object, known: Collection[str]) -> str:
    """Return the value if it is one of the known choices.

    Raises:
        OptionError: if it is not.
    """
    if not (isinstance(value, str) and value in known):
        raise OptionError(field, value, ", ".join(map(repr, known)))
    return value


def check_bool(field: str, value: object) -> bool:
    """Return the value as a bool if it is a Boolean.

    Raises:
        OptionError: if it is not.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise OptionError(field, value, "True, False")
    return bool(value)


def action_array(action: Any, size: int, allowed: str) -> NDArray[np.float64]:
    """Return an action (size,) as floats: itself if it is an array of them, else a new array.

    Raises:
        ActionError: for a wrong shape or a value that is not a finite number; `allowed` describes valid values.
    """
    if type(action) is np.ndarray and action.dtype == np.float64:  # the usual case, and quick
        values = action
    else:
        values = real_array("action", action, f"{size} numbers")
    if values.shape != (size,):
        raise ActionError("shape of the action", values.shape, f"({size},)")
    if not all(map(math.isfinite, values.tolist())):  # faster than NumPy for few numbers
        raise ActionError("action", values.tolist(), f"finite {allowed}")
    return values


def real_array(
    field: str,
    value: Any,
    allowed: str,
    dtype: np.dtype[Any] | type[np.float64] = np.float64,
    order: Literal["C", "F"] = "C",
) -> NDArray[Any]:
    """Copy real numbers of any type into an array.

    Raises:
        ActionError: for anything else, including complex numbers and strings; `allowed` describes valid values.
    """
    try:
        given = np.asarray(value)
        if given.dtype.kind not in NUMERIC_KINDS:
            raise TypeError(f"values of type {given.dtype}")
        return np.array(given, dtype=dtype, order=order)
    except (
        TypeError,
        ValueError,
        OverflowError,
        RuntimeError,
    ) as error:  # RuntimeError: a tensor that tracks gradients
        raise ActionError(field, value, allowed) from error


def check_seed(field: str, value: Any) -> int | None:
    """Return the value as a seed if it is None or a whole number >= 0 of any type, including a 0-d array.

    Raises:
        OptionError: if it is not.
    """
    try:
        seed = None if value is None else operator.index(value)
    except TypeError:
        seed = -1
    if isinstance(value, (bool, np.bool_)) or (seed is not None and seed < 0):
        raise OptionError(field, value, "a whole number >= 0, or None")
    return seed


def known_arguments(
    initialize: Callable[Concatenate[Owner, Arguments], None],
) -> Callable[Concatenate[Owner, Arguments], None]:
    """Decorate an `__init__` so that an unknown keyword raises `UnknownArgumentError` with a suggestion."""
    _, *known = inspect.signature(initialize).parameters

    @functools.wraps(initialize)
    def checked(self: Owner, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        for name in kwargs:
            if name not in known:
                raise UnknownArgumentError(type(self).__name__, name, suggest_names(name, known))
        initialize(self, *args, **kwargs)

    return checked


def check_file_name(field: str, value: object) -> str:
    """Return the value if it is a valid file name that cannot leave its folder.

    Raises:
        OptionError: if it is not.
    """
    if not (isinstance(value, str) and 0 < len(value) <= 100 and value[0] != "." and value.isprintable()):
        raise OptionError(field, value, "up to 100 printable characters, the first no dot")
    if len(value.encode()) > NAME_BYTES:
        raise OptionError(field, value, f"up to {NAME_BYTES} bytes of UTF-8, as files are named by it")
    if "/" in value or "\\" in value:
        raise OptionError(field, value, "choose another name, as files are named by it", "contains a slash")
    return value


def check_name(field: str, value: object, reserved: Collection[str] = ()) -> str:
    """Return the value if it may name a registered entry, in lists with commas and in names of files.

    Args:
        field: of the name.
        value: to be checked.
        reserved: words with a meaning of their own where a name is expected.

    Raises:
        OptionError: if it is not.
    """
    name = check_file_name(field, value)
    if "," in name:
        raise OptionError(field, name, "choose another name, as lists of names have commas", "contains a comma")
    if name != name.strip():
        raise OptionError(field, name, "leave them out", "has spaces around it")
    if name in reserved:
        raise OptionError(field, name, "choose another name", "has a meaning of its own")
    return name


@contextlib.contextmanager
def wrap_read_errors(field: str, path: Path, allowed: str, kind: type[ArtdeGymError]) -> Iterator[None]:
    """Convert every exception raised while an untrusted file is read to an error of the given kind.

    Damaged files make libraries raise almost anything: zlib.error, RecursionError, MemoryError, ...
    """
    try:
        yield
    except (kind, MissingDependencyError):  # a missing package is no fault of the file
        raise
    except Exception as error:
        problem = f"cannot be read ({type(error).__name__}: {error})"
        raise kind(field, str(path), f"it must be {allowed}", problem) from error


def steps_per_period(control_period: float, step: float) -> int:
    """Return the number of steps of `step` (s) in a control period.

    Raises:
        OptionError: unless that is a whole number and the period is at most 0.05 s.
    """
    allowed = f"whole multiples of {step} s up to 0.05 s"
    period = check_number("control_period", control_period, 0.0, 0.05 + 0.5 * step, allowed)
    steps = round(period / step)
    if not (1 <= steps <= round(0.05 / step) and math.isclose(steps * step, period, rel_tol=1e-9)):
        raise OptionError("control_period", control_period, allowed)
    return steps
