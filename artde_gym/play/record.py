"""Disturbances of an episode that a person has disturbed, in the grammar that `evaluate` reads."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from artde_gym.disturbances.kinds import parameters_of
from artde_gym.disturbances.schedule import force_of
from artde_gym.errors import OptionError
from artde_gym.play.conditions import parameter_of

MOST_PUSHES = 1000  # of one episode
MAGNITUDE, DURATION = parameter_of("push", "magnitude"), parameter_of("push", "duration")
SHOWN = 10.0  # s, for which a push that is over is shown
_EPS = 1e-9  # s


def push_entry(site: str, force: Sequence[float], start: float, duration: float) -> dict[str, Any]:
    """Return a push (N, world axes) in the grammar, rounded, and no larger than that allows.

    Raises:
        OptionError: for a force of zero.
    """
    size = math.hypot(*force)
    magnitude = round(min(size, MAGNITUDE.high), 3)
    if not magnitude:
        raise OptionError("force", list(force), "a force that is not zero (N)")
    direction = [round(part / size, 5) for part in force]
    return {"body": site, "magnitude": magnitude, "direction": direction, "start": start, "duration": duration}


class Record:
    """The disturbances that were given at the start of an episode, and what was done since.

    Args:
        given: disturbances in the grammar.
    """

    def __init__(self, given: Mapping[str, Any]) -> None:
        self._given = copy.deepcopy(dict(given))
        self._pushes: list[dict[str, Any]] = []
        self._shown: list[dict[str, Any]] = []
        self._payload: dict[str, Any] = {}

    def push(self, entry: Mapping[str, Any]) -> None:
        """Add a push; one that goes on where the last one ends, with the same force, prolongs it.

        Raises:
            OptionError: for more than `MOST_PUSHES`.
        """
        last = self._pushes[-1] if self._pushes else None
        if last is not None and _follows(last, entry) and _same(last, entry):
            last["duration"] += entry["duration"]
        elif len(self._pushes) == MOST_PUSHES:
            raise OptionError("number of pushes", MOST_PUSHES + 1, f"at most {MOST_PUSHES} in an episode: reset it")
        else:
            self._pushes.append(dict(entry))
        self._show(entry)

    def attach(self, payload: Mapping[str, Any], time: float) -> None:
        """Add a payload that is attached at a time (s)."""
        self._payload = self._as_sampled({**payload, "attach_time": time})

    def drop(self, time: float) -> None:
        """Release the payload at a time (s)."""
        given = parameters_of("payload", self._given.get("payload"))
        self._payload = {**given, **self._payload, **self._as_sampled({"detach_time": time})}

    def _as_sampled(self, payload: Mapping[str, Any]) -> dict[str, Any]:
        """Return values of a payload so that sampling them takes as many random numbers as those that were given.

        All else that is sampled, noise and wind too, is then what it was in this episode.
        """
        given = parameters_of("payload", self._given.get("payload"))
        return {name: certain(value, given.get(name)) for name, value in payload.items()}

    def disturbances(self) -> dict[str, Any]:
        """Return all of them in the grammar."""
        done = copy.deepcopy(self._given)
        if self._pushes:
            done["push"] = [*listed(done.get("push")), *copy.deepcopy(self._pushes)]
        if self._payload:
            done["payload"] = dict(self._payload)
        return done

    def shown(self, time: float) -> list[dict[str, Any]]:
        """Return the pushes of the last `SHOWN` seconds as a page shows them; a drag is one of them."""
        self._shown = [one for one in self._shown if one["end"] > time - SHOWN]
        return self._shown

    def _show(self, entry: Mapping[str, Any]) -> None:
        text = push_text(entry)
        last = self._shown[-1] if self._shown else None
        if last is not None and last["site"] == text["site"] and abs(last["end"] - text["start"]) < _EPS:
            last["force"], last["end"] = text["force"], text["end"]
        else:
            self._shown.append(text)


def certain(value: Any, given: Any) -> Any:
    """Return a value, as a distribution of that value alone where a distribution was given."""
    if isinstance(given, list | tuple) and isinstance(value, list | tuple):
        return [certain(*pair) for pair in zip(value, given, strict=True)]
    if not isinstance(given, Mapping):
        return value
    ((kind, arguments),) = given.items()
    if kind == "normal":  # exact unless the given one was truncated, which takes further random numbers
        return {kind: [value, 0.0]}
    if kind == "uniform":
        return {kind: [value, value]}
    return {kind: [value] * len(arguments)}


def listed(given: Any) -> list[Any]:
    """Return the entries of a kind that takes one or several."""
    if given is None:
        return []
    return list(given) if isinstance(given, list | tuple) else [given]


def push_text(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return a push as a page shows it."""
    start = entry["start"]
    force = np.round(force_of(entry), 3).tolist()
    return {"site": entry["body"], "force": force, "start": start, "end": start + entry["duration"]}


def _follows(last: Mapping[str, Any], entry: Mapping[str, Any]) -> bool:
    return abs(last["start"] + last["duration"] - entry["start"]) < _EPS


def _same(last: Mapping[str, Any], entry: Mapping[str, Any]) -> bool:
    fits = last["duration"] + entry["duration"] <= DURATION.high
    return fits and all(last[key] == entry[key] for key in ("body", "magnitude", "direction"))
