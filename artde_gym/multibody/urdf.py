"""URDF text from a `RobotSpec`; numbers have 17 digits, so that no precision is lost."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from artde_gym.multibody.spec import Box, Link, RobotSpec, Rotation, Vector

LEVEL = 1e-9  # cosine of the pitch below which yaw and roll are one angle


def urdf(spec: RobotSpec) -> str:
    """Return the robot as URDF. The format has no gears; the engine adds them."""
    root = ET.Element("robot", name=spec.name)
    for link in spec.links:
        root.append(_link(link))
    for link in spec.links:
        if link.parent is not None:
            root.append(_joint(link, spec.torque_limit))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode")


def _link(link: Link) -> ET.Element:
    element = ET.Element("link", name=link.name)
    inertial = ET.SubElement(element, "inertial")
    ET.SubElement(inertial, "origin", xyz=numbers(link.com), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=numbers([link.mass]))
    ixx, iyy, izz, ixy, ixz, iyz = (numbers([value]) for value in (*link.inertia, *link.products))
    ET.SubElement(inertial, "inertia", ixx=ixx, iyy=iyy, izz=izz, ixy=ixy, ixz=ixz, iyz=iyz)
    for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)):
        for index, box in enumerate(shapes):
            element.append(_shape(tag, box, name=f"{link.name}_{index}"))
    return element


def _shape(tag: str, box: Box, name: str) -> ET.Element:
    element = ET.Element(tag)
    ET.SubElement(element, "origin", xyz=numbers(box.center), rpy="0 0 0")
    geometry = ET.SubElement(element, "geometry")
    ET.SubElement(geometry, "box", size=numbers(box.size))
    if tag == "visual":
        material = ET.SubElement(element, "material", name=name)
        ET.SubElement(material, "color", rgba=numbers(box.color))
    return element


def _joint(link: Link, effort: float) -> ET.Element:
    kind = "fixed" if link.axis is None else "prismatic" if link.prismatic else "continuous"
    element = ET.Element("joint", name=link.name, type=kind)
    ET.SubElement(element, "parent", link=str(link.parent))
    ET.SubElement(element, "child", link=link.name)
    ET.SubElement(element, "origin", xyz=numbers(link.origin), rpy=numbers(_roll_pitch_yaw(link.rotation)))
    if link.axis is not None:
        ET.SubElement(element, "axis", xyz=numbers(link.axis))
        wide = {"lower": "-1000", "upper": "1000"} if link.prismatic else {}  # limits belong to the task
        ET.SubElement(element, "limit", wide, effort=numbers([effort]), velocity="1000")
    return element


def _roll_pitch_yaw(rotation: Rotation | None) -> Vector:
    """Return angles (rad) of R = R_z(yaw) R_y(pitch) R_x(roll)."""
    if rotation is None:
        return 0.0, 0.0, 0.0
    (xx, xy, _), (yx, yy, _), (zx, zy, zz) = rotation
    level = math.hypot(xx, yx)
    pitch = math.atan2(-zx, level)
    if level < LEVEL:  # yaw and roll turn about the same axis
        return 0.0, pitch, math.atan2(-xy, yy)
    return math.atan2(zy, zz), pitch, math.atan2(yx, xx)


def numbers(values: Iterable[float]) -> str:
    """Return numbers as an XML attribute, with all their digits."""
    return " ".join(f"{value:.17g}" for value in values)
