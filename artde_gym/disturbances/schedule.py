"""What happens at given times: pushes, and payloads that come and go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from artde_gym.robots.spec import Vector
from artde_gym.sim.engine import Engine


class Push(NamedTuple):
    """A constant `force` (N, world axes) at a `site`, in time steps from `first` up to, not including, `end`."""

    site: str
    force: Vector
    first: int
    end: int

    @classmethod
    def of(cls, entry: Mapping[str, Any], time_step: float) -> Push:
        """A realised push, in steps of `time_step` (s)."""
        direction = np.asarray(entry["direction"])
        x, y, z = (entry["magnitude"] * direction / np.linalg.norm(direction)).tolist()
        first = round(entry["start"] / time_step)
        return cls(entry["body"], (x, y, z), first, first + max(1, round(entry["duration"] / time_step)))


class Schedule:
    """The timed disturbances of one episode, in physics steps of `time_step` (s)."""

    def __init__(self, realised: Mapping[str, Any], time_step: float) -> None:
        self._time_step = time_step
        self._pushes = [Push.of(entry, time_step) for entry in realised.get("push", ())]
        self._payload: Mapping[str, Any] = realised.get("payload", {})
        self._changes: dict[int, list[str]] = {}
        for number, push in enumerate(self._pushes):
            self._announce(number, push)
        if self._payload and self._payload["drop"] > self._payload["attach"]:
            if self._payload["attach"] > 0:
                self._add(round(self._payload["attach"] / time_step), "payload attached")
            self._add(round(self._payload["drop"] / time_step), "payload dropped")

    def start(self, engine: Engine) -> None:
        """Bring about what is there before the first step."""
        if self._payload.get("attach") == 0 and self._payload["drop"] > 0:
            self._attach(engine)

    def add(self, push: Push) -> None:
        """One more push than was drawn."""
        self._announce(len(self._pushes), push)
        self._pushes.append(push)

    def drop(self, step: int) -> bool:
        """Drop the payload at a step instead of later; False if it is not there then."""
        time = step * self._time_step
        if not self._payload or not self._payload["attach"] <= time < self._payload["drop"]:
            return False
        self._changes[round(self._payload["drop"] / self._time_step)].remove("payload dropped")
        self._payload = {**self._payload, "drop": time}
        self._add(step, "payload dropped")
        return True

    def quiet(self, first: int, end: int) -> bool:
        """Whether nothing acts, begins or ends from step `first` up to, not including, `end`."""
        if not self._changes:  # every push begins and ends
            return True
        acting = any(push.first < end and first <= push.end for push in self._pushes)
        return not acting and not any(first <= step < end for step in self._changes)

    def acting(self, step: int) -> list[Push]:
        """The pushes that act during a step."""
        return [push for push in self._pushes if push.first <= step < push.end]

    def apply(self, step: int, engine: Engine) -> list[str]:
        """Bring about what belongs to a step; returns what begins or ends with it, in words."""
        events = self._changes.get(step, [])
        for event in events:
            if event == "payload attached":
                self._attach(engine)
            elif event == "payload dropped":
                engine.release_payload()
        for push in self.acting(step):
            engine.push(push.site, push.force)
        return events

    def _attach(self, engine: Engine) -> None:
        x, y, z = self._payload["position"]
        engine.attach_payload(self._payload["mass"], (x, y, z))

    def _announce(self, number: int, push: Push) -> None:
        self._add(push.first, f"push {number} begins")
        self._add(push.end, f"push {number} ends")

    def _add(self, step: int, event: str) -> None:
        self._changes.setdefault(step, []).append(event)
