"""What is left of an environment that was closed."""

from __future__ import annotations

from typing import Any, NoReturn

import gymnasium as gym

CLOSED_MESSAGE = "the environment is closed: make a new one"


class _ClosedEngine:
    """In place of an engine (`artde_gym.sim.engine.Engine`): whatever it is asked, the answer is an error."""

    def close(self) -> None:
        """Closed it is."""

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):
            raise AttributeError(name)  # as Python asks when it copies
        raise gym.error.ClosedEnvironmentError(CLOSED_MESSAGE)

    def __reduce__(self) -> str:
        return "CLOSED"  # of which there is one, also in a copy


def require_open(*, closed: bool) -> None:
    """Refuse to go on.

    Raises:
        gymnasium.error.ClosedEnvironmentError: if the environment is closed.
    """
    if closed:
        raise gym.error.ClosedEnvironmentError(CLOSED_MESSAGE)


CLOSED: Any = _ClosedEngine()
