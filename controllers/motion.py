"""Arguments of a robot's motion, which its drive names."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from artde_gym.errors import OptionError, suggest_names


def check_motion(robot: str, function: Callable[..., Any], motion: Mapping[str, Any]) -> None:
    """Raise OptionError for an argument that a robot's motion does not have."""
    known = inspect.signature(function).parameters
    for name in motion:
        if name not in known:
            allowed = suggest_names(name, known) if known else "none: it takes none"
            raise OptionError(f"argument of {robot!r}", name, allowed)
