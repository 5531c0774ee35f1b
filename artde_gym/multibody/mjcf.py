"""MJCF text from a `RobotSpec`: the robot on level ground for MuJoCo.

Unlike URDF the format describes a whole world, so that ground, contacts and solver are included. Contacts are listed as
pairs, each with its own friction, which is not combined from those of its two shapes. MuJoCo's contacts are soft:
critically damped springs of time constant `CONTACT_TIME` whose impedance rises from .9 to .95 over the first millimeter
of depth; with an elliptic cone and `impratio` 10, friction slips ten times less than the normal direction yields.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from artde_gym.multibody.spec import Box, Link, RobotSpec
from artde_gym.multibody.urdf import numbers

GROUND = "ground"
PAYLOAD = "payload"
"""A massless body fixed to the payload's link, to which an engine can assign the payload's mass and position."""
CONTACT_TIME = 0.005  # s; about as stiff as Bullet's contacts, which correct a fifth of the depth each millisecond
IMPEDANCE = (0.9, 0.95, 0.001)
ARENA_MEMORY = "1M"
"""Memory for contacts and constraints: thirty times the need of both feet on the ground; MuJoCo's default is 14 MB."""

# the light of Bullet's renderer, so that images of both engines look alike
_SUN = {
    "directional": "true",
    "dir": "-1 -1.5 -3",
    "diffuse": ".39 .39 .39",
    "specular": "0 0 0",
    "castshadow": "false",
}


def mjcf(spec: RobotSpec, *, visuals: bool = True) -> str:
    """Return the robot as MJCF with a free or fixed base; joints and bodies have the names of the links.

    Without `visuals`, of the shapes only those that collide: a step takes a tenth less time.
    """
    root = ET.Element("mujoco", model=spec.name)
    ET.SubElement(root, "compiler", angle="radian", inertiafromgeom="false", alignfree="false")
    # dense, as `auto` chooses at this size too: MuJoCo 4.0.0 factorizes sparse Hessians wrongly (its issue 3767)
    solver = {"integrator": "implicitfast", "solver": "Newton", "jacobian": "dense", "cone": "elliptic"}
    option = ET.SubElement(root, "option", solver, impratio="10")
    # no automatic reset of a diverging state; no search for independent islands, which one robot does not have
    ET.SubElement(option, "flag", autoreset="disable", island="disable")
    ET.SubElement(root, "size", memory=ARENA_MEMORY)
    default = ET.SubElement(root, "default")
    ET.SubElement(default, "geom", contype="0", conaffinity="0")
    soft = {"solref": numbers((CONTACT_TIME, 1.0)), "solimp": numbers(IMPEDANCE)}
    ET.SubElement(default, "pair", soft, condim="3")
    ET.SubElement(default, "equality", soft)
    _light(root)

    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "geom", name=GROUND, type="plane", size="0 0 1", group="3")  # painted, not rendered
    ET.SubElement(world, "light", _SUN)
    bodies: dict[str | None, ET.Element] = {None: world}
    armature = dict(zip(spec.actuated, spec.armature, strict=True))
    for link in spec.links:
        bodies[link.name] = _body(bodies[link.parent], link, armature.get(link.name, 0.0), fixed=spec.fixed)
        if visuals:
            bodies[link.name].extend(_shape(box, rgba=numbers(box.color)) for box in link.visuals)
    ET.SubElement(bodies[spec.payload_link], "body", name=PAYLOAD)
    for name, link, point in spec.sites:
        ET.SubElement(bodies[link], "site", name=name, pos=numbers(point), group="3")

    contact = ET.SubElement(root, "contact")
    for link in spec.links:
        for index in range(len(link.collisions)):
            ET.SubElement(contact, "pair", geom1=GROUND, geom2=_collision(link, index))
    if spec.feet_collide:
        left, right = (_collision(spec.by_name[foot], 0) for foot in spec.feet)
        ET.SubElement(contact, "pair", geom1=left, geom2=right)
    equality = ET.SubElement(root, "equality")
    for link in spec.joints:
        if link.name not in spec.actuated:
            ET.SubElement(equality, "joint", joint1=link.name)  # held at zero
    sensor = ET.SubElement(root, "sensor")
    for foot in spec.feet:  # the ground's force on each foot, in world axes
        ET.SubElement(sensor, "contact", geom1=GROUND, body2=foot, data="force", reduce="netforce")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode")


def _light(root: ET.Element) -> None:
    visual = ET.SubElement(root, "visual")
    ET.SubElement(visual, "global", fovy="40")
    ET.SubElement(visual, "headlight", ambient=".6 .6 .6", diffuse="0 0 0", specular="0 0 0")
    ET.SubElement(visual, "map", znear="0.02")


def _body(parent: ET.Element, link: Link, armature: float, *, fixed: bool) -> ET.Element:
    body = ET.SubElement(parent, "body", name=link.name, pos=numbers(link.origin))
    if link.rotation is not None:
        x, y, _ = zip(*link.rotation, strict=True)
        body.set("xyaxes", numbers((*x, *y)))
    if link.parent is None:
        if not fixed:
            ET.SubElement(body, "freejoint")
    elif link.axis is not None:
        sliding = {"type": "slide"} if link.prismatic else {}
        joint = {"name": link.name, "axis": numbers(link.axis), "armature": numbers([armature])}
        ET.SubElement(body, "joint", joint | sliding)
    if link.mass > 0:
        body.append(_inertial(link))
    for index, box in enumerate(link.collisions):
        body.append(_shape(box, name=_collision(link, index), group="3"))  # the renderer shows groups 0 to 2
    return body


def _inertial(link: Link) -> ET.Element:
    """Return mass and inertia, as principal moments where the tensor is diagonal."""
    inertia = {"diaginertia": numbers(link.inertia)}
    if any(link.products):
        inertia = {"fullinertia": numbers((*link.inertia, *link.products))}
    return ET.Element("inertial", {"pos": numbers(link.com), "mass": numbers([link.mass])} | inertia)


def _shape(box: Box, **attributes: str) -> ET.Element:
    half = numbers(side / 2 for side in box.size)
    return ET.Element("geom", attributes, type="box", size=half, pos=numbers(box.center))


def _collision(link: Link, index: int) -> str:
    return f"{link.name}_{index}"
