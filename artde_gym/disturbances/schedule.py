"""Timed disturbances: pushes, and payloads that are attached and released."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol, cast

import numpy as np

from artde_gym.multibody.spec import Vector

NEVER = 2**62  # steps
EVENTS = PUSH_BEGINS, PUSH_ENDS, ATTACHED, DROPPED = "push_begins", "push_ends", "payload_attached", "payload_dropped"


class Loaded(Protocol):
    """The target of a schedule: an engine's `World` or a plug-in's dynamics."""

    def apply_force(self, site: str, force: Vector) -> None: ...
    def attach_payload(self, mass: float, position: Vector) -> None: ...
    def release_payload(self) -> None: ...


class Slinging(Loaded, Protocol):
    """World of a schedule with a payload on a cable."""

    def hang_payload(self, mass: float, hook: Vector, length: float) -> None: ...


class Push(NamedTuple):
    """A constant `force` (N, world axes) at a `site` in time steps `first` to `end` - 1."""

    site: str
    force: Vector
    first: int
    end: int

    @classmethod
    def of(cls, entry: Mapping[str, Any], time_step: float) -> Push:
        """Convert a sampled push to steps of `time_step` (s)."""
        first = round(entry["start"] / time_step)
        return cls(entry["body"], force_of(entry), first, first + max(1, round(entry["duration"] / time_step)))


def force_of(entry: Mapping[str, Any]) -> Vector:
    """Return the force (N, world axes) of a sampled push."""
    given = np.asarray(entry["direction"], np.float64)
    direction = np.ldexp(given, -np.frexp(np.abs(given).max())[1])  # exact, so that no square underflows
    x, y, z = (entry["magnitude"] * direction / np.linalg.norm(direction)).tolist()
    return x, y, z


class Schedule:
    """The timed disturbances of one episode, in physics steps of `time_step` (s)."""

    def __init__(self, sampled: Mapping[str, Any], time_step: float) -> None:
        self._time_step = time_step
        self._pushes = [Push.of(entry, time_step) for entry in sampled.get("push", ())]
        self._payload: Mapping[str, Any] = sampled.get("payload", {})
        self._changes: dict[int, list[str]] = {}
        self._quiet_from = self._quiet_until = 0  # nothing acts, begins or ends from the first of these steps on
        for push in self._pushes:
            self._announce(push)
        if self._payload and self._payload["detach_time"] > self._payload["attach_time"]:
            if self._payload["attach_time"] > 0:
                self._add(round(self._payload["attach_time"] / time_step), ATTACHED)
            self._add(round(self._payload["detach_time"] / time_step), DROPPED)

    def start(self, world: Loaded) -> None:
        """Apply everything that acts before the first step."""
        if self._payload.get("attach_time") == 0 and self._payload["detach_time"] > 0:
            self._attach(world)

    def add(self, push: Push) -> None:
        """Add a push to the sampled ones."""
        self._announce(push)
        self._pushes.append(push)

    def attach(self, step: int, payload: Mapping[str, Any]) -> bool:
        """Attach a sampled payload at a step, until its `detach_time`; return False if the episode has one already."""
        if self._payload.get("detach_time", 0.0) > self._payload.get("attach_time", 0.0):
            return False
        self._payload = {**payload, "attach_time": step * self._time_step}
        self._add(step, ATTACHED)
        self._add(round(self._payload["detach_time"] / self._time_step), DROPPED)
        return True

    def drop(self, step: int) -> bool:
        """Drop the payload at a step instead of later; return False if it is not attached then."""
        time = step * self._time_step
        if not self._payload or not self._payload["attach_time"] <= time < self._payload["detach_time"]:
            return False
        self._changes[round(self._payload["detach_time"] / self._time_step)].remove(DROPPED)
        self._payload = {**self._payload, "detach_time": time}
        self._add(step, DROPPED)
        return True

    def quiet(self, first: int, end: int) -> bool:
        """Return True if nothing acts, begins or ends in steps `first` to `end` - 1."""
        return self.next(first) >= end

    def next(self, step: int) -> int:
        """Return the first step from `step` on in which something acts, begins or ends; `NEVER` if there is none."""
        if not self._quiet_from <= step < self._quiet_until:
            self._quiet_from, self._quiet_until = step, self._find_next(step)
        return self._quiet_until

    def _find_next(self, step: int) -> int:
        if self.acting(step):
            return step
        return min((change for change in self._changes if change >= step), default=NEVER)  # every push begins and ends

    def acting(self, step: int) -> list[Push]:
        """Return the pushes that act during a step."""
        return [push for push in self._pushes if push.first <= step < push.end]

    def apply(self, step: int, world: Loaded) -> list[str]:
        """Apply the disturbances of a step; return its `EVENTS`."""
        events = self._changes.get(step, [])
        for event in events:
            if event == ATTACHED:
                self._attach(world)
            elif event == DROPPED:
                world.release_payload()
        for push in self.acting(step):
            world.apply_force(push.site, push.force)
        return events

    def _attach(self, world: Loaded) -> None:
        x, y, z = self._payload["position"]
        if length := self._payload.get("cable", 0.0):
            cast(Slinging, world).hang_payload(self._payload["mass"], (x, y, z), length)
        else:
            world.attach_payload(self._payload["mass"], (x, y, z))

    def _announce(self, push: Push) -> None:
        self._add(push.first, PUSH_BEGINS)
        self._add(push.end, PUSH_ENDS)

    def _add(self, step: int, event: str) -> None:
        self._quiet_until = 0  # to be found again
        self._changes.setdefault(step, []).append(event)
