"""One description of what is drawn of a robot, for whatever draws it: bodies made of boxes, and what is around them."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from artde_gym.arrays import Array
from artde_gym.errors import RobotError
from artde_gym.kit import ROBOTS
from artde_gym.multibody.spec import Box, Color, RobotSpec, Vector

POINTS = 300  # at most, of a path


class Body(NamedTuple):
    """A rigid body on a joint.

    Attributes:
        parent: number of the body that carries it, which comes before it; None for the base.
        origin: of the joint in the parent's frame (m).
        axis: of the joint in the body's own frame; None for one that is fixed.
        joint: its place among the joints of a pose; None for one that stays at zero.
        slides: whether it slides along its axis instead of turning about it.
    """

    name: str
    boxes: tuple[Box, ...]
    parent: int | None = None
    origin: Vector = (0.0, 0.0, 0.0)
    axis: Vector | None = None
    joint: int | None = None
    slides: bool = False


class Point(NamedTuple):
    """A place on a body, in its frame (m)."""

    body: int
    place: Vector


class Outlook(NamedTuple):
    """The view that a scene is first seen in.

    Attributes:
        distance, yaw_deg, pitch_deg: as those of `artde_gym.sim.camera.Camera`.
        height: of what is looked at (m).
        reach: around it, within which shadows fall (m).
        follows: whether the eye goes along with the robot.
    """

    distance: float = 2.0
    yaw_deg: float = 55.0
    pitch_deg: float = 12.0
    height: float = 0.4
    reach: float = 1.3
    follows: bool = True


OUTLOOK = Outlook()


@dataclasses.dataclass(frozen=True)
class Scene:
    """A robot and what is around it.

    Attributes:
        bodies: parents before children; the first one is the base.
        sites: at which it is pushed.
        contacts: at which the loads of a pose act, upward.
        outlook: from where it is seen.
        tint: color of boxes that take the controller's color instead; None to leave all as they are.
        path: where the robot is meant to be (points, 3) (m).
        footholds: places of its soles on the ground, (x, y) of the middle (m).
        sole: length and width of a foothold (m).
        payload_radius: as it is drawn (m).
    """

    bodies: tuple[Body, ...]
    sites: Mapping[str, Point] = dataclasses.field(default_factory=dict)
    contacts: tuple[Point, ...] = ()
    outlook: Outlook = OUTLOOK
    tint: Color | None = None
    path: Array | None = None
    footholds: tuple[tuple[float, float], ...] = ()
    sole: tuple[float, float] = (0.2, 0.1)
    payload_radius: float = 0.09

    @classmethod
    def of(cls, spec: RobotSpec, **more: Any) -> Scene:
        """Describe a robot of links; `more` are further attributes."""
        number = {link.name: i for i, link in enumerate(spec.links)}
        joint = {name: i for i, name in enumerate(spec.actuated)}
        bodies = tuple(
            Body(
                link.name,
                link.visuals,
                None if link.parent is None else number[link.parent],
                link.origin,
                link.axis,
                joint.get(link.name),
            )
            for link in spec.links
        )
        sites = {name: Point(number[link], place) for name, link, place in spec.sites}
        contacts = tuple(Point(number[foot], spec.sole(foot)) for foot in spec.feet)
        return cls(bodies, sites, contacts, **more)

    def text(self) -> dict[str, Any]:
        """Return what a page holds."""
        bodies = [
            {**body._asdict(), "boxes": [[*_short((*box.size, *box.center)), _hex(box.color)] for box in body.boxes]}
            for body in self.bodies
        ]
        path = None if self.path is None else _short(self.path[:: -(-len(self.path) // POINTS)].ravel())
        return {
            "bodies": bodies,
            "sites": {name: [point.body, *point.place] for name, point in self.sites.items()},
            "contacts": [[point.body, *point.place] for point in self.contacts],
            "outlook": self.outlook._asdict(),
            "tint": None if self.tint is None else _hex(self.tint),
            "path": path,
            "footholds": [_short(place) for place in self.footholds],
            "sole": list(self.sole),
            "payload": self.payload_radius,
        }


def scene_of(robot: str, kwargs: Mapping[str, Any], env_id: str | None = None) -> Scene:
    """Return the scene of a robot in an environment with these arguments; None for any environment of the robot.

    Raises:
        RobotError: if the robot's kit names none, and its model is no `RobotSpec`.
    """
    kit = ROBOTS[robot]
    if kit.scene is not None:
        module, function = kit.scene.split(":")
        return getattr(importlib.import_module(module), function)(kwargs, env_id)
    model = kit.model()
    if not isinstance(model, RobotSpec):
        allowed = '"module:function" in its `RobotKit`, or a RobotSpec as model'
        raise RobotError(f"scene of {robot!r}", kit.scene, allowed)
    return Scene.of(model)


def _short(values: Any) -> list[float]:
    return [round(float(value), 4) for value in np.asarray(values)]


def _hex(color: Color) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in color[:3])
