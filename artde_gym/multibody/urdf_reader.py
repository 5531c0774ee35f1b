"""URDF files of users as trees of links, read with the standard library alone.

Meshes, materials and extensions are ignored: they do not move. Every link, joint, parent, inertia, limit and axis is
checked. URDF itself has no reflected inertia of rotors; Drake's extension of transmissions is read, rotor_inertia times
the square of gear_ratio.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from artde_gym.errors import RobotError, suggest_names
from artde_gym.multibody.model_file import FileJoint, FileLink, ModelTree, check_links, check_name

KINDS = ("fixed", "revolute", "continuous", "prismatic")
DRAKE = "{http://drake.mit.edu}"
TENSOR = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def read_urdf(root: ET.Element, file: str) -> ModelTree:
    """Convert a `<robot>`.

    Raises:
        RobotError: for anything that is broken or not a tree of links on fixed, revolute, continuous and prismatic
            joints; it names file, element and what is allowed.
    """
    links, joints = _named(root, "link", file), _named(root, "joint", file)
    check_links(len(links), file)
    above, armature = _parents(links, joints, file), _armatures(root, file)
    order = _in_order(links, above, file)
    return ModelTree(file, tuple(_link(links[name], above.get(name), armature, file) for name in order))


def _armatures(root: ET.Element, file: str) -> dict[str, float]:
    """Return the reflected inertia of joints whose transmission has one (kg m^2 or kg)."""
    found: dict[str, float] = {}
    for transmission in root.iter("transmission"):
        joint, actuator = transmission.find("joint"), transmission.find("actuator")
        if joint is None or actuator is None:
            continue
        where = f"transmission of joint {joint.get('name')!r} in {file}"
        rotor, ratio = (actuator.find(f"{DRAKE}{name}") for name in ("rotor_inertia", "gear_ratio"))
        if rotor is not None:
            gears = 1.0 if ratio is None else _number(ratio, "value", None, where)
            found[str(joint.get("name"))] = _not_negative(rotor, "value", where) * gears**2
    return found


def _named(root: ET.Element, tag: str, file: str) -> dict[str, ET.Element]:
    found: dict[str, ET.Element] = {}
    for element in root.findall(tag):
        name = check_name(tag, element.get("name"), file)
        if name in found:
            raise RobotError(f"name of a {tag} in {file}", name, f"a name that no other {tag} has")
        found[name] = element
    return found


def _parents(
    links: Mapping[str, ET.Element], joints: Mapping[str, ET.Element], file: str
) -> dict[str, tuple[str, ET.Element]]:
    """Return child -> its parent and the joint between them."""
    above: dict[str, tuple[str, ET.Element]] = {}
    for name, joint in joints.items():
        parent, child = (_end(joint, tag, name, links, file) for tag in ("parent", "child"))
        if child in above:
            first = above[child][1].get("name")
            raise RobotError(f"joint of link {child!r} in {file}", name, f"{first!r} alone: one parent for each link")
        above[child] = parent, joint
    return above


def _end(joint: ET.Element, tag: str, name: str, links: Mapping[str, ET.Element], file: str) -> str:
    element = joint.find(tag)
    link = None if element is None else element.get("link")
    if link is None or link not in links:
        raise RobotError(f"{tag} of joint {name!r} in {file}", link, f"a link: {suggest_names(link, links)}")
    return link


def _in_order(links: Mapping[str, ET.Element], above: Mapping[str, tuple[str, ET.Element]], file: str) -> list[str]:
    """Return the links from the root on, parents before children."""
    roots = [name for name in links if name not in above]
    if len(roots) != 1:
        raise RobotError(f"links without a parent in {file}", ", ".join(roots), "one, the base")
    children: dict[str, list[str]] = {}
    for child, (parent, _) in above.items():
        children.setdefault(parent, []).append(child)
    order = roots
    for name in order:
        order += children.get(name, [])
    if len(order) != len(links):
        lost = ", ".join(sorted(links.keys() - set(order)))
        raise RobotError(f"links in a loop in {file}", lost, "a tree from the base on")
    return order


def _link(
    element: ET.Element, above: tuple[str, ET.Element] | None, armature: Mapping[str, float], file: str
) -> FileLink:
    name = str(element.get("name"))
    mass, com, inertia = _inertial(element.find("inertial"), f"inertial of link {name!r} in {file}")
    if above is None:
        return FileLink(name, None, np.zeros(3), np.eye(3), mass, com, inertia)
    parent, joint = above
    where = f"joint {joint.get('name')!r} in {file}"
    moved = _joint(joint, where)
    if moved is not None:
        moved = moved._replace(armature=armature.get(moved.name, 0.0))
    return FileLink(name, parent, *_frame(joint, where), mass, com, inertia, moved)


def _inertial(element: ET.Element | None, where: str) -> tuple[float, np.ndarray, np.ndarray]:
    if element is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    mass = _number(element.find("mass"), "value", None, f"mass in the {where}")
    if mass < 0:
        raise RobotError(f"mass in the {where}", mass, "at least 0 kg")
    com, rotation = _frame(element, where)
    of = element.find("inertia")
    x, y, z, xy, xz, yz = (_number(of, name, 0.0 if name[1] != name[2] else None, where) for name in TENSOR)
    return mass, com, rotation @ np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]]) @ rotation.T


def _joint(element: ET.Element, where: str) -> FileJoint | None:
    kind = element.get("type")
    if kind not in KINDS:
        raise RobotError(f"type of {where}", kind, f"{', '.join(KINDS)}; others have more than one degree of freedom")
    if kind == "fixed":
        return None
    axis = _vector(element.find("axis"), "xyz", (1.0, 0.0, 0.0), f"axis of {where}")
    with np.errstate(over="ignore"):
        length = float(np.linalg.norm(axis))
    if not 1e-6 < length < math.inf:
        raise RobotError(f"axis of {where}", axis.tolist(), "a direction, not zero, of a finite length")
    limit, friction = element.find("limit"), element.find("dynamics")
    damping, coulomb = (_not_negative(friction, key, where) for key in ("damping", "friction"))
    speed = _not_negative(limit, "velocity", where) or math.inf
    effort = math.inf if limit is None or limit.get("effort") is None else _not_negative(limit, "effort", where)
    mimic = element.find("mimic")
    return FileJoint(
        check_name("joint", element.get("name"), where),
        axis / length,
        kind == "prismatic",
        (-math.inf, math.inf) if kind == "continuous" else _limits(limit, where),
        effort,
        speed,
        damping,
        coulomb,
        follows="" if mimic is None else f"it mimics {mimic.get('joint')!r}",
    )


def _limits(element: ET.Element | None, where: str) -> tuple[float, float]:
    if element is None:
        raise RobotError(f"limit of {where}", None, "a <limit>, or the type 'continuous'")
    low, high = (_number(element, key, 0.0, f"limit of {where}") for key in ("lower", "upper"))
    if low > high:
        raise RobotError(f"limit of {where}", (low, high), "lower <= upper")
    return low, high


def _frame(element: ET.Element, where: str) -> tuple[np.ndarray, np.ndarray]:
    """Return origin and rotation of an element with an `<origin>`."""
    origin = element.find("origin")
    nothing = (0.0, 0.0, 0.0)
    place = _vector(origin, "xyz", nothing, f"origin of the {where}")
    roll, pitch, yaw = _vector(origin, "rpy", nothing, f"origin of the {where}").tolist()
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch, yaw))
    rotation = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return place, np.array(rotation)


def _vector(element: ET.Element | None, key: str, default: tuple[float, ...], where: str) -> np.ndarray:
    text = None if element is None else element.get(key)
    if text is None:
        return np.array(default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != len(default) or not np.isfinite(values).all():
        raise RobotError(f"{key} in the {where}", text, f"{len(default)} finite numbers")
    return values


def _number(element: ET.Element | None, key: str, default: float | None, where: str) -> float:
    text = None if element is None else element.get(key)
    if text is None and default is not None:
        return default
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RobotError(f"{key} of the {where}", text, "a finite number")
    return value


def _not_negative(element: ET.Element | None, key: str, where: str) -> float:
    value = _number(element, key, 0.0, where)
    if value < 0:
        raise RobotError(f"{key} of {where}", value, "a number >= 0")
    return value
