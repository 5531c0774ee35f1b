"""The simulation of live play: one or two controllers, and what a person asks for. It knows nothing of browsers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from artde_gym.arguments import check_bool, check_choice, check_integer, check_number
from artde_gym.disturbances.schedule import force_of
from artde_gym.errors import ArtdeGymError, OptionError
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.kit import PAYLOAD
from artde_gym.play.conditions import conditions_of, parameter_of, with_condition
from artde_gym.play.player import Player
from artde_gym.play.record import Record, push_entry, push_text
from artde_gym.registration import registered_controllers

TOGETHER = 2  # controllers at most
PUSH_DURATION = 0.2  # s, of a push by key or button
PULL_DURATION = 0.05  # s, for which the force of a drag stays the same
PULL_LASTS = 1.0  # s of real time, after which a drag ends that no browser tells any more
PAYLOAD_SHARE = 0.15  # mass of a payload over the robot's, where none was given
SPEED_RANGE = (1 / 64, 4.0)  # slowest and fastest, simulated over real time
LARGEST_SEED = 2**31 - 1
FORCE = 1e6  # N, beyond which a force is an error; a smaller one is cut to what the grammar allows
MASS = parameter_of("payload", "mass")
_EPS = 1e-9  # s


class Game:
    """One or two controllers under the same disturbances.

    Args:
        plan: controllers, their gains, and one cell.

    Attributes:
        players: one a controller.
        time: simulated time of this episode (s).
        seed: base seed; episodes are those of `evaluate` with `--seed`, number 0.
        speed: simulated over real time.
        paused: True while paused.
        record: the disturbances of this episode.
        given: disturbances with which episodes begin.
        payload: what `attach` attaches, without its times.
        scheduled: pushes of the scenario as a page shows them.
        refused: why the last order was refused, or "".
        version: number that changes when anything but the motion does.

    Raises:
        OptionError: for more than two controllers, several cells, or an environment that does not tell poses.
    """

    def __init__(self, plan: Plan) -> None:
        if not 1 <= len(plan.controllers) <= TOGETHER:
            raise OptionError("controllers", list(plan.controllers), f"1 to {TOGETHER} names")
        (self.cell,) = plan.cells
        self.seed, self.speed, self.paused, self.version, self.refused = plan.seed, 1.0, False, 0, ""
        self.players = [
            Player(self.cell, name, item, plan.gains.get(name, {})) for name, item in plan.controllers.items()
        ]
        plant = self.players[0].plant
        self.period: float = plant.control_period
        self.able = {name: hasattr(plant, method) for name, method in _METHODS.items()}
        self.sites: list[str] = list(plant.words["site"])
        self.payload: dict[str, Any] = {"mass": round(PAYLOAD_SHARE * plant.nominal_robot.mass, 2)}
        self.given = self._first_disturbances()
        self._reset()

    def _first_disturbances(self) -> dict[str, Any]:
        """Return the disturbances of the cell, or the environment's own."""
        plant = self.players[0].plant
        if "disturbances" in self.cell.kwargs:
            return dict(self.cell.kwargs["disturbances"])
        if hasattr(plant, "default_disturbances"):
            return dict(plant.default_disturbances)
        plant.reset(seed=episode_seed(self.seed, 0))
        return dict(plant.sampled_disturbances)

    def advance(self, seconds: float) -> None:
        """Simulate so many seconds of real time; rounding to control periods does not accumulate."""
        if self.paused or self.over:
            return
        self._held -= seconds
        if self._held < _EPS:
            self._pull = None
        self._wanted += seconds * self.speed
        while self.time < self._wanted - _EPS and not self.over:
            self._step()

    def do(self, order: Mapping[str, Any]) -> None:
        """Carry out an order; one that is refused changes nothing but the message `refused`."""
        self.version += 1
        try:
            name = check_choice("order", order.get("do"), list(ORDERS))
            ORDERS[name](self, order)
            self.refused = ""
        except ArtdeGymError as error:
            self.refused = str(error)
        except KeyError as error:
            self.refused = f"{order.get('do')} needs {error}"

    @property
    def over(self) -> bool:
        """True once the episodes of all players have ended."""
        return all(player.over for player in self.players)

    def frame(self) -> bytes:
        """Return the time and the frame of each player (`Player.frame`) as float32."""
        return np.concatenate([[self.time], *(player.frame() for player in self.players)], dtype=np.float32).tobytes()

    @property
    def leader(self) -> Player:
        """The first player whose episode goes on, else the first."""
        return next((player for player in self.players if not player.over), self.players[0])

    def _reset(self) -> None:
        begun = self._with_room()
        for player in self.players:
            player.reset(episode_seed(self.seed, 0), begun)
        self._steps, self.time, self._wanted = 0, 0.0, 0.0
        self._pull: tuple[str, tuple[float, ...]] | None = None
        self._pulled, self._held = 0.0, 0.0  # s, until when the force of a drag acts, and for how long it is held
        self.record = Record(begun)
        sampled = self.players[0].plant.sampled_disturbances
        self.scheduled = [push_text(entry) for entry in sampled.get("push", ())]
        if PAYLOAD in sampled:
            self.payload = {key: value for key, value in sampled[PAYLOAD].items() if not key.endswith("_time")}
        self.version += 1

    def _with_room(self) -> dict[str, Any]:
        """Return the disturbances with a payload that never appears where there is none.

        One that is attached later then finds the robot settled as when the episode runs again.
        """
        room = {PAYLOAD: {**self.payload, "attach_time": 0.0, "detach_time": 0.0}} if self.able["attach"] else {}
        return {**room, **self.given}

    def _restart(self, given: dict[str, Any]) -> None:
        """Restart with other disturbances; refused ones leave the old ones."""
        before, self.given = self.given, given
        try:
            self._reset()
        except ArtdeGymError:
            self.given = before
            self._reset()
            raise

    def _step(self) -> None:
        """Simulate one control period of each player."""
        if self._pull is not None and self.time >= self._pulled - _EPS:
            site, force = self._pull
            duration = max(1, round(PULL_DURATION / self.period)) * self.period
            self._pulled = self.time + duration
            try:
                self._apply(push_entry(site, force, self.time, duration))
            except ArtdeGymError as error:
                self._pull, self.refused = None, str(error)
        for player in self.players:
            if not player.over:
                player.step()
                self.version += player.over
        self._steps += 1
        before, self.time = self.time, self._steps * self.period
        self.version += self._changed(before)

    def _changed(self, before: float) -> bool:
        """Tell whether the payload came or went since a time (s)."""
        payload = self.leader.plant.sampled_disturbances.get(PAYLOAD, {})
        return any(before < payload.get(key, math.inf) - _EPS <= self.time for key in ("attach_time", "detach_time"))

    def _apply(self, entry: dict[str, Any]) -> None:
        self.record.push(entry)
        for player in self.players:
            if not player.over:
                player.plant.push(entry["body"], force_of(entry), entry["duration"])
        self.version += 1

    def _begun(self) -> None:
        """See that the episode has begun: a payload that comes or goes at its very start means balance without it."""
        if not self._steps:
            self._step()

    def _require(self, what: str) -> None:
        if not self.able[what]:
            raise OptionError("order", what, f"one of an environment with the method `{_METHODS[what]}`")

    def _site(self, order: Mapping[str, Any]) -> str:
        self._require("push")
        site = check_choice("site", order["site"], self.sites)
        if site == PAYLOAD and not comes(self.leader.plant.sampled_disturbances.get(PAYLOAD)):
            raise OptionError("site", site, "a site of the robot itself: there is no payload")
        return site

    def _push(self, order: Mapping[str, Any]) -> None:
        site, force = self._site(order), _force(order["force"])
        if not self.over:
            self._apply(push_entry(site, force, self.time, PUSH_DURATION))

    def _drag(self, order: Mapping[str, Any]) -> None:
        if order["force"] is None:
            self._pull = None
            return
        x, y, z = (round(part, 1) for part in _force(order["force"]))
        site = self._site(order)
        self._pull, self._held = (site, (x, y, z)) if (x, y, z) != (0.0, 0.0, 0.0) else None, PULL_LASTS

    def _drop(self, order: Mapping[str, Any]) -> None:
        self._require("drop")
        if self.over:
            return
        self._begun()
        dropped = [player.plant.drop_payload() for player in self.players if not player.over]
        if not any(dropped):
            raise OptionError("payload", "none", "one that is attached, to be dropped")
        self.record.drop(self.time)

    def _attach(self, order: Mapping[str, Any]) -> None:
        self._require("attach")
        low, high = MASS.low, MASS.high
        mass = check_number("mass", order["mass"], low, high, f"{low:g} to {high:g} kg")
        if self.over:
            return
        self._begun()
        payload = {**self.payload, "mass": mass}
        added = [player.plant.add_payload(payload) for player in self.players if not player.over]
        if not any(added):
            raise OptionError("payload", "one already", "one in an episode: reset without it")
        self.record.attach(payload, self.time)

    def _lade(self, order: Mapping[str, Any]) -> None:
        given = {name: value for name, value in self.given.items() if name != PAYLOAD}
        if check_bool("on", order["on"]):
            given[PAYLOAD] = dict(self.payload)
        self._restart(given)

    def _condition(self, order: Mapping[str, Any]) -> None:
        kinds = conditions_of(self.players[0].plant.robot_name)
        kind = check_choice("kind", order["kind"], kinds)
        self._restart(with_condition(self.given, kind, order["value"]))

    def _pause(self, order: Mapping[str, Any]) -> None:
        self.paused = check_bool("on", order["on"])

    def _pace(self, order: Mapping[str, Any]) -> None:
        slowest, fastest = SPEED_RANGE
        wanted = check_number("speed", order["value"], 0.0, 1e9, "a number > 0")
        self.speed = min(fastest, max(slowest, wanted))

    def _restart_with_seed(self, order: Mapping[str, Any]) -> None:
        self.seed = check_integer("seed", order.get("seed", self.seed), 0, LARGEST_SEED)
        self._reset()

    def _player(self, order: Mapping[str, Any]) -> Player:
        return self.players[check_integer("player", order["player"], 0, len(self.players) - 1)]

    def _drive(self, order: Mapping[str, Any]) -> None:
        player = self._player(order)
        name = order["name"]
        if any(other is not player and other.name == name for other in self.players):
            raise OptionError("controller", name, "another one than that beside it")
        player.drive(name)

    def _tune(self, order: Mapping[str, Any]) -> None:
        self._player(order).tune(order["gain"], order["value"])

    def _compare(self, order: Mapping[str, Any]) -> None:
        """Put a second controller beside the first, or take it away, and restart."""
        name, known = order["name"], registered_controllers()
        second = []
        if name is not None:
            check_choice("controller", name, sorted(known))
            if name == self.players[0].name:
                raise OptionError("controller", name, "another one than that beside it")
            second = [Player(self.cell, name, known[name], {})]
        self.players = [self.players[0], *second]
        self._reset()


_METHODS = {"push": "push", "drop": "drop_payload", "attach": "add_payload"}
"""Action of a person -> method of the environment that carries it out."""

ORDERS: dict[str, Callable[[Game, Mapping[str, Any]], None]] = {
    "push": Game._push,
    "pull": Game._drag,
    "drop": Game._drop,
    "attach": Game._attach,
    "payload": Game._lade,
    "condition": Game._condition,
    "pause": Game._pause,
    "speed": Game._pace,
    "reset": Game._restart_with_seed,
    "controller": Game._drive,
    "gain": Game._tune,
    "compare": Game._compare,
}
"""Name of an order -> what it does."""


def comes(payload: Mapping[str, Any] | None) -> bool:
    """Tell whether a sampled payload appears in its episode."""
    return bool(payload) and payload["detach_time"] > payload["attach_time"]


def _force(given: Any) -> tuple[float, ...]:
    allowed = "three finite numbers (N)"
    if not (isinstance(given, list) and len(given) == 3):
        raise OptionError("force", given, allowed)
    return tuple(check_number("force", part, -FORCE, FORCE, allowed) for part in given)
