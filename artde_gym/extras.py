"""Packages of the extras, which are imported where they are needed."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator

from artde_gym.errors import MissingDependencyError

_DISTRIBUTIONS = {"sklearn": "scikit-learn", "yaml": "pyyaml"}
"""Module -> the name under which it is installed, where they differ by more than an underscore."""


@contextlib.contextmanager
def needs(extra: str, otherwise: str = "") -> Iterator[None]:
    """Import packages of an extra inside; one that is missing is reported with the extra and how to install it.

    Args:
        extra: its name in pyproject.toml; it has everything that the caller needs, so that one installation is enough.
        otherwise: what else helps, added to the remedy.

    Raises:
        MissingDependencyError: if an import fails.
    """
    try:
        yield
    except MissingDependencyError:
        raise
    except ImportError as error:
        remedy = f"pip install 'artde-gym[{extra}]'{otherwise}"
        module = (error.name or "").partition(".")[0]
        if not isinstance(error, ModuleNotFoundError):
            remedy = f"it cannot be imported ({' '.join(str(error).split())}); {remedy}"
        package = _DISTRIBUTIONS.get(module, module.replace("_", "-"))
        missing = MissingDependencyError("package", package or extra, remedy)
        missing.name = error.name
        raise missing from error


def require(extra: str, *modules: str) -> None:
    """Check that modules of an extra can be imported, before anything is computed that needs them later.

    Raises:
        MissingDependencyError: if one cannot.
    """
    with needs(extra):
        for module in modules:
            importlib.import_module(module)
