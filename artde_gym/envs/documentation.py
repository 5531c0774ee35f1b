"""Docstrings that are documentation pages."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TypeVar

Class = TypeVar("Class", bound=type)


def filled(**sections: str) -> Callable[[Class], Class]:
    """Class decorator: put sections in the place of their names in braces in the docstring."""

    def fill(documented: Class) -> Class:
        documented.__doc__ = inspect.cleandoc(str(documented.__doc__)).format(**sections)
        return documented

    return fill
