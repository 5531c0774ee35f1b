"""Engine-neutral description of a robot: links, joints, gears and actuators.

URDF (Bullet), the rigid-body dynamics of `artde_gym.multibody.dynamics` and the models of other engines are generated
from this description, so that they agree.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import NamedTuple

import numpy as np

from artde_gym.errors import RobotError

Vector = tuple[float, float, float]
Color = tuple[float, float, float, float]
Rotation = tuple[Vector, Vector, Vector]
"""Rows of a rotation matrix."""

ROTOR_MASS = 1e-6
"""Mass (kg) of a rotor link, subtracted from its parent link's: engines require one above zero."""

ROUNDING = 1e-9
"""Share of the largest principal moment by which the triangle inequality may fail."""


@dataclasses.dataclass(frozen=True)
class Box:
    """A box of side lengths `size` (m) centered at `center` in its link's frame."""

    size: Vector
    center: Vector
    color: Color = (0.62, 0.65, 0.70, 1.0)


@dataclasses.dataclass(frozen=True)
class Link:
    """A rigid body and the joint that carries it.

    Attributes:
        mass: kg, above zero; a mere frame has neither mass nor inertia, a link on a fixed joint may lack a mass.
        com: center of mass in the link frame (m).
        inertia: moments about the center of mass, along the link's axes (kg m^2); with `products` the principal ones
            must satisfy the triangle inequality, or engines discard the whole tensor. Only the base's must be above
            zero: a point or a rod may be a part of a body, but not move alone, see `RobotSpec.merged`.
        parent: name of the parent link; None for the base.
        origin: origin of the joint in the parent link's frame (m).
        axis: axis of the joint in the link frame (unit vector); None for a fixed joint.
        limits: lowest and highest joint position (rad, or m of a prismatic joint).
        visuals, collisions: visible shapes, and shapes that collide with the ground.
        products: I_xy, I_xz, I_yz about the center of mass (kg m^2).
        rotation: from the link frame to the parent's at the zero position; None for equal orientations.
        prismatic: True if the joint slides along its axis, False if it turns about it.
        effort: largest torque or force of the joint (Nm or N).
        speed: largest speed of the joint (rad/s or m/s).
        damping: viscous friction of the joint (Nm s/rad or N s/m).
        coulomb: dry friction of the joint (Nm or N).
        slip: speed at which dry friction reaches tanh(1) = 76 % of it (rad/s or m/s).
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
    products: Vector = (0.0, 0.0, 0.0)
    rotation: Rotation | None = None
    prismatic: bool = False
    effort: float = math.inf
    speed: float = math.inf
    damping: float = 0.0
    coulomb: float = 0.0
    slip: float = 0.05

    def __post_init__(self) -> None:
        if not any((self.mass, *self.inertia, *self.products)):
            return  # a frame, such as a tool's; `RobotSpec.merged` gives it the mass of links fixed to it
        held = self.axis is None and self.parent is not None
        if not (math.isfinite(self.mass) and (self.mass > 0 or (held and self.mass == 0))):
            raise RobotError(f"mass of link {self.name!r}", self.mass, "a finite number > 0 kg")
        smallest, middle, largest = self.principal
        positive = smallest >= -ROUNDING * largest if self.parent is not None else smallest > 0
        if not (positive and smallest + middle >= largest and math.isfinite(largest)):
            allowed = "three moments, not negative, that satisfy the triangle inequality (kg m^2)"
            raise RobotError(f"inertia of link {self.name!r}", (*self.inertia, *self.products), allowed)

    @property
    def tensor(self) -> np.ndarray:
        """Inertia about the center of mass (3, 3), along the link's axes (kg m^2)."""
        (x, y, z), (xy, xz, yz) = self.inertia, self.products
        return np.array([[x, xy, xz], [xy, y, yz], [xz, yz, z]])

    @property
    def plain(self) -> bool:
        """True if the tensor is diagonal and the link's frame has the parent's orientation at the zero position."""
        return self.rotation is None and not any(self.products)

    @property
    def principal(self) -> list[float]:
        """Principal moments in ascending order (kg m^2); rounding may break their triangle inequality."""
        if not any(self.products):
            return sorted(self.inertia)
        if not np.isfinite(self.tensor).all():
            return [math.nan] * 3
        smallest, middle, largest = np.linalg.eigvalsh(self.tensor).tolist()
        return [smallest, middle + ROUNDING * largest, largest]


@dataclasses.dataclass(frozen=True)
class Gear:
    """A gear: `rotor` turns `ratio` times as fast as `driven`; both links have the same parent."""

    rotor: str
    driven: str
    ratio: float


@dataclasses.dataclass(frozen=True)
class RobotSpec:
    """A tree of links, parents before children; the first one is the base.

    Attributes:
        actuated: the actuated joints (named by the link that they carry), in the order of actions.
        armature: rotor inertia reflected to each actuated joint through its gear (kg m^2), unless rotors are links;
            it adds diag(armature) to M.
        gear_ratio: turns of a rotor per turn of its joint.
        torque_limit: limit of every actuated joint (Nm).
        gears: couplings between rotor links and driven links.
        feet: links that support the robot, left then right.
        sites: points for pushes and loads, as (name, link, position in the link frame).
        feet_collide: True if the feet collide with each other.
        fixed: True if the base is fixed to the world, as that of a manipulator; False if it floats.
        carrier: link that carries a payload; "" for the base.
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
    fixed: bool = False
    carrier: str = ""

    def __post_init__(self) -> None:
        if not (self.fixed or self.base.mass > 0):
            raise RobotError(f"mass of link {self.base.name!r}", self.base.mass, "a finite number > 0 kg: it floats")

    @functools.cached_property
    def by_name(self) -> dict[str, Link]:
        return {link.name: link for link in self.links}

    @property
    def base(self) -> Link:
        return self.links[0]

    @property
    def joints(self) -> tuple[Link, ...]:
        """Links with a joint that moves, in the order of the tree."""
        return tuple(link for link in self.links if link.axis is not None)

    @property
    def payload_link(self) -> str:
        """Name of the link that carries a payload."""
        return self.carrier or self.base.name

    @property
    def torque_limits(self) -> tuple[float, ...]:
        """Limit of each actuated joint (Nm or N)."""
        return tuple(min(self.torque_limit, self.by_name[name].effort) for name in self.actuated)

    def sole(self, foot: str) -> Vector:
        """Return the center of the bottom face of a foot's collision box, in its link frame (m)."""
        box = self.by_name[foot].collisions[0]
        return (box.center[0], box.center[1], box.center[2] - box.size[2] / 2)

    @property
    def mass(self) -> float:
        """Total mass (kg)."""
        return math.fsum(link.mass for link in self.links)

    @property
    def height(self) -> float:
        """Distance between the lowest and highest visible points at the zero position (m)."""
        origins: dict[str, np.ndarray] = {}
        low, high = math.inf, -math.inf
        for link in self.links:
            origins[link.name] = np.asarray(link.origin) + (0.0 if link.parent is None else origins[link.parent])
            for box in link.visuals:
                center = float(origins[link.name][2]) + box.center[2]
                low, high = min(low, center - box.size[2] / 2), max(high, center + box.size[2] / 2)
        return high - low

    def merged(self) -> RobotSpec:
        """Merge links on fixed joints into their parents, so that there are fewer to simulate.

        Raises:
            RobotError: for a body that moves with a mass, but without inertia about some axis.
        """
        carrier: dict[str, tuple[str, np.ndarray, np.ndarray | None]] = {}
        parts: dict[str, list[_Part]] = {}
        for link in self.links:
            if link.parent is None or link.axis is not None:
                carrier[link.name] = (link.name, np.zeros(3), None)
            else:
                carrier[link.name] = _placed(carrier[link.parent], link.origin, link.rotation)
            name, offset, rotation = carrier[link.name]
            parts.setdefault(name, []).append(_Part(link, offset, rotation))

        links = []
        for name, group in parts.items():
            link = self.by_name[name]
            if link.parent is not None:
                parent, origin, rotation = _placed(carrier[link.parent], link.origin, link.rotation)
                link = dataclasses.replace(link, parent=parent, origin=_vector(origin), rotation=_rows(rotation))
            links.append(_merge(link, group) if len(group) > 1 else link)
            if link.axis is not None and links[-1].mass > 0 and not links[-1].principal[0] > 0:
                allowed = "three principal moments > 0 kg m^2, of it and of links fixed to it"
                raise RobotError(f"inertia of link {name!r}", (*links[-1].inertia, *links[-1].products), allowed)
        moved = ((site, _placed(carrier[link], point, None)) for site, link, point in self.sites)
        sites = tuple((site, name, _vector(point)) for site, (name, point, _) in moved)
        load = carrier[self.carrier][0] if self.carrier else ""
        return dataclasses.replace(self, links=tuple(links), sites=sites, carrier=load)

    def with_rotor_links(self) -> RobotSpec:
        """Replace the armature by rotor links, for engines without armature.

        Each actuated joint gets a rotor on the joint's *parent* link with inertia a / r^2 about the joint axis, which
        turns r = `gear_ratio` times as fast, so that exactly a is reflected. The transverse moments are 0.51 of the
        axial one: at 0.5, a thin disc, rounding could violate the triangle inequality and engines would discard the
        tensor.
        """
        links = list(self.links)
        gears = []
        for name, armature in zip(self.actuated, self.armature, strict=True):
            driven = self.by_name[name]
            if driven.axis is None or driven.parent is None:
                raise RobotError(f"actuated joint of {self.name!r}", name, "links with a revolute joint")
            if armature == 0.0:
                continue
            axial = armature / self.gear_ratio**2
            moments, products = _about_axis(driven.axis, axial=axial, transverse=0.51 * axial)
            links.append(
                Link(
                    name=f"{name}_rotor",
                    mass=ROTOR_MASS,
                    com=(0.0, 0.0, 0.0),
                    inertia=moments,
                    parent=driven.parent,
                    origin=driven.origin,
                    axis=driven.axis,
                    products=products,
                    rotation=driven.rotation,
                )
            )
            index = next(i for i, link in enumerate(links) if link.name == driven.parent)
            if links[index].mass > 0:
                links[index] = dataclasses.replace(links[index], mass=links[index].mass - ROTOR_MASS)
            gears.append(Gear(f"{name}_rotor", name, self.gear_ratio))
        return dataclasses.replace(self, links=tuple(links), gears=tuple(gears), armature=(0.0,) * len(self.actuated))

    def with_lumped_armature(self, armature: tuple[float, ...], base: float) -> RobotSpec:
        """Replace the armature by discs of inertia (a, a/2, a/2) about the joint axis on the child links.

        This is faster to simulate than rotors, but not equivalent: a disc moves with the child link.
        `base` (kg m^2) is added to each of the base link's moments.
        """
        extra = dict(zip(self.actuated, armature, strict=True))
        links = []
        for link in self.links:
            added = (base, base, base) if link is self.base else (0.0, 0.0, 0.0)
            if link.name in extra and link.axis is not None:
                added, _ = _about_axis(link.axis, axial=extra[link.name], transverse=extra[link.name] / 2)
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
    """Return a link that is a homogeneous box: I_x = m (b^2 + c^2) / 12 and so on."""
    a, b, c = size
    inertia = (mass / 12 * (b * b + c * c), mass / 12 * (a * a + c * c), mass / 12 * (a * a + b * b))
    shape = (Box(size, center),)
    return Link(name, mass, center, inertia, parent, origin, axis, limits, shape, shape if collides else ())


class _Part(NamedTuple):
    """A link that is merged into another, whose frame holds its `offset` (m) and `rotation` (None: the same)."""

    link: Link
    offset: np.ndarray
    rotation: np.ndarray | None

    def placed(self, point: Vector) -> np.ndarray:
        return self.offset + np.asarray(point) if self.rotation is None else self.offset + self.rotation @ point

    def tensor(self) -> np.ndarray:
        if self.rotation is None:
            return self.link.tensor
        return self.rotation @ self.link.tensor @ self.rotation.T


def _placed(
    carrier: tuple[str, np.ndarray, np.ndarray | None], point: Vector, rotation: Rotation | None
) -> tuple[str, np.ndarray, np.ndarray | None]:
    """Return the frame at a point of a link that is merged, in the link that carries it."""
    name, offset, turned = carrier
    own = None if rotation is None else np.array(rotation)
    if turned is None:
        return name, offset + np.asarray(point), own
    return name, offset + turned @ np.asarray(point), turned if own is None else turned @ own


def _merge(carrier: Link, group: list[_Part]) -> Link:
    """Return `carrier` with the mass, inertia (parallel axes) and shapes of all links of `group` at their offsets."""
    mass = math.fsum(part.link.mass for part in group)
    com = np.zeros(3)
    if mass > 0:
        com = np.sum([part.link.mass * part.placed(part.link.com) for part in group], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in group:
        d = part.placed(part.link.com) - com
        inertia += part.tensor() + part.link.mass * (d @ d * np.eye(3) - np.outer(d, d))
    products = _vector(inertia[[0, 0, 1], [1, 2, 2]])
    if all(part.link.plain for part in group) and np.allclose(products, 0.0, rtol=0.0, atol=1e-9):
        products = (0.0, 0.0, 0.0)  # of rounding

    def shapes(kind: str) -> tuple[Box, ...]:
        moved = ((box, _vector(part.placed(box.center))) for part in group for box in getattr(part.link, kind))
        return tuple(dataclasses.replace(box, center=center) for box, center in moved)

    return dataclasses.replace(
        carrier,
        mass=mass,
        com=_vector(com),
        inertia=_vector(np.diag(inertia)),
        products=products,
        visuals=shapes("visuals"),
        collisions=shapes("collisions"),
    )


def _vector(values: np.ndarray) -> Vector:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _rows(rotation: np.ndarray | None) -> Rotation | None:
    if rotation is None:
        return None
    x, y, z = (_vector(row) for row in rotation)
    return x, y, z


def _about_axis(axis: Vector, *, axial: float, transverse: float) -> tuple[Vector, Vector]:
    """Return moments and products of inertia of a body of revolution about `axis`."""
    x, y, z = axis
    if sorted(map(abs, axis)) == [0.0, 0.0, 1.0]:
        a, b, c = (axial if component else transverse for component in axis)
        return (a, b, c), (0.0, 0.0, 0.0)
    more = axial - transverse
    moments = (transverse + more * x * x, transverse + more * y * y, transverse + more * z * z)
    return moments, (more * x * y, more * x * z, more * y * z)
