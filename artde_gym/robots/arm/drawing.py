"""Boxes for arms without shapes: one from each joint to the next, and one at the tool."""

from __future__ import annotations

import dataclasses

import numpy as np

from artde_gym.multibody.manipulator import TOOL
from artde_gym.multibody.spec import Box, Color, RobotSpec, Vector

THICKNESS = 0.07  # m, of a box
LIGHT: Color = (0.85, 0.86, 0.88, 1.0)
DARK: Color = (0.20, 0.22, 0.26, 1.0)
BLUE: Color = (0.16, 0.36, 0.60, 1.0)


def drawn(spec: RobotSpec) -> RobotSpec:
    """Return the arm with boxes."""
    ends: dict[str, list[Vector]] = {link.name: [] for link in spec.links}
    for link in spec.links[1:]:
        ends[str(link.parent)].append(link.origin)
    for site, name, point in spec.sites:
        if site == TOOL:
            ends[name].append(point)
    links = (
        dataclasses.replace(link, visuals=tuple(_box(end, _color(spec, link.name)) for end in ends[link.name]))
        for link in spec.links
    )
    return dataclasses.replace(spec, links=tuple(links))


def _color(spec: RobotSpec, name: str) -> Color:
    if name == spec.base.name:
        return DARK
    return BLUE if name == spec.payload_link else LIGHT


def _box(end: Vector, color: Color) -> Box:
    """Return a box around the line from a link's origin to a point of it."""
    x, y, z = (np.abs(end) + THICKNESS).tolist()
    a, b, c = (np.asarray(end) / 2).tolist()
    return Box((x, y, z), (a, b, c), color)
