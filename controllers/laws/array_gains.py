"""Gains of which some are arrays: to differentiate by them, or to have one set for each row of a batch."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from controllers.laws.errors import GainError

Gains = TypeVar("Gains")


def with_arrays(gains: Gains, **values: Any) -> Gains:
    """Return a copy of gains with some values in place of theirs, which are not checked: arrays of any library.

    Args:
        gains: a law's.
        values: by name; a scalar array for all joints, (n,) for one a joint, or with leading axes as the signals have.

    Raises:
        GainError: for a gain that the law does not have.
    """
    fields: Any = [field.name for field in dataclasses.fields(gains)]  # pyright: ignore[reportArgumentType]
    for name in values:
        if name not in fields:
            raise GainError(name, values[name], f"a gain of {type(gains).__name__}: {', '.join(fields)}")
    made: Gains = object.__new__(type(gains))
    for name in fields:  # one by one: a copy would keep what has been derived from the values before
        object.__setattr__(made, name, values.get(name, getattr(gains, name)))
    return made
