"""A person in the loop: an episode at the pace of the clock, in which keys push the robot and drop its payload."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from artde_gym.evaluation.rollout import Policy
from artde_gym.info import fall_reason
from artde_gym.kit import ROBOTS, Push
from artde_gym.multibody.spec import Vector
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import State

RATE = 30.0  # looks at the keys in a second
FORCE = 10.0  # N, of a push in the beginning where the robot does not say
DURATION = 0.2  # s, of a push
HARDER = 1.25  # by a key
SLOWER = 2.0  # by a key
SPEEDS = (1 / 64, 4.0)  # slowest and fastest, simulated over real time
VIEW = 0.03  # m, that the robot moves before the view goes with it
ARROW = 0.35  # m, of a push in the window

DIRECTIONS: dict[str, Vector] = {
    "up": (1.0, 0.0, 0.0),
    "down": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
}
"""Key -> where it pushes: ahead, back, to the robot's left, to its right."""
HELP = (
    "arrows or click: push   + -: harder, softer   d: drop payload",
    ", .: slower, faster   space: pause   r: reset   q: quit",
)


class Viewer(Protocol):
    """What a session needs of a window; see `artde_gym.sim.window`."""

    @property
    def open(self) -> bool: ...
    def pressed(self) -> list[str]: ...
    def clicked(self, points: list[Vector]) -> int | None: ...
    def ahead(self) -> Vector: ...
    def show(self, state: State, payload: Vector | None) -> None: ...
    def look(self, camera: Camera) -> None: ...
    def follow(self, target: Vector) -> None: ...
    def write(self, lines: list[str], place: Vector) -> None: ...
    def arrow(self, tail: Vector, tip: Vector) -> None: ...


class Session:
    """An environment, a policy and a window.

    Args:
        env: of this project.
        policy: that drives it.
        window: which is looked at for keys and clicks.
        name: of the policy, to be shown.
        seed: of the first episode; each reset takes the next one.

    Attributes:
        time_s: simulated, of this episode.
        fallen: why the robot fell, or "".
        over: whether the episode has ended.
        speed: simulated over real time.
        paused: whether time stands still.
        force: of a push (N).
    """

    def __init__(self, env: Any, policy: Policy, window: Viewer, name: str, seed: int = 0) -> None:
        self._env, self._plant, self._policy, self._window, self._name = env, env.unwrapped, policy, window, name
        self._seed = seed
        self._sites: list[str] = [site for site, _, _ in self._plant.nominal_robot.sites]
        self.site, self.force = ROBOTS[self._plant.robot_name].push or Push(self._sites[0], FORCE)
        self.speed, self.paused, self.leaving = 1.0, False, False
        self._actions: dict[str, Callable[[], object]] = {
            "d": self._plant.drop_payload,
            "r": self._next,
            "q": self._leave,
            "escape": self._leave,
            "space": self._pause,
            ",": lambda: self._pace(1 / SLOWER),
            ".": lambda: self._pace(SLOWER),
            "+": lambda: self._strengthen(HARDER),
            "=": lambda: self._strengthen(HARDER),
            "-": lambda: self._strengthen(1 / HARDER),
        }
        self._seen, self._status = (math.inf, 0.0, 0.0), ""
        self._window.look(self._plant.view.camera)
        self._reset()

    def run(self, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep) -> None:
        """Go on until the person leaves; where simulation is slower than the clock, it takes its time."""
        due = clock()
        while self.turn():
            due += 1.0 / RATE
            wait = due - clock()
            if wait > 0:
                sleep(wait)
            else:
                due = clock()

    def turn(self) -> bool:
        """What a person did, then a share 1 / `RATE` of a second; False when it is time to leave."""
        if not self._window.open:
            return False
        for key in self._window.pressed():
            self.press(key)
        clicked = self._window.clicked([self._plant.engine.site(site) for site in self._sites])
        if clicked is not None:
            self._push(self._sites[clicked], self._window.ahead())
        if not self.paused:
            self._advance(self.speed / RATE)
        self._show()
        return not self.leaving

    def press(self, key: str) -> None:
        """Do what a key stands for; nothing for any other."""
        if key in DIRECTIONS:
            self._push(self.site, DIRECTIONS[key])
        elif key in self._actions:
            self._actions[key]()

    def status(self) -> str:
        """How things are, in words."""
        words = [self._name, f"t = {self.time_s:.0f} s", f"push {self.force:.3g} N"]
        if self.speed != 1:
            words.append(f"{self.speed:g} x speed")
        if self.paused:
            words.append("paused")
        if self.over:
            words.append(f"fell ({self.fallen}): r" if self.fallen else "the end: r")
        return "   ".join(words)

    def _reset(self) -> None:
        self._observation, _ = self._env.reset(seed=self._seed)
        self._state, self._first = None, True
        self.time_s, self.over, self.fallen = 0.0, False, ""
        self._wanted = 0.0

    def _advance(self, duration: float) -> None:
        """Simulate so many seconds more, rounded to control periods in the long run."""
        self._wanted += duration
        while self.time_s < self._wanted - 1e-9 and not self.over:
            action, self._state = self._policy.predict(
                self._observation, state=self._state, episode_start=self._first, deterministic=True
            )
            self._observation, _, terminated, truncated, info = self._env.step(action)
            self._first, self.time_s, self.over = False, info["time_s"], terminated or truncated
            self.fallen = fall_reason(info)

    def _show(self) -> None:
        """Each look at the window waits for it: words and the view change less often than the robot moves."""
        engine = self._plant.engine
        self._window.show(engine.state(), engine.payload_position())
        place = engine.site(self._sites[0])
        if math.dist(place, self._seen) > VIEW:
            self._window.follow(place)
        status = self.status()
        if math.dist(place, self._seen) > VIEW or status != self._status:
            self._window.write([status, *HELP], place)
            self._seen, self._status = place, status

    def _push(self, site: str, direction: Vector) -> None:
        if self.over:
            return
        x, y, z = (self.force * part for part in direction)
        self._plant.push(site, (x, y, z), DURATION)
        tip = np.asarray(self._plant.engine.site(site))
        tail = tip - ARROW * np.asarray(direction)
        self._window.arrow(tuple(tail.tolist()), tuple(tip.tolist()))

    def _next(self) -> None:
        self._seed += 1
        self._reset()

    def _leave(self) -> None:
        self.leaving = True

    def _pause(self) -> None:
        self.paused = not self.paused

    def _pace(self, factor: float) -> None:
        slowest, fastest = SPEEDS
        self.speed = min(fastest, max(slowest, self.speed * factor))

    def _strengthen(self, factor: float) -> None:
        self.force *= factor
