"""Registries of entries from this project, from installed plug-ins and registered at run time."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from artde_gym.arguments import check_name
from artde_gym.deprecation import GROUPS, warn
from artde_gym.errors import OptionError, UnknownNameError, suggest_names

T = TypeVar("T")


def pointed(group: str) -> dict[str, str]:
    """Return the entry points of a group, "module:object" by name, without importing any.

    The project's own come first, in a fixed order.
    """
    return {point.name: point.value for point in _in_order(group)}


def _in_order(group: str) -> list[EntryPoint]:
    own, installed = "artde-gym", _installed(tuple(sys.path))
    old = installed.select(group=GROUPS[group]) if group in GROUPS else ()
    for point in old:
        warn(f"group {GROUPS[group]} of the entry point {point.name}", group)
    return sorted([*installed.select(group=group), *old], key=lambda p: (p.dist is None or p.dist.name != own, p.name))


@functools.lru_cache(maxsize=1)
def _installed(_path: tuple[str, ...]) -> Any:
    """Return the entry points of all distributions on `sys.path`, which take milliseconds to find."""
    return entry_points()


class Registry(Mapping[str, T], Generic[T]):
    """A mapping of named entries that loads plug-ins on first access.

    Args:
        noun: word for an entry in errors.
        group: group of the entry points (of any installed distribution) that provide entries.
        unpack: converts a loaded entry point to entries by name; None: it is one entry under its own name.
        own: initial entries.
        reserved: words that name no entry.
    """

    def __init__(
        self,
        noun: str,
        group: str,
        unpack: Callable[[Any], Mapping[str, T]] | None = None,
        own: Mapping[str, T] = MappingProxyType({}),
        reserved: Collection[str] = (),
    ) -> None:
        self.noun, self.group = noun, group
        self._reserved = reserved
        self._unpack = unpack
        self._entries: dict[str, T] = dict(own)
        self._loaded = False

    def register(self, name: str, entry: T, *, replace: bool = False) -> None:
        """Add an entry.

        Raises:
            OptionError: if the name is not valid (`artde_gym.arguments.check_name`), or taken and `replace` not given.
        """
        self._load()
        self._add(name, entry, replace)

    def find(self, name: Any) -> T:
        """Return the entry called `name`.

        Raises:
            UnknownNameError: if there is none.
        """
        self._load()
        if not isinstance(name, str) or name not in self._entries:
            raise UnknownNameError(self.noun, name, suggest_names(name, self._entries))
        return self._entries[name]

    def __getitem__(self, name: str) -> T:
        self._load()
        return self._entries[name]

    def __iter__(self) -> Iterator[str]:
        self._load()
        return iter(self._entries)

    def __len__(self) -> int:
        self._load()
        return len(self._entries)

    def _load(self) -> None:
        """Load every entry point of the group, the project's own first, in a fixed order."""
        if self._loaded:
            return
        self._loaded = True  # set first: a plug-in may access the registry while it is loaded
        for point in _in_order(self.group):
            loaded = self._imported(point)
            for name, entry in ({point.name: loaded} if self._unpack is None else self._unpack(loaded)).items():
                self._add(name, entry, replace=False)

    def _imported(self, point: EntryPoint) -> Any:
        """Import the object of a plug-in.

        Raises:
            UnknownNameError: if it cannot be imported.
        """
        try:
            return point.load()
        except (ImportError, AttributeError) as error:
            owner = "a plug-in" if point.dist is None else point.dist.name
            problem = f"cannot be imported ({error})"
            field = f"entry point of {point.name!r} in {self.group}"
            raise UnknownNameError(field, point.value, f"repair or uninstall {owner}", problem) from error

    def _add(self, name: str, entry: T, replace: bool) -> None:
        check_name(f"name of {self.noun}", name, self._reserved)
        if name in self._entries and not replace:
            raise OptionError(self.noun, name, "choose another name, or replace=True", "is taken")
        self._entries[name] = entry
