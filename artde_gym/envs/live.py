"""What a person can do to an episode that is running."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import Any

from artde_gym.disturbances.schedule import Push, Schedule
from artde_gym.errors import RobotError
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.engine import Engine


class Live(abc.ABC):
    """A part of an environment: pushes and drops that nobody planned, and a look at its world."""

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

    @property
    def engine(self) -> Engine:
        """The world that the robot is in, to be looked at."""
        return self._engine
