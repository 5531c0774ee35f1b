"""Old names of modules and of their contents, which keep working for one release with a `DeprecationWarning`."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any

MODULES: dict[str, str] = {
    "artde_gym.evaluation.claims": "artde_gym.studies.reproduce.claims",
    "artde_gym.evaluation.film": "artde_gym.video",
    "artde_gym.evaluation.frontier": "artde_gym.studies.frontier.search",
    "artde_gym.evaluation.palette": "artde_gym.palette",
    "artde_gym.evaluation.report": "artde_gym.report",
    "artde_gym.evaluation.reproduce": "artde_gym.studies.reproduce.reproduction",
    "artde_gym.evaluation.scenarios": "artde_gym.scenarios",
    "artde_gym.evaluation.sweep": "artde_gym.studies.sweep.execution",
    "artde_gym.evaluation.sweep_store": "artde_gym.studies.sweep.store",
    "artde_gym.evaluation.tune": "artde_gym.studies.tune.tuning",
    "artde_gym.robots.dynamics": "artde_gym.multibody.dynamics",
    "artde_gym.robots.spec": "artde_gym.multibody.spec",
}
"""Old module -> where its contents are now."""


def warn(old: str, new: str) -> None:
    """Tell the user's own code, which lies above this project's, to use the new name."""
    warnings.warn(f"{old} is deprecated; use {new}", DeprecationWarning, stacklevel=3)


def moved(module: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a module's `__getattr__` (PEP 562) for names that another module holds now.

    Args:
        module: that had them.
        names: name -> module that has it.
    """

    def look_up(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        warn(f"{module}.{name}", f"{names[name]}.{name}")
        return getattr(importlib.import_module(names[name]), name)

    return look_up


class _OldModules(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finds the modules of `MODULES` under their old names, with the contents of the new ones."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        return importlib.machinery.ModuleSpec(fullname, self) if fullname in MODULES else None

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        new = MODULES[module.__name__]
        warn(module.__name__, new)
        module.__dict__.update(
            {name: value for name, value in vars(importlib.import_module(new)).items() if not name.startswith("__")}
        )


def find_old_modules() -> None:
    """Make the old modules importable; called once, by `import artde_gym`."""
    if not any(isinstance(finder, _OldModules) for finder in sys.meta_path):
        sys.meta_path.append(_OldModules())
