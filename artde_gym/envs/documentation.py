"""Docstrings that are documentation pages."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TypeVar

Class = TypeVar("Class", bound=type)


def filled(**sections: str) -> Callable[[Class], Class]:
    """Return a class decorator that replaces names in braces in the docstring with sections."""

    def fill(documented: Class) -> Class:
        documented.__doc__ = inspect.cleandoc(str(documented.__doc__)).format(**sections)
        return documented

    return fill
