"""Open registries: the project's own entries, those of installed plug-ins, and those registered at run time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from artde_gym.deprecation import GROUPS, warn
from artde_gym.errors import OptionError, UnknownNameError, suggest_names

T = TypeVar("T")


def pointed(group: str) -> dict[str, str]:
    """Return what the entry points of a group name, "module:object" by name, without importing any of it.

    The project's own come before others, in a fixed order.
    """
    return {point.name: point.value for point in _in_order(group)}


def _in_order(group: str) -> list[EntryPoint]:
    own = "artde-gym"
    old = entry_points(group=GROUPS[group]) if group in GROUPS else ()
    for point in old:
        warn(f"group {GROUPS[group]} of the entry point {point.name}", group)
    return sorted([*entry_points(group=group), *old], key=lambda p: (p.dist is None or p.dist.name != own, p.name))


class Registry(Mapping[str, T], Generic[T]):
    """Named entries, read as a mapping; plug-ins are looked for at the first look into it.

    Args:
        noun: of an entry, for errors.
        group: of the entry points (of any installed distribution) that bring entries.
        unpack: turns one loaded entry point into entries by name; without, it is one entry, under its own name.
        own: entries that are there from the beginning.
    """

    def __init__(
        self,
        noun: str,
        group: str,
        unpack: Callable[[Any], Mapping[str, T]] | None = None,
        own: Mapping[str, T] = MappingProxyType({}),
    ) -> None:
        self.noun, self.group = noun, group
        self._unpack = unpack
        self._entries: dict[str, T] = dict(own)
        self._loaded = False

    def register(self, name: str, entry: T, *, replace: bool = False) -> None:
        """Add an entry.

        Raises:
            OptionError: if the name is taken and `replace` is not given.
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
        """Load every entry point of the group, the project's own before others, in a fixed order."""
        if self._loaded:
            return
        self._loaded = True  # first: what is loaded may look in here
        for point in _in_order(self.group):
            loaded = self._imported(point)
            for name, entry in ({point.name: loaded} if self._unpack is None else self._unpack(loaded)).items():
                self._add(name, entry, replace=False)

    def _imported(self, point: EntryPoint) -> Any:
        """Import what a plug-in brings.

        Raises:
            UnknownNameError: if that cannot be imported.
        """
        try:
            return point.load()
        except (ImportError, AttributeError) as error:
            owner = "a plug-in" if point.dist is None else point.dist.name
            allowed = f'"module:object" that can be imported ({error}); mend or uninstall {owner}'
            raise UnknownNameError(f"entry point of {point.name!r} in {self.group}", point.value, allowed) from error

    def _add(self, name: str, entry: T, replace: bool) -> None:
        if name in self._entries and not replace:
            raise OptionError(self.noun, name, "a name that is not taken, or replace=True")
        self._entries[name] = entry
