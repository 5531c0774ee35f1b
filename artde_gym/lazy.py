"""Packages that import the modules behind their names when a name is first asked for (PEP 562)."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any


def lazy(package: str, names: Mapping[str, str], other: Callable[[str], Any] | None = None) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package whose names are imported on first access.

    A name may be that of a submodule, too: the package's attribute is the object, however the submodule was imported.

    Args:
        package: name of the package.
        names: name -> module that has it.
        other: `__getattr__` for all other names.
    """
    module: Any = sys.modules[package]
    module.__class__ = type("LazyPackage", (_LazyPackage,), {"lazy_names": frozenset(names)})

    def look_up(name: str) -> Any:
        if name in names:
            found = getattr(importlib.import_module(names[name]), name)
            setattr(module, name, found)  # from now on without this function
            return found
        if other is not None:
            return other(name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return look_up


class _LazyPackage(ModuleType):
    """A package in which a submodule does not hide the object of the same name."""

    lazy_names: frozenset[str]

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in self.lazy_names and isinstance(value, ModuleType)):
            super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*self.__dict__, *self.lazy_names})
