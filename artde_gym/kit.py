"""Robot plug-ins: everything the project knows about a robot, in one frozen object.

A robot is up to three objects, one per package, found by entry points with the robot's name in three groups:

    artde_gym.robots  `RobotKit`: model, environments, disturbances, scenarios and presentation
    artde_gym.drives  `controllers.drive.Drive`: its policies and their gains
    artde_gym.agents  `baselines.agent.Agent`: how a learned residual acts on it and its training tasks

Only the first is required; without the others, a robot has the joint-space laws without presets, and residuals on
joint accelerations.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.registry import Registry
from artde_gym.scenarios import Scenario

PAYLOAD = "payload"
"""The site at which a payload is pushed, of robots with the capability "cable"."""

Capability = Literal[
    "actuators", "armature", "cable", "contact", "effects", "encoders", "feet", "flight", "friction", "joints", "legs",
    "mass", "payload", "rotors", "sensors", "sites", "torque_limit",
]  # fmt: skip
"""Properties of a robot and its environments that kinds of disturbances require.

"effects": the environments apply registered kinds through `artde_gym.disturbances.effects.Effects`. "cable": a payload
may hang on one. "friction": joints have friction.
"""
Harder = Literal["larger", "smaller"]


class Environment(NamedTuple):
    """An environment to be registered with Gymnasium; entry points are "module:class".

    `main` names the scenarios that `artde-gym evaluate` runs in it by default; `frontier` is its standard test of a
    frontier, None for the robot's.
    """

    env_id: str
    entry_point: str
    vector_entry_point: str | None = None
    main: tuple[str, ...] = ()
    frontier: FrontierTest | None = None


class Range(NamedTuple):
    """Default bounds and tolerance of a path, and which of its ends is harder.

    `duration` (s) replaces the robot's usual duration of the test.
    """

    low: float
    high: float
    tolerance: float
    harder: Harder = "larger"
    duration: float | None = None


@dataclasses.dataclass(frozen=True)
class FrontierTest:
    """The standard test of a robustness frontier.

    Attributes:
        scenario: name of the scenario that supplies the other disturbances.
        duration: duration of an episode (s).
        when: earliest and latest time of a varied push (s).
        repeated: varied entries by kind; they replace the scenario's of that kind where the path has a default range
            or the scenario has none.
        time_step: physics time step (s); control periods are whole multiples of it.
        ranges: path -> range; for any other path the user must give low, high and tolerance.
    """

    scenario: str
    duration: float
    when: tuple[float, float]
    repeated: Mapping[str, Any]
    time_step: float
    ranges: Mapping[str, Range]


class Motion(NamedTuple):
    """Name of the undisturbed motion, the time from which it is periodic (s), and its period (s)."""

    name: str
    settled: float
    period: float


MOTION = Motion("motion", 0.0, 2.0)
"""Default for a robot that defines no motion."""


class Push(NamedTuple):
    """Site and initial force (N) of pushes in live play."""

    site: str
    force: float


class Reported(NamedTuple):
    """Published results of a scenario.

    Attributes:
        table: table of the publication.
        values: controller -> metric -> axis -> value.
        time_to_fall: controller -> time to fall (s).
    """

    table: str
    values: Mapping[str, Mapping[str, Mapping[str, float]]]
    time_to_fall: Mapping[str, float] = MappingProxyType({})


def random_push(site: str, when: tuple[float, float]) -> dict[str, Any]:
    """Return a push of variable size: from a uniformly random side, at a uniformly random time in a span (s)."""
    return {
        "body": site,
        "magnitude": 0.0,
        "direction": [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0],
        "start": {"uniform": list(when)},
        "duration": 0.2,
    }


@dataclasses.dataclass(frozen=True)
class RobotKit:
    """One robot.

    Attributes:
        name: the `robot_name` of its environments.
        title: the word for it in texts, such as "biped".
        model: function that builds its nominal model, with `mass` (kg) and `sites` ((name, link, place) each); if the
            model has `joint_inertia(q)`, reports check m_bar against it.
        joints: names of its joints or rotors; "all" is a shorthand for them.
        environments: environments that `import artde_gym` registers.
        capabilities: properties that decide which kinds of disturbances it supports.
        defaults: "kind.parameter" -> default that overrides the kind's.
        scenarios: scenarios of its evaluation.
        reproduced: names of the scenarios that `reproduce` runs, and of the controllers in them.
        reported: published results of its scenarios, by their published name (`Scenario.thesis`).
        frontier: its standard test, where an environment has none of its own; None if it has none.
        motion: motion shown by pictures in a report.
        push: pushes of live play; None: 10 N at the first site.
        report: module with `reference(kwargs)` and `figures(episode)`, see `artde_gym.report.robot`; None: only the
            figures that all robots have.
        scene: "module:function" that is called with an environment's arguments and id and returns the
            `artde_gym.motion.scene.Scene` that replays show; None to make one of a model that is a `RobotSpec`.
        multiverse: file of its standard design of plausible worlds; None if it has none.
    """

    name: str
    title: str
    model: Callable[[], Any]
    joints: tuple[str, ...]
    environments: tuple[Environment, ...]
    capabilities: frozenset[Capability] = frozenset()
    defaults: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    scenarios: tuple[Scenario, ...] = ()
    reproduced: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    reported: Mapping[str, Reported] = dataclasses.field(default_factory=dict)
    frontier: FrontierTest | None = None
    motion: Motion = MOTION
    push: Push | None = None
    report: str | None = None
    scene: str | None = None
    multiverse: Path | None = None

    @property
    def sites(self) -> tuple[str, ...]:
        """Names of the sites that can be pushed."""
        own = tuple(name for name, _, _ in self.model().sites)
        return (*own, PAYLOAD) if "cable" in self.capabilities else own


ROBOTS: Registry[RobotKit] = Registry("robot", "artde_gym.robots", lambda kit: {kit.name: kit}, reserved=("all",))
"""All robots by name."""


def find_robot(name: object, among: Collection[str]) -> RobotKit:
    """Return the robot of this name; a title will do, too, where it is the title of one robot alone.

    Raises:
        UnknownNameError: if none of the robots `among` which it is sought has it, or several have the title.
    """
    known = {robot: ROBOTS[robot] for robot in among if robot in ROBOTS}
    if isinstance(name, str) and name in known:
        return known[name]
    titled = [robot for robot, kit in known.items() if kit.title == name]
    if len(titled) > 1:
        raise UnknownNameError("robot", name, f"choose {' or '.join(map(repr, titled))}", "is the title of several")
    if titled:
        return known[titled[0]]
    raise UnknownNameError("robot", name, suggest_names(name, known))
