"""A manipulator as a `RobotSpec`, of a tree of links from a file.

The joints from the base to the tip, or some of them, are actuated and name the links that they carry; all others
(grippers, mimic joints) are locked at zero, or where their limits are closest to it. Every link of the file is a site
at its frame's origin, the tip's is "tool", which also carries the payload.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Iterator, Sequence

import numpy as np

from artde_gym.errors import RobotError, suggest_names
from artde_gym.multibody.model_file import FileJoint, FileLink, ModelTree
from artde_gym.multibody.spec import Link, RobotSpec, Rotation, Vector

BASE, TOOL = "base", "tool"
RESERVED = (BASE, "all", "ground", "payload", "world")
"""Names that joints cannot have, since engines or the grammar of disturbances use them."""
SHOWN = 12
"""Ends of chains that an error lists."""
GEAR_RATIO = 100.0
"""Of rotors in engines without armature: the larger, the less the carrying link's own rotation spins them."""
RESOLVED = (1e-14, 1e9)
"""Masses and moments (kg, kg m^2) of bodies that engines can move: MuJoCo takes none below 1e-15."""


def manipulator(
    tree: ModelTree,
    *,
    tip: str | None = None,
    armature: float | Sequence[float] | None = None,
    joints: Sequence[str] | None = None,
) -> RobotSpec:
    """Return the arm from the base to a tip.

    Args:
        tree: links of a file.
        tip: link at the end; None: where the chain of joints ends or branches into a gripper, with the fixed links
            beyond.
        armature: reflected inertia of each joint's rotor (kg m^2, or kg of a prismatic joint), one for all or one for
            each; None for the file's.
        joints: names of those that move, on one way from the base; None for all up to the tip. Without a tip it is
            then the last link that is fixed to the last of them.

    Raises:
        RobotError: for a tree without joints on the way, an unknown tip or joint, or a link or joint that cannot be
            simulated.
    """
    links = {link.name: link for link in tree.links}
    if tip is not None and tip not in links:
        raise RobotError("tip", tip, suggest_names(tip, links))
    chosen = None if joints is None else _chosen(tree, joints)
    end = tip if tip is not None else _tip(tree) if chosen is None else _fixed_beyond(tree, chosen[-1].name)
    chain = [link for link in _way(links, end) if link.joint is not None and not link.joint.follows]
    if chosen is not None:
        way = _joint_names(chain)
        if lost := [name for name in _joint_names(chosen) if name not in way]:
            raise RobotError("joints", lost, f"on the way from the base to {end!r}: {', '.join(way)}")
        chain = chosen
    if not chain:
        allowed = f"at least one; name another `tip`, such as the ends {_ends(tree)}"
        raise RobotError(f"joints from the base to {end!r} in {tree.file}", 0, allowed)
    names = _names(tree, chain)
    moved = _moved(tree, chain)
    parts = tuple(_part(link if link.name in moved else _massless(link), names, tree.file) for link in tree.links)
    sites: dict[str, tuple[str, Vector]] = {TOOL: (names[end], (0.0, 0.0, 0.0))}
    sites |= {link.name: (names[link.name], (0.0, 0.0, 0.0)) for link in tree.links[1:] if link.name != TOOL}
    given = tuple(link.joint.armature for link in chain if link.joint is not None)
    whole = RobotSpec(
        name="arm",
        links=parts,
        actuated=tuple(names[link.name] for link in chain),
        torque_limit=max(part.effort for part in parts if part.axis is not None),
        armature=given if armature is None else _each(armature, len(chain)),
        gear_ratio=GEAR_RATIO,
        sites=tuple((site, *place) for site, place in sites.items()),
        fixed=True,
        carrier=names[end],
    )
    with _told_of(tree.file):
        spec = whole.merged()
    _check_moving(spec, tree.file)
    return spec


def _ends(tree: ModelTree) -> str:
    """Return the names of the links at which chains of joints end, those of the longest first."""
    depth = {tree.links[0].name: 0}
    ends: dict[str, int] = {}
    for link in tree.links[1:]:
        depth[link.name] = depth[str(link.parent)] + (link.joint is not None and not link.joint.follows)
        if link.joint is not None and not link.joint.follows:
            ends[link.name] = depth[link.name]
        if depth[link.name] > depth[str(link.parent)]:
            ends.pop(str(link.parent), None)
    most = sorted(ends, key=lambda name: -ends[name])[:SHOWN]
    return ", ".join(map(repr, most)) if most else "of another file: this one has no joints that move"


def _tip(tree: ModelTree) -> str:
    """Return the link where the chain of joints ends or branches, or the last of the fixed links beyond."""
    children: dict[str, list[FileLink]] = {}
    for link in tree.links[1:]:
        children.setdefault(str(link.parent), []).append(link)
    moves: dict[str, bool] = {}
    depth: dict[str, int] = {}
    for link in reversed(tree.links):
        below = children.get(link.name, [])
        moves[link.name] = link.joint is not None or any(moves[child.name] for child in below)
        depth[link.name] = 1 + max((depth[child.name] for child in below), default=0)
    here = tree.links[0].name
    while True:
        below = children.get(here, [])
        moving = [child.name for child in below if moves[child.name]]
        if len(moving) > 1 or not below:
            return here
        here = moving[0] if moving else max((child.name for child in below), key=lambda name: depth[name])


def _chosen(tree: ModelTree, joints: Sequence[str]) -> list[FileLink]:
    """Return the links of joints, in the order of the tree.

    Raises:
        RobotError: for no list of different names, or a joint that does not exist or move by itself.
    """
    movable = {link.joint.name: link for link in tree.links if link.joint is not None and not link.joint.follows}
    listed = isinstance(joints, Sequence) and not isinstance(joints, str)
    wanted = [name for name in joints if isinstance(name, str)] if listed else []
    if not wanted or len(wanted) != len(joints) or len(set(wanted)) != len(wanted):
        raise RobotError("joints", joints, "a list of different names of joints")
    for name in wanted:
        if name not in movable:
            raise RobotError(f"joint in {tree.file}", name, suggest_names(name, movable))
    return [link for name, link in movable.items() if name in wanted]


def _joint_names(chain: Sequence[FileLink]) -> list[str]:
    return [link.joint.name for link in chain if link.joint is not None]


def _fixed_beyond(tree: ModelTree, here: str) -> str:
    """Return the last link of the longest chain of fixed links beyond a link."""
    depth = {here: 0}
    for link in tree.links:  # parents come first
        if link.joint is None and link.parent in depth:
            depth[link.name] = 1 + depth[link.parent]
    return max(depth, key=lambda name: depth[name])


def _way(links: dict[str, FileLink], end: str) -> list[FileLink]:
    """Return the links from the base to `end`."""
    way, here = [], end
    while (parent := links[here].parent) is not None:
        way.append(links[here])
        here = parent
    return way[::-1]


def _names(tree: ModelTree, chain: Sequence[FileLink]) -> dict[str, str]:
    """Return a name in the spec for each link of the file: its joint's if that is actuated."""
    names = {link.name: f"link {link.name}" for link in tree.links}
    names[tree.links[0].name] = BASE
    for link in chain:
        joint = "" if link.joint is None else link.joint.name
        if joint in RESERVED or joint.endswith("_rotor"):
            raise RobotError(f"name of a joint in {tree.file}", joint, f"any but {', '.join(RESERVED)} and ..._rotor")
        names[link.name] = joint
    return names


def _moved(tree: ModelTree, chain: Sequence[FileLink]) -> set[str]:
    """Return the links that an actuated joint moves."""
    moved = {link.name for link in chain}
    for link in tree.links:  # parents come first
        if link.parent in moved:
            moved.add(link.name)
    return moved


def _massless(link: FileLink) -> FileLink:
    """Return a link that never moves without its inertia, which then cannot matter."""
    return link._replace(mass=0.0, com=np.zeros(3), inertia=np.zeros((3, 3)))


def _part(link: FileLink, names: dict[str, str], file: str) -> Link:
    """Return a link of the spec: locked, unless it has its joint's name."""
    joint, name = link.joint, names[link.name]
    moves = joint is not None and name == joint.name
    origin, rotation = (link.origin, link.rotation) if moves else _locked(link)
    parent = None if link.parent is None else names[link.parent]
    with _told_of(file, link.name):
        body = Link(
            *(name, link.mass, _vector(link.com), _vector(np.diag(link.inertia)), parent, _vector(origin)),
            products=_vector(link.inertia[[0, 0, 1], [1, 2, 2]]),
            rotation=_rows(rotation),
        )
        return _driven(body, joint, file) if joint is not None and moves else body


@contextlib.contextmanager
def _told_of(file: str, link: str | None = None) -> Iterator[None]:
    """Name file and link in errors about a body."""
    try:
        yield
    except RobotError as error:
        if file in error.field:
            raise
        field = error.field if link is None else f"{error.field.partition(' of ')[0]} of link {link!r}"
        raise RobotError(f"{field} in {file}", error.value, error.allowed) from error


def _driven(body: Link, joint: FileJoint, file: str) -> Link:
    """Return the body with its joint.

    Raises:
        RobotError: for limits between which nothing lies.
    """
    if joint.limits[0] >= joint.limits[1]:
        raise RobotError(f"limit of joint {joint.name!r} in {file}", joint.limits, "lower < upper")
    if not 0 < joint.effort < math.inf:
        allowed = "a finite number above zero, the largest torque of its motor in both directions"
        raise RobotError(f"effort of joint {joint.name!r} in {file}", joint.effort, allowed)
    shared = ("limits", "prismatic", "effort", "speed", "damping", "coulomb")
    return dataclasses.replace(body, axis=_vector(joint.axis), **{field: getattr(joint, field) for field in shared})


def _locked(link: FileLink) -> tuple[np.ndarray, np.ndarray]:
    """Return origin and rotation of a link whose joint, if any, stays where it is closest to zero."""
    if link.joint is None:
        return link.origin, link.rotation
    held = float(np.clip(0.0, *link.joint.limits))
    if link.joint.prismatic:
        return link.origin + link.rotation @ link.joint.axis * held, link.rotation
    return link.origin, link.rotation @ _turned(link.joint.axis, held)


def _check_moving(spec: RobotSpec, file: str) -> None:
    low, high = RESOLVED
    for link in spec.joints:
        if not link.mass > 0:
            allowed = "an <inertial> with a mass above zero, of it or of a link fixed to it"
            raise RobotError(f"mass moved by joint {link.name!r} in {file}", link.mass, allowed)
        smallest, _, largest = link.principal
        if not (low <= min(link.mass, smallest) and max(link.mass, largest) <= high):
            field, allowed = (
                f"mass and moments moved by joint {link.name!r} in {file}",
                f"{low:g} to {high:g} kg, kg m^2",
            )
            raise RobotError(field, (link.mass, *link.principal), allowed)


def _each(armature: float | Sequence[float], joints: int) -> tuple[float, ...]:
    """Return an armature for each joint.

    Raises:
        RobotError: for anything but finite numbers from 0 to 1000, one or one for each joint.
    """
    try:
        values = np.broadcast_to(np.asarray(armature, dtype=np.float64), joints)
        fine = bool(((values >= 0) & (values <= 1e3)).all())
    except (TypeError, ValueError):
        values, fine = np.zeros(0), False
    if not fine:
        allowed = f"0 to 1000 kg m^2, one number or one for each of the {joints} joints"
        raise RobotError("armature", armature, allowed)
    return tuple(values.tolist())


def _turned(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)


def _vector(values: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _rows(rotation: np.ndarray) -> Rotation | None:
    if np.array_equal(rotation, np.eye(3)):
        return None
    x, y, z = (_vector(row) for row in rotation)
    return x, y, z
