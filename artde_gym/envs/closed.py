"""What is left of an environment that was closed."""

from __future__ import annotations

from typing import Any, NoReturn

import gymnasium as gym


class _ClosedEngine:
    """In place of an engine (`artde_gym.sim.engine.Engine`): whatever it is asked, the answer is an error."""

    def close(self) -> None:
        """Closed it is."""

    def __getattr__(self, name: str) -> NoReturn:
        raise gym.error.ClosedEnvironmentError("the environment is closed: make a new one")


CLOSED: Any = _ClosedEngine()
