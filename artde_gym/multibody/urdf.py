"""URDF text from a `RobotSpec`; numbers are written with 17 digits, so that nothing is lost on the way."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

from artde_gym.multibody.spec import Box, Link, RobotSpec


def urdf(spec: RobotSpec) -> str:
    """The robot as URDF. Gears have no place in the format: the engine couples them itself."""
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
    ixx, iyy, izz = (numbers([value]) for value in link.inertia)
    ET.SubElement(inertial, "inertia", ixx=ixx, iyy=iyy, izz=izz, ixy="0", ixz="0", iyz="0")
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
    kind = "fixed" if link.axis is None else "continuous"  # limits belong to the task, not to the solver
    element = ET.Element("joint", name=link.name, type=kind)
    ET.SubElement(element, "parent", link=str(link.parent))
    ET.SubElement(element, "child", link=link.name)
    ET.SubElement(element, "origin", xyz=numbers(link.origin), rpy="0 0 0")
    if link.axis is not None:
        ET.SubElement(element, "axis", xyz=numbers(link.axis))
        ET.SubElement(element, "limit", effort=numbers([effort]), velocity="1000")
    return element


def numbers(values: Iterable[float]) -> str:
    """Numbers as an XML attribute, with all their digits."""
    return " ".join(f"{value:.17g}" for value in values)
