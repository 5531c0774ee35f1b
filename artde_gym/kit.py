"""Everything that the project knows of a robot, as one frozen object that a plug-in brings.

A robot is three objects, one for each package, found by three groups of entry points under the robot's name:

    artde_gym.robots     `RobotKit`: its model, environments, disturbances, scenarios, and how it is shown
    artde_gym.drives     `controllers.drive.Drive`: which policies drive it, at which gains
    artde_gym.agents  `baselines.agent.Agent`: how a learned residual acts on it, and what it is trained on

Only the first one is needed; without the others, a robot has the joint-space laws without presets, and residuals on
joint accelerations.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from artde_gym.registry import Registry
from artde_gym.scenarios import Scenario

PAYLOAD = "payload"
"""The site at which a payload is pushed, of robots with the capability "cable"."""

Capability = Literal[
    "actuators", "armature", "cable", "contact", "effects", "encoders", "feet", "flight", "joints", "legs", "mass",
    "payload", "rotors", "sensors", "sites", "torque_limit",
]  # fmt: skip
"""Properties of a robot, and of its environments, that kinds of disturbances ask for.

"effects" are those of registered kinds: the environments apply `artde_gym.disturbances.effects.Effects`. "cable": a
payload may hang on one.
"""
Harder = Literal["larger", "smaller"]


class Environment(NamedTuple):
    """An environment as Gymnasium registers it; entry points are "module:class".

    `main` names the scenarios that `artde-gym evaluate` runs in it where none is asked for; `frontier` is its standard
    test of a frontier, None for the robot's.
    """

    env_id: str
    entry_point: str
    vector_entry_point: str | None = None
    main: tuple[str, ...] = ()
    frontier: FrontierTest | None = None


class Range(NamedTuple):
    """Ends and grid of a path where the user gives none, and which of its ends is the hard one."""

    low: float
    high: float
    tolerance: float
    harder: Harder = "larger"


@dataclasses.dataclass(frozen=True)
class FrontierTest:
    """The standard test of a robustness frontier.

    Attributes:
        scenario: whose disturbances it has.
        duration: s.
        when: (s) between which a varied push comes.
        repeated: varied entries of kinds that take a list, in place of the scenario's own of that kind.
        time_step: s, of which control periods are whole multiples.
        ranges: path -> range. Any other path needs low, high and tolerance.
    """

    scenario: str
    duration: float
    when: tuple[float, float]
    repeated: Mapping[str, list[dict[str, Any]]]
    time_step: float
    ranges: Mapping[str, Range]


class Motion(NamedTuple):
    """The undisturbed motion in words, when it has become periodic (s), and its period (s)."""

    name: str
    settled: float
    period: float


MOTION = Motion("motion", 0.0, 2.0)
"""Of a robot that says nothing about its own."""


class Push(NamedTuple):
    """The site at which live play pushes, and how hard (N) in the beginning."""

    site: str
    force: float


class Reported(NamedTuple):
    """What a publication reports of a scenario.

    Attributes:
        table: where.
        values: controller -> metric -> axis -> value.
        time_to_fall: controller -> s.
    """

    table: str
    values: Mapping[str, Mapping[str, Mapping[str, float]]]
    time_to_fall: Mapping[str, float] = MappingProxyType({})


def random_push(site: str, when: tuple[float, float]) -> dict[str, Any]:
    """Return a push to be varied in size: from any side with equal probability, at a random time (s) of a span."""
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
        title: how users call it: "biped".
        model: builds its nominal model, with `mass` (kg) and `sites` ((name, link, place) each); with
            `joint_inertia(q)`, reports judge m_bar.
        joints: names of its joints, or of its rotors, of which "all" is a shorthand.
        environments: that `import artde_gym` registers.
        capabilities: by which kinds of disturbances are honored.
        defaults: "kind.parameter" -> default in place of the kind's own.
        scenarios: by which it is evaluated.
        reproduced: names of the scenarios that `reproduce` runs, and of the controllers in them.
        reported: what a publication reports of its scenarios, by their name there (`Scenario.thesis`).
        frontier: its standard test, where an environment has none of its own; None if it has none.
        motion: that pictures in a report show.
        push: of live play; None to push at the first site with 10 N.
        report: module with `reference(kwargs)` and `figures(episode)`, see `artde_gym.report.robot`; None for the
            figures that all robots have.
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

    @property
    def sites(self) -> tuple[str, ...]:
        """Names of the places at which it can be pushed."""
        own = tuple(name for name, _, _ in self.model().sites)
        return (*own, PAYLOAD) if "cable" in self.capabilities else own


ROBOTS: Registry[RobotKit] = Registry("robot", "artde_gym.robots", lambda kit: {kit.name: kit})
"""All robots by name."""
