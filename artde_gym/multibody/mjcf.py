"""MJCF text from a `RobotSpec`: the robot on level ground, as MuJoCo simulates it.

Unlike URDF the format holds a whole world, so that ground, contacts and solver are written here too. Contacts are
listed pair by pair: a pair's friction is its own, and is not combined from those of its two shapes. MuJoCo softens a
contact: it pushes back as a critically damped spring of time constant `CONTACT_TIME` whose impedance rises from .9 to
.95 over the first millimeter of depth; an elliptic cone with `impratio` 10 lets friction slip ten times less than the
normal direction yields.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from artde_gym.multibody.spec import Box, Link, RobotSpec
from artde_gym.multibody.urdf import numbers

GROUND = "ground"
PAYLOAD = "payload"
"""A body without mass, fixed to the base, that an engine may give the payload's mass and place."""
CONTACT_TIME = 0.005  # s; about as stiff as Bullet's contacts, which correct a fifth of the depth each millisecond
IMPEDANCE = (0.9, 0.95, 0.001)
MEMORY = "1M"
"""Of contacts and constraints: thirty times what both feet on the ground use; by itself MuJoCo sets 14 MB aside."""

# as Bullet's renderer has it, so that pictures of both engines look the same
_SUN = {
    "directional": "true",
    "dir": "-1 -1.5 -3",
    "diffuse": ".39 .39 .39",
    "specular": "0 0 0",
    "castshadow": "false",
}


def mjcf(spec: RobotSpec) -> str:
    """The robot as MJCF, its base free; joint and body names are those of the links."""
    root = ET.Element("mujoco", model=spec.name)
    ET.SubElement(root, "compiler", angle="radian", inertiafromgeom="false", alignfree="false")
    # dense, as `auto` chooses at this size too: MuJoCo 4.0.0 factorises sparse Hessians wrongly (its issue 3767)
    solver = {"integrator": "implicitfast", "solver": "Newton", "jacobian": "dense", "cone": "elliptic"}
    option = ET.SubElement(root, "option", solver, impratio="10")
    # a state that diverges must not jump back to the start; one robot needs no search for independent islands
    ET.SubElement(option, "flag", autoreset="disable", island="disable")
    ET.SubElement(root, "size", memory=MEMORY)
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
        bodies[link.name] = _body(bodies[link.parent], link, armature.get(link.name, 0.0))
    ET.SubElement(bodies[spec.base.name], "body", name=PAYLOAD)
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


def _body(parent: ET.Element, link: Link, armature: float) -> ET.Element:
    body = ET.SubElement(parent, "body", name=link.name, pos=numbers(link.origin))
    if link.parent is None:
        ET.SubElement(body, "freejoint")
    elif link.axis is not None:
        ET.SubElement(body, "joint", name=link.name, axis=numbers(link.axis), armature=numbers([armature]))
    ET.SubElement(body, "inertial", pos=numbers(link.com), mass=numbers([link.mass]), diaginertia=numbers(link.inertia))
    for box in link.visuals:
        body.append(_shape(box, rgba=numbers(box.color)))
    for index, box in enumerate(link.collisions):
        body.append(_shape(box, name=_collision(link, index), group="3"))  # the renderer shows groups 0 to 2
    return body


def _shape(box: Box, **attributes: str) -> ET.Element:
    half = numbers(side / 2 for side in box.size)
    return ET.Element("geom", attributes, type="box", size=half, pos=numbers(box.center))


def _collision(link: Link, index: int) -> str:
    return f"{link.name}_{index}"
