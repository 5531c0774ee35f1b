"""The payload of a robot with a fixed base in Bullet: a link that is next to massless without one.

A ball on a constraint, as floating robots carry it, would be held by the solver alone. A link is exact, but Bullet can
change its mass only: for another place the robot is built anew.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from artde_gym.multibody.mjcf import PAYLOAD
from artde_gym.multibody.spec import Link, RobotSpec, Vector
from artde_gym.sim.engine import PAYLOAD_RADIUS

MASSLESS, MOMENT = 1e-6, 1e-9
"""Mass (kg) and moments (kg m^2) of the link without a payload: Bullet requires some."""


class Fall(NamedTuple):
    """A released payload: its position, velocity and time of release."""

    position: Vector
    velocity: Vector
    time: float


class Carried:
    """The payload on a link.

    Attributes:
        mass: kg; 0 without one.
        home: a usual position, at which the robot need not be built anew: its first site on the link (m).
        position: of its center in the frame of the carrying link (m).
        fall: its release; None if it was not.
    """

    def __init__(self, spec: RobotSpec) -> None:
        self._spec = spec
        self.mass = 0.0
        self.home = next((point for _, link, point in spec.sites if link == spec.payload_link), (0.0, 0.0, 0.0))
        self.position: Vector = self.home
        self.fall: Fall | None = None

    @property
    def moment(self) -> float:
        """Moment about any axis through the center (kg m^2)."""
        return max(0.4 * self.mass * PAYLOAD_RADIUS**2, MOMENT)

    def spec(self) -> RobotSpec:
        """Return the robot with the link."""
        nothing, moments = (0.0, 0.0, 0.0), (MOMENT, MOMENT, MOMENT)
        link = Link(PAYLOAD, MASSLESS, nothing, moments, self._spec.payload_link, self.position)
        return dataclasses.replace(self._spec, links=(*self._spec.links, link))

    def kept(self) -> tuple[float, Vector, Fall | None]:
        """Return all of it for a copy."""
        return self.mass, self.position, self.fall

    def fallen(self, time: float, gravity: Vector) -> Vector | None:
        """Return where the payload is at a time (s) after its release; None if there was none."""
        if self.fall is None:
            return None
        since = time - self.fall.time
        x, y, z = np.add(
            self.fall.position, np.multiply(self.fall.velocity, since) + np.multiply(gravity, since**2 / 2)
        )
        return float(x), float(y), float(z)
