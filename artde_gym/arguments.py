"""Checks of what a user gives, whatever its type, each an error of ours."""

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

from artde_gym.errors import ActionError, ArtdeGymError, OptionError, UnknownArgumentError, suggest_names

Owner = TypeVar("Owner")
Arguments = ParamSpec("Arguments")

NUMERIC = "biufO"  # kinds of arrays that hold real numbers; objects are tried one by one

NAME_BYTES = 200
"""Of a name that is a part of a file's: file systems take 255, and a number, an ending and what is added come to it."""


def check_number(field: str, value: Any, low: float, high: float, allowed: str) -> float:
    """The value as a float, if it is a number from `low` to `high`.

    Raises:
        OptionError: if it is not; `allowed` says what is.
    """
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    if not (real and low <= value <= high):  # nan fails both comparisons
        raise OptionError(field, value, allowed)
    return float(value)


def check_integer(field: str, value: Any, low: int, high: int | None = None) -> int:
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


def check_choice(field: str, value: object, known: Collection[str]) -> str:
    """The value, if it is one of the known words.

    Raises:
        OptionError: if it is not.
    """
    if not (isinstance(value, str) and value in known):
        raise OptionError(field, value, ", ".join(map(repr, known)))
    return value


def check_bool(field: str, value: object) -> bool:
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
    values = real_array("action", action, f"{size} numbers")
    if values.shape != (size,):
        raise ActionError("shape of the action", values.shape, f"({size},)")
    if not all(map(math.isfinite, values.tolist())):  # of few numbers faster than NumPy's
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
        ActionError: for anything else, complex numbers and words of digits included; `allowed` says what is.
    """
    try:
        given = np.asarray(value)
        if given.dtype.kind not in NUMERIC:
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
    """The value as a seed, if it is a whole number >= 0 of any type, an array of no dimension included, or None.

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
    """Decorate an `__init__` so that an unknown keyword raises `UnknownArgumentError` with the one that was meant."""
    _, *known = inspect.signature(initialize).parameters

    @functools.wraps(initialize)
    def checked(self: Owner, /, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        for name in kwargs:
            if name not in known:
                raise UnknownArgumentError(type(self).__name__, name, suggest_names(name, known))
        initialize(self, *args, **kwargs)

    return checked


def check_file_name(field: str, value: object) -> str:
    """The value, if it is a word that can name a file in a folder of ours, and nothing outside.

    Raises:
        OptionError: if it is not.
    """
    if not (isinstance(value, str) and 0 < len(value) <= 100 and value[0] != "." and value.isprintable()):
        raise OptionError(field, value, "up to 100 printable characters, the first no dot")
    if len(value.encode()) > NAME_BYTES:
        raise OptionError(field, value, f"up to {NAME_BYTES} bytes of UTF-8: files are named by it")
    if "/" in value or "\\" in value:
        raise OptionError(field, value, "a name without slashes: files are named by it")
    return value


@contextlib.contextmanager
def wrap_read_errors(field: str, path: Path, allowed: str, kind: type[ArtdeGymError]) -> Iterator[None]:
    """What goes wrong inside, while a file is read that may be anybody's, becomes an error of the given kind.

    Everything, since damaged files make libraries raise almost anything: zlib.error, RecursionError, MemoryError, ...
    """
    try:
        yield
    except kind:
        raise
    except Exception as error:
        raise kind(field, str(path), f"{allowed} ({type(error).__name__}: {error})") from error


def steps_per_period(control_period: float, step: float) -> int:
    """How many steps of `step` (s) make a control period.

    Raises:
        OptionError: unless it is a whole number, and the period 0.05 s at most.
    """
    allowed = f"whole multiples of {step} s up to 0.05 s"
    period = check_number("control_period", control_period, 0.0, 0.05 + 0.5 * step, allowed)
    steps = round(period / step)
    if not (1 <= steps <= round(0.05 / step) and math.isclose(steps * step, period, rel_tol=1e-9)):
        raise OptionError("control_period", control_period, allowed)
    return steps
