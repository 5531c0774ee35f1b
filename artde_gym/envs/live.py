"""What a person can do to an episode that is running."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any

from artde_gym.disturbances.schedule import Push, Schedule
from artde_gym.errors import RobotError
from artde_gym.robots.spec import RobotSpec, Vector
from artde_gym.sim.engine import Engine


class Live(abc.ABC):
    """A part of an environment: pushes and drops that its disturbances did not foresee, and its window, if any."""

    nominal_robot: RobotSpec
    _engine: Engine
    _realised: Mapping[str, Any]

    @property
    @abc.abstractmethod
    def elapsed(self) -> int:
        """Physics steps since the reset."""

    @property
    @abc.abstractmethod
    def schedule(self) -> Schedule:
        """What happens in this episode, and when."""

    def push(self, site: str, force: Vector, duration: float = 0.2) -> None:
        """Push at a site of the robot (N, world axes) from now on, for a while (s).

        Raises:
            RobotError: for a site that the robot does not have.
        """
        sites = [name for name, _, _ in self.nominal_robot.sites]
        if site not in sites:
            raise RobotError("site", site, ", ".join(map(repr, sites)))
        first, steps = self.elapsed, max(1, round(duration / self._engine.time_step))
        self.schedule.add(Push(site, force, first, first + steps))

    def drop_payload(self) -> bool:
        """Drop the payload now; False if there is none."""
        dropped = self.schedule.drop(self.elapsed)
        if dropped:
            payload = {**self._realised["payload"], "drop": self.elapsed * self._engine.time_step}
            self._realised = {**self._realised, "payload": payload}
        return dropped

    def site(self, name: str) -> Vector:
        """Where a site of the robot is now (m, world axes).

        Raises:
            RobotError: for a site that the robot does not have.
        """
        return self._engine.site(name)

    @property
    def window(self) -> Any:
        """The engine's window (`artde_gym.sim.window.Window`), or None."""
        return self._engine.window
