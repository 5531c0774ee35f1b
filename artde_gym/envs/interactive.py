"""User interaction with a running episode."""

from __future__ import annotations

import abc
import copy
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np

from artde_gym.disturbances.grammar import duplicate
from artde_gym.disturbances.numeric import numeric
from artde_gym.disturbances.schedule import Push, Schedule
from artde_gym.envs.disturbed import DisturbedMixin
from artde_gym.errors import RobotError
from artde_gym.info import EpisodeInfo
from artde_gym.multibody.spec import Vector


class InteractiveMixin(DisturbedMixin, abc.ABC):
    """A mixin of environments: pushes, payloads and drops on demand."""

    time_step: ClassVar[float]  # s, of the physics
    fall_reasons: ClassVar[Sequence[str]]
    reward_scales: ClassVar[Mapping[str, float]]
    schedule: Schedule  # of this episode's events
    _sampled: Mapping[str, Any]

    def __copy__(self) -> Self:
        return copy.deepcopy(self)  # environments cannot share an engine

    @property
    @abc.abstractmethod
    def elapsed(self) -> int:
        """Physics steps since the reset."""

    def push(self, site: str, force: Vector, duration: float = 0.2) -> None:
        """Push at a site of the robot with `force` (N, world axes) for `duration` (s), starting now.

        Raises:
            RobotError: for a site that the robot does not have.
        """
        sites = self.words["site"]
        if site not in sites:
            raise RobotError("site", site, ", ".join(map(repr, sites)))
        first, steps = self.elapsed, max(1, round(duration / self.time_step))
        self.schedule.add(Push(site, force, first, first + steps))

    def add_payload(self, payload: Mapping[str, Any]) -> bool:
        """Attach a payload now, in numbers of the grammar of disturbances; return False if the episode had one.

        Raises:
            DisturbanceError: for a payload that the robot cannot carry.
        """
        given = {"payload": {**payload, "attach_time": self.elapsed * self.time_step}}
        sampled = self._parse(given).sample(np.random.default_rng(0))
        added = self.schedule.attach(self.elapsed, self._mounted(sampled)["payload"])
        if added:
            self._sample({**self._sampled, **sampled})
        return added

    def drop_payload(self) -> bool:
        """Drop the payload now; return False if there is none."""
        dropped = self.schedule.drop(self.elapsed)
        if dropped:
            payload = {**self._sampled["payload"], "detach_time": self.elapsed * self.time_step}
            self._sample({**self._sampled, "payload": payload})
        return dropped

    def _mounted(self, sampled: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return sampled disturbances with the payload's position in the frame of the body that carries it."""
        return sampled

    @property
    def sampled_disturbances(self) -> dict[str, Any]:
        """The disturbances of this episode in the grammar of `artde_gym.disturbances`, which `reset` accepts."""
        return duplicate(self._sampled)

    def _sample(self, sampled: Mapping[str, Any]) -> None:
        self._sampled = sampled
        self._told = EpisodeInfo(numeric(sampled, self.words), self.fall_reasons, self.reward_scales)
