"""Learned baselines: a residual on a classical controller, its training and its saved policies.

`load(path)` gives a trained policy with Stable-Baselines3's `predict`; it needs neither torch nor Stable-Baselines3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from baselines.saved import load

__all__ = ["load"]


def __getattr__(name: str) -> Any:
    """Import `load` when it is asked for: whoever looks up a controller's name imports this package."""
    if name != "load":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from baselines.saved import load

    return load
