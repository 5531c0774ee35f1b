"""Effects of registered kinds of disturbances on n robots; a single environment has n = 1."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.kinds import DISTURBANCES
from artde_gym.disturbances.loads import Load, RobotStates
from artde_gym.disturbances.numeric import Words, number_of
from artde_gym.errors import DisturbanceError
from artde_gym.sim.engine import State, World

Numbers = Mapping[str, Any]

_NOTHING = (0.0, 0.0, 0.0)
_NO_LOAD = Load()


class _Group(NamedTuple):
    """Robots on which one kind acts, and its values with one row per robot."""

    kind: str
    robots: NDArray[np.intp]
    values: Mapping[str, Array]


class Effects:
    """The effects on n robots; `begin` starts an episode of one of them.

    Args:
        n: number of robots.
        words: names of the robot's sites and joints.

    Attributes:
        acting: mask (n,) of the robots on which any effect acts.
    """

    def __init__(self, n: int, words: Words) -> None:
        self._words = words
        self._sampled: list[list[tuple[str, int, Numbers]]] = [[] for _ in range(n)]
        self._groups: list[_Group] | None = []
        self.acting = np.zeros(n, np.bool_)

    def begin(self, robot: int, sampled: Mapping[str, Any]) -> None:
        """Start an episode of a robot with sampled disturbances."""
        entries = [
            (name, number, self._numbers(name, entry))
            for name, value in sampled.items()
            for number, entry in enumerate(value if DISTURBANCES[name].multiple else (value,))
            if DISTURBANCES[name].acts(entry)
        ]
        if entries or self._sampled[robot]:
            self._sampled[robot], self._groups = entries, None
            self.acting[robot] = bool(entries)

    def load(self, states: RobotStates) -> Load:
        """Compute the loads on all robots in the next physics step; None for parts that no effect returns.

        Raises:
            DisturbanceError: if an effect returns anything but a `Load`, or an array of the wrong shape.
        """
        if self._groups is None:
            self._groups = self._grouped()
        total: dict[str, Array] = {}
        shapes = {"tau": states.q.shape, "force": states.position.shape, "torque": states.position.shape}
        for group in self._groups:
            some = RobotStates(*(part[group.robots] for part in states))
            for name, part in _load_of(group, some)._asdict().items():
                if part is not None:
                    _check_shape(group, name, part, shapes[name][1:])
                    total.setdefault(name, np.zeros(shapes[name]))[group.robots] += part
        return Load(**total)

    def apply(self, world: World, state: State, time: float) -> Array | float:
        """Apply loads to the base of the only robot for a physics step; return torques (joints,) (Nm) to add, or 0."""
        load = self.load_of(state, time)
        load_base(world, load, 0)
        return 0.0 if load.tau is None else load.tau[0]

    def load_of(self, state: State, time: float) -> Load:
        """Compute the loads on the only robot in a state at a time (s) of its episode."""
        if not self.acting[0]:
            return _NO_LOAD
        return self.load(RobotStates(*(np.array([part]) for part in (time, *state))))

    def _numbers(self, kind: str, entry: Mapping[str, Any]) -> Numbers:
        parameters = [parameter for parameter in DISTURBANCES[kind].parameters if parameter.name in entry]
        return {p.name: number_of(p, entry[p.name], self._words) for p in parameters}

    def _grouped(self) -> list[_Group]:
        """Group the entries that one call can compute: those with the same kind, index and parameters."""
        groups: dict[Any, tuple[list[int], list[Numbers]]] = {}
        for robot, entries in enumerate(self._sampled):
            for kind, number, values in entries:
                robots, rows = groups.setdefault((kind, number, tuple(values)), ([], []))
                robots.append(robot)
                rows.append(values)
        return [
            _Group(kind, np.array(robots), {name: np.array([row[name] for row in rows]) for name in names})
            for (kind, _, names), (robots, rows) in sorted(groups.items(), key=lambda item: item[0])
        ]


def _load_of(group: _Group, some: RobotStates) -> Load:
    effect: Any = DISTURBANCES[group.kind].effect
    load = effect(group.values, some)
    if not isinstance(load, Load):
        raise DisturbanceError(f"effect of {group.kind!r}", load, "a Load")
    return load


def load_base(world: World, load: Load, robot: int) -> None:
    """Apply a load to the base of one of n robots for the next physics step."""
    if load.force is not None or load.torque is not None:
        parts = (_NOTHING if part is None else part[robot].tolist() for part in (load.force, load.torque))
        (fx, fy, fz), (x, y, z) = parts
        world.apply_world_wrench((fx, fy, fz), (x, y, z))


def _check_shape(group: _Group, name: str, part: Any, size: tuple[int, ...]) -> None:
    needed = (len(group.robots), *size)
    if np.shape(part) != needed:
        raise DisturbanceError(f"{name} of the effect of {group.kind!r}", np.shape(part), f"an array {needed}")
