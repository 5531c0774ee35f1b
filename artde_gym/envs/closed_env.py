"""Errors for environments that are used after `close`."""

from __future__ import annotations

from typing import Any, NoReturn

import gymnasium as gym

CLOSED_MESSAGE = "the environment is closed: make a new one"


class _ClosedEngine:
    """A replacement of an engine (`artde_gym.sim.engine.Engine`) that raises an error on every access."""

    def close(self) -> None:
        """Do nothing: already closed."""

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):
            raise AttributeError(name)  # special methods, which Python looks up to copy an object
        raise gym.error.ClosedEnvironmentError(CLOSED_MESSAGE)

    def __reduce__(self) -> str:
        return "CLOSED"  # a copy is the same object


def require_open(*, closed: bool) -> None:
    """Check that an environment is open.

    Raises:
        gymnasium.error.ClosedEnvironmentError: if the environment is closed.
    """
    if closed:
        raise gym.error.ClosedEnvironmentError(CLOSED_MESSAGE)


CLOSED: Any = _ClosedEngine()
