"""An engine-neutral description of a robot: links, joints, gears and actuators.

URDF (Bullet), the rigid-body algebra of `artde_gym.multibody.dynamics` and every other engine's
model are made from this one description, so that they cannot disagree.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from artde_gym.errors import RobotError

Vector = tuple[float, float, float]
Colour = tuple[float, float, float, float]

ROTOR_MASS = 1e-6
"""Mass (kg) of a rotor link: engines need one above zero; its parent link gives it away."""


@dataclasses.dataclass(frozen=True)
class Box:
    """A box of side lengths `size` (m) centred at `center` in its link's frame."""

    size: Vector
    center: Vector
    color: Colour = (0.62, 0.65, 0.70, 1.0)


@dataclasses.dataclass(frozen=True)
class Link:
    """A rigid body and the joint that carries it.

    Attributes:
        mass: kg, above zero.
        com: center of mass in the link frame (m).
        inertia: principal moments about the center of mass, along the link's axes (kg m^2); they
            must satisfy the triangle inequality, since engines drop the whole tensor otherwise.
        parent: name of the parent link; None for the base.
        origin: of the joint, in the parent link's frame (m). At the zero position all link frames
            have the same orientation.
        axis: rotation axis in the link frame (unit vector along x, y or z); None for a fixed joint.
        limits: lowest and highest joint angle (rad).
        visuals, collisions: shapes to be seen, and shapes that touch the ground.
    """

    name: str
    mass: float
    com: Vector
    inertia: Vector
    parent: str | None = None
    origin: Vector = (0.0, 0.0, 0.0)
    axis: Vector | None = None
    limits: tuple[float, float] = (-math.pi, math.pi)
    visuals: tuple[Box, ...] = ()
    collisions: tuple[Box, ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mass) and self.mass > 0):
            raise RobotError(f"mass of link {self.name!r}", self.mass, "a finite number > 0 kg")
        smallest, middle, largest = sorted(self.inertia)
        if not (smallest > 0 and smallest + middle >= largest and math.isfinite(largest)):
            allowed = "three moments > 0 kg m^2 of which no two add up to less than the third"
            raise RobotError(f"inertia of link {self.name!r}", self.inertia, allowed)


@dataclasses.dataclass(frozen=True)
class Gear:
    """`rotor` turns `ratio` times as fast as `driven`; both links hang on the same parent."""

    rotor: str
    driven: str
    ratio: float


@dataclasses.dataclass(frozen=True)
class RobotSpec:
    """A tree of links, parents before children; the first one is the floating base.

    Attributes:
        actuated: the driven joints (named by the link that they carry), in the order of actions.
        armature: rotor inertia reflected to each actuated joint through its gear (kg m^2), as far as no link of the
            tree carries it already; M grows by diag(armature).
        gear_ratio: turns of a rotor for one turn of its joint.
        torque_limit: of every actuated joint (Nm).
        gears: couplings between rotor links and driven links.
        feet: links that carry the robot, left then right.
        sites: named points to push at or to load, as (link, position in the link frame).
        feet_collide: whether the feet stop each other, or pass through each other.
    """

    name: str
    links: tuple[Link, ...]
    actuated: tuple[str, ...]
    torque_limit: float
    feet: tuple[str, ...] = ()
    armature: tuple[float, ...] = ()
    gear_ratio: float = 10.0
    gears: tuple[Gear, ...] = ()
    sites: tuple[tuple[str, str, Vector], ...] = ()
    feet_collide: bool = False

    @functools.cached_property
    def by_name(self) -> dict[str, Link]:
        return {link.name: link for link in self.links}

    @property
    def base(self) -> Link:
        return self.links[0]

    @property
    def joints(self) -> tuple[Link, ...]:
        """The links with a revolute joint, in the order of the tree."""
        return tuple(link for link in self.links if link.axis is not None)

    def sole(self, foot: str) -> Vector:
        """Middle of the underside of a foot's collision box, in its link frame (m)."""
        box = self.by_name[foot].collisions[0]
        return (box.center[0], box.center[1], box.center[2] - box.size[2] / 2)

    @property
    def mass(self) -> float:
        """Total mass (kg)."""
        return math.fsum(link.mass for link in self.links)

    @property
    def height(self) -> float:
        """Distance between the lowest and the highest visible point at the zero position (m)."""
        origins: dict[str, np.ndarray] = {}
        low, high = math.inf, -math.inf
        for link in self.links:
            origins[link.name] = np.asarray(link.origin) + (0.0 if link.parent is None else origins[link.parent])
            for box in link.visuals:
                center = float(origins[link.name][2]) + box.center[2]
                low, high = min(low, center - box.size[2] / 2), max(high, center + box.size[2] / 2)
        return high - low

    def merged(self) -> RobotSpec:
        """The same robot with links on fixed joints made one with the links that carry them: fewer to simulate.

        Raises:
            RobotError: if a merged link's principal axes no longer lie along its frame.
        """
        carrier: dict[str, tuple[str, np.ndarray]] = {}
        parts: dict[str, list[tuple[Link, np.ndarray]]] = {}
        for link in self.links:
            if link.parent is None or link.axis is not None:
                carrier[link.name] = (link.name, np.zeros(3))
            else:
                name, offset = carrier[link.parent]
                carrier[link.name] = (name, offset + np.asarray(link.origin))
            name, offset = carrier[link.name]
            parts.setdefault(name, []).append((link, offset))

        def moved(link: str, point: Vector) -> tuple[str, Vector]:
            name, offset = carrier[link]
            return name, _vector(offset + np.asarray(point))

        links = []
        for name, group in parts.items():
            link = self.by_name[name]
            if link.parent is not None:
                parent, origin = moved(link.parent, link.origin)
                link = dataclasses.replace(link, parent=parent, origin=origin)
            links.append(_merge(link, group) if len(group) > 1 else link)
        sites = tuple((site, *moved(link, point)) for site, link, point in self.sites)
        return dataclasses.replace(self, links=tuple(links), sites=sites)

    def with_rotor_links(self) -> RobotSpec:
        """The same robot with its armature as real rotors, for engines that know no armature.

        Each actuated joint gets a rotor on the joint's *parent* link with inertia a / r^2 about the joint axis; turning
        r = `gear_ratio` times as fast it reflects exactly a. The transverse moments are 0.51 of the axial one: half
        would be a thin disc, at the very edge of the triangle inequality, where rounding makes engines drop the tensor.
        """
        links = list(self.links)
        gears = []
        for name, armature in zip(self.actuated, self.armature, strict=True):
            driven = self.by_name[name]
            if driven.axis is None or driven.parent is None:
                raise RobotError(f"actuated joint of {self.name!r}", name, "links with a revolute joint")
            axial = armature / self.gear_ratio**2
            moments = _about_axis(driven.axis, axial=axial, transverse=0.51 * axial)
            links.append(
                Link(
                    name=f"{name}_rotor",
                    mass=ROTOR_MASS,
                    com=(0.0, 0.0, 0.0),
                    inertia=moments,
                    parent=driven.parent,
                    origin=driven.origin,
                    axis=driven.axis,
                )
            )
            index = next(i for i, link in enumerate(links) if link.name == driven.parent)
            links[index] = dataclasses.replace(links[index], mass=links[index].mass - ROTOR_MASS)
            gears.append(Gear(f"{name}_rotor", name, self.gear_ratio))
        return dataclasses.replace(self, links=tuple(links), gears=tuple(gears), armature=(0.0,) * len(self.actuated))

    def with_lumped_armature(self, armature: tuple[float, ...], base: float) -> RobotSpec:
        """The same robot with discs of inertia (a, a/2, a/2) about the joint axis on the child links.

        Cheaper for an engine than rotors, and not the same: a disc moves with the child link.
        `base` (kg m^2) is added to each of the base link's moments.
        """
        extra = dict(zip(self.actuated, armature, strict=True))
        links = []
        for link in self.links:
            added = (base, base, base) if link is self.base else (0.0, 0.0, 0.0)
            if link.name in extra and link.axis is not None:
                added = _about_axis(link.axis, axial=extra[link.name], transverse=extra[link.name] / 2)
            x, y, z = (own + more for own, more in zip(link.inertia, added, strict=True))
            links.append(dataclasses.replace(link, inertia=(x, y, z)))
        return dataclasses.replace(self, links=tuple(links), armature=(0.0,) * len(self.actuated))


def box_link(
    name: str,
    mass: float,
    size: Vector,
    center: Vector,
    parent: str | None = None,
    origin: Vector = (0.0, 0.0, 0.0),
    axis: Vector | None = None,
    limits: tuple[float, float] = (-math.pi, math.pi),
    *,
    collides: bool = False,
) -> Link:
    """A link that is a homogeneous box: I_x = m (b^2 + c^2) / 12 and so on."""
    a, b, c = size
    inertia = (mass / 12 * (b * b + c * c), mass / 12 * (a * a + c * c), mass / 12 * (a * a + b * b))
    shape = (Box(size, center),)
    return Link(name, mass, center, inertia, parent, origin, axis, limits, shape, shape if collides else ())


def _merge(carrier: Link, group: list[tuple[Link, np.ndarray]]) -> Link:
    """`carrier` with the mass, inertia (parallel axes) and shapes of all links of `group`, each at its offset."""
    mass = math.fsum(link.mass for link, _ in group)
    com = np.sum([link.mass * (np.asarray(link.com) + offset) for link, offset in group], axis=0) / mass
    inertia = np.zeros((3, 3))
    for link, offset in group:
        d = np.asarray(link.com) + offset - com
        inertia += np.diag(link.inertia) + link.mass * (d @ d * np.eye(3) - np.outer(d, d))
    if not np.allclose(inertia, np.diag(np.diag(inertia)), rtol=0.0, atol=1e-9):
        raise RobotError(f"inertia of merged link {carrier.name!r}", inertia.tolist(), "principal axes along the frame")

    def shapes(kind: str) -> tuple[Box, ...]:
        moved = (
            (box, _vector(offset + np.asarray(box.center))) for link, offset in group for box in getattr(link, kind)
        )
        return tuple(dataclasses.replace(box, center=center) for box, center in moved)

    return dataclasses.replace(
        carrier,
        mass=mass,
        com=_vector(com),
        inertia=_vector(np.diag(inertia)),
        visuals=shapes("visuals"),
        collisions=shapes("collisions"),
    )


def _vector(values: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _about_axis(axis: Vector, *, axial: float, transverse: float) -> Vector:
    """Principal moments of a body of revolution about `axis`, one of the coordinate axes."""
    x, y, z = (axial if component else transverse for component in axis)
    return (x, y, z)
