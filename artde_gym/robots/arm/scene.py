"""An arm as replays show it: its boxes, and the path that its tool is meant to take.

A scene's bodies have the orientation of their parents at zero. If an arm's do not, a body without a shape comes
between them, turned by a constant angle, which `frame_angles` adds to the joints of a pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from artde_gym.arrays import Array
from artde_gym.motion.scene import Body, Outlook, Point, Scene
from artde_gym.multibody.spec import Link, RobotSpec, Vector
from artde_gym.robots.arm.drawing import BLUE
from artde_gym.robots.arm.reference import PICK
from artde_gym.robots.arm.task import Tracking

PERIOD, DURATION = 0.02, 12.0  # s, of the path


def scene(kwargs: Mapping[str, Any], env_id: str | None = None) -> Scene:
    """Return the scene of an arm with these arguments of the environment, whatever its id."""
    del env_id
    task = Tracking.of(
        kwargs.get("robot", "panda"),
        kwargs.get("tip"),
        kwargs.get("armature"),
        kwargs.get("joints"),
        kwargs.get("reference", PICK),
        PERIOD,
        kwargs.get("duration", DURATION),
    )
    spec = task.nominal_robot
    bodies, number = _bodies(spec)
    sites = {name: Point(number[link], place) for name, link, place in spec.sites}
    outlook = Outlook(distance=2.4, yaw_deg=55.0, pitch_deg=12.0, height=0.45, follows=False)
    return Scene(bodies, sites, outlook=outlook, tint=BLUE, path=task.tool, payload_radius=0.06)


def frame_angles(spec: RobotSpec) -> Array:
    """Return the constant angles (rad) of the frames between bodies, in the order of their joints in the scene."""
    return np.array([_turn(link)[1] for link in spec.links if link.rotation is not None])


def _bodies(spec: RobotSpec) -> tuple[tuple[Body, ...], dict[str, int]]:
    """Return the bodies, and the number of each link's."""
    bodies: list[Body] = []
    number: dict[str, int] = {}
    constant = len(spec.actuated)
    for link in spec.links:
        parent = None if link.parent is None else number[link.parent]
        origin = link.origin
        if link.rotation is not None:
            bodies.append(Body(f"{link.name} frame", (), parent, origin, _turn(link)[0], constant))
            parent, origin, constant = len(bodies) - 1, (0.0, 0.0, 0.0), constant + 1
        joint = spec.actuated.index(link.name) if link.name in spec.actuated else None
        number[link.name] = len(bodies)
        bodies.append(Body(link.name, link.visuals, parent, origin, link.axis, joint, slides=link.prismatic))
    return tuple(bodies), number


def _turn(link: Link) -> tuple[Vector, float]:
    """Return axis and angle of a link's rotation."""
    turn = Rotation.from_matrix(np.array(link.rotation)).as_rotvec()
    angle = float(np.linalg.norm(turn))
    x, y, z = (turn / angle).tolist() if angle > 0 else (0.0, 0.0, 1.0)
    return (x, y, z), angle
