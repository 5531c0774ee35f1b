"""NumPy simulation of many free rigid bodies, each with its own constants, without collisions.

Components are on the first axes and bodies on the last one, (3, n), and all arithmetic is elementwise, so that
results for a body do not depend on the number of bodies.

A step of h is a drift of h/2, a kick of h with forces at its middle, and a drift of h/2; consecutive drifts may be
merged. This splitting is of second order:

drift h:   p <- p + h v,   q <- q (1, w / |w| tan(h |w| / 2)) / norm
kick h:    v <- v + h (F / m + g),   w <- w + h w',   I w' = tau - w_m x I w_m

with p, v of the center of mass in world axes, q from body to world, and w, I, tau in body axes about the center of
mass. w_m = w + h/2 w', with w' of the previous kick, approximates w in the middle of the kick.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from artde_gym.arrays import Array, total
from artde_gym.multibody.dynamics import GRAVITY
from artde_gym.multibody.spec import Vector

ALL = slice(None)

Integers = NDArray[np.intp]

_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


class MassProperties(NamedTuple):
    """Mass (kg), center of mass in the body frame (m) and inertia about it (kg m^2) of a rigid body, or of several.

    The arrays are (...), (..., 3) and (..., 3, 3).
    """

    mass: Any
    com: Any
    inertia: Array


def composite(*parts: MassProperties) -> MassProperties:
    """Combine bodies that are fixed to each other."""
    masses = [np.asarray(part.mass)[..., None] for part in parts]
    mass = total(part.mass for part in parts)
    com = np.sum([own * np.asarray(part.com) for own, part in zip(masses, parts, strict=True)], axis=0)
    com /= np.asarray(mass)[..., None]
    inertia = np.zeros((*com.shape, 3))
    for own, part in zip(masses, parts, strict=True):
        arm = np.asarray(part.com) - com
        square = np.reshape([one @ one for one in arm.reshape(-1, 3)], (*arm.shape[:-1], 1, 1))
        inertia += part.inertia + own[..., None] * (square * np.eye(3) - arm[..., :, None] * arm[..., None, :])
    return MassProperties(mass, com, inertia)


class RigidBodies:
    """The states of `n` bodies.

    Attributes:
        com, com_velocity: positions and velocities of the centers of mass (3, n) (m, m/s), world axes.
        quat_xyzw: attitudes, body to world (4, n).
        rot: the attitudes as matrices (3, 3, n).
        rates: angular velocities (3, n) (rad/s), body axes.
    """

    def __init__(self, n: int, dtype: DTypeLike) -> None:
        def zeros(*shape: int) -> Array:
            return np.zeros((*shape, n), dtype)

        self.com, self.com_velocity, self.rates = zeros(3), zeros(3), zeros(3)
        self.quat_xyzw, self.rot = zeros(4), zeros(3, 3)
        self._arm, self._arm_cross = zeros(3), zeros(3, 3)  # of the center of mass, body axes; and the matrix -arm x
        self._inverse_mass = zeros()
        self._inertia, self._inverse_inertia = zeros(3, 3), zeros(3, 3)
        self._acceleration = zeros(3)  # w' of the last kick
        self._square = zeros(4)

    def set_properties(self, body: int, properties: MassProperties) -> None:
        """Change a body's constants without changing the motion of its origin."""
        point, velocity = self.origin(body), self.origin_velocity(body)
        self._set_constants(body, properties)
        self.com[:, body] += point - self.origin(body)
        self.com_velocity[:, body] += velocity - self.origin_velocity(body)

    def place(self, body: int | Integers, origin: Vector | Array) -> None:
        """Put upright bodies with their origins at points (m), at rest."""
        self.quat_xyzw[:3, body], self.quat_xyzw[3, body] = 0.0, 1.0
        for axis in range(3):
            self.rot[:, axis, body] = 0.0
            self.rot[axis, axis, body] = 1.0
        self.rates[:, body] = self.com_velocity[:, body] = self._acceleration[:, body] = 0.0
        self.com[:, body] = np.add(origin, self._arm[:, body])

    def begin(self, bodies: Integers, properties: MassProperties, origins: Array) -> None:
        """Give bodies their constants, and put them upright with their origins at points (3, n) (m), at rest."""
        self._set_constants(bodies, properties)
        self.place(bodies, origins)

    def _set_constants(self, body: int | Integers, properties: MassProperties) -> None:
        inertia = properties.inertia
        x, y, z = self._arm[:, body] = np.asarray(properties.com).T
        for (row, column), value in (((0, 1), z), ((0, 2), -y), ((1, 0), -z), ((1, 2), x), ((2, 0), y), ((2, 1), -x)):
            self._arm_cross[row, column, body] = value
        self._inverse_mass[body] = 1.0 / properties.mass
        self._inertia[..., body] = np.moveaxis(inertia, (-2, -1), (0, 1))
        self._inverse_inertia[..., body] = np.moveaxis(np.linalg.inv(inertia), (-2, -1), (0, 1))

    @property
    def arm(self) -> Array:
        """Centers of mass in the bodies' frames (3, n) (m)."""
        return self._arm

    @property
    def inverse_mass(self) -> Array:
        """Of each body (n,) (1/kg)."""
        return self._inverse_mass

    def principal_inverse_inertia(self) -> Array:
        """Diagonals of the inverse inertias (3, n) (1/(kg m^2))."""
        return self._inverse_inertia.reshape(9, -1)[::4]

    def motion(self) -> tuple[Array, ...]:
        """Return the arrays that a step changes, bodies on the last axis."""
        return self.com, self.com_velocity, self.quat_xyzw, self.rot, self.rates, self._acceleration

    def origin(self, bodies: int | slice = ALL) -> Array:
        """Return positions of the bodies' origins (3, n) (m), world axes."""
        return self.com[:, bodies] - times(self.rot[..., bodies], self._arm[:, bodies])

    def origin_velocity(self, bodies: int | slice = ALL) -> Array:
        """Return velocities of the bodies' origins (3, n) (m/s), world axes."""
        across = times(self._arm_cross[..., bodies], self.rates[:, bodies])  # w x arm
        return self.com_velocity[:, bodies] - times(self.rot[..., bodies], across)

    def drift(self, duration: float) -> None:
        """Move along the velocities for `duration` (s)."""
        self.com += duration * self.com_velocity
        turn = duration * self.rates
        square = turn * turn
        square = square[0] + square[1] + square[2]
        turn *= 0.5 + square * (1 / 24)  # the series of tan(|turn| / 2) / |turn|
        vector, scalar = self.quat_xyzw[:3], self.quat_xyzw[3]
        along = vector * turn
        vector += scalar * turn + cross(vector, turn)
        scalar -= along[0] + along[1] + along[2]
        square = np.multiply(self.quat_xyzw, self.quat_xyzw, out=self._square)
        self.quat_xyzw *= 1.0 / np.sqrt(square[0] + square[1] + square[2] + square[3])
        self._update_rot()

    def kick(self, duration: float, force: Array, torque: Array) -> None:
        """Integrate a `force` (3, n) (N, world axes) and a `torque` (3, n) (Nm, body axes) at the origin."""
        self.com_velocity += force * (duration * self._inverse_mass)
        self.com_velocity[2] -= duration * GRAVITY
        middle = self.rates + (0.5 * duration) * self._acceleration
        about_com = torque + times(self._arm_cross, transposed_times(self.rot, force))  # - arm x force
        about_com -= cross(middle, times(self._inertia, middle))
        self._acceleration = times(self._inverse_inertia, about_com)
        self.rates += duration * self._acceleration

    def add_kick(self, duration: float, acceleration: Array, turning: Array, where: NDArray[np.bool_]) -> None:
        """Make the last kick stronger by an `acceleration` (m/s^2, world axes) and a `turning` (rad/s^2, body axes).

        Both are (3, n); bodies other than those `where` keep their velocities to the bit.
        """
        np.add(self.com_velocity, duration * acceleration, out=self.com_velocity, where=where)
        np.add(self.rates, duration * turning, out=self.rates, where=where)
        np.add(self._acceleration, turning, out=self._acceleration, where=where)

    def _update_rot(self) -> None:
        x, y, z, w = self.quat_xyzw
        rot = self.rot
        twice = self.quat_xyzw[:3] + self.quat_xyzw[:3]
        (xx, xy, xz), (yy, yz), zz = x * twice, y * twice[1:], z * twice[2]
        wx, wy, wz = w * twice
        np.subtract(1.0, yy + zz, out=rot[0, 0])
        np.subtract(1.0, xx + zz, out=rot[1, 1])
        np.subtract(1.0, xx + yy, out=rot[2, 2])
        np.subtract(xy, wz, out=rot[0, 1])
        np.subtract(yz, wx, out=rot[1, 2])
        np.subtract(xz, wy, out=rot[2, 0])
        np.add(xy, wz, out=rot[1, 0])
        np.add(yz, wx, out=rot[2, 1])
        np.add(xz, wy, out=rot[0, 2])


def times(matrices: Array, vectors: Array) -> Array:
    """Multiply matrices (3, 3, ...) by vectors (3, ...) for each body, summing in a fixed order."""
    out = matrices[:, 0] * vectors[0]
    out += matrices[:, 1] * vectors[1]
    out += matrices[:, 2] * vectors[2]
    return out


def transposed_times(matrices: Array, vectors: Array) -> Array:
    """Multiply transposed matrices (3, 3, ...) by vectors (3, ...) as `times` does."""
    out = matrices[0] * vectors[0]
    out += matrices[1] * vectors[1]
    out += matrices[2] * vectors[2]
    return out


def cross(a: Array, b: Array) -> Array:
    """Return cross products of vectors (3, ...) for each body."""
    return a.take(_NEXT, 0) * b.take(_LAST, 0) - a.take(_LAST, 0) * b.take(_NEXT, 0)


def rotate_frames(rot: Array, vectors: Array) -> Array:
    """Rotate attitudes (3, 3, n) about `vectors` v (3, n) in body axes by angles of 2 atan(|v| / 2), about |v|."""
    half = 0.5 * vectors
    square = half * half
    factor = 2.0 / (1.0 + (square[0] + square[1] + square[2]))
    out = np.empty_like(rot)
    for row, own in enumerate(rot):  # r (1 + f ([h]x + [h]x^2)) = r + f (r x h + (r x h) x h)
        across = cross(own, half)
        out[row] = own + factor * (across + cross(across, half))
    return out
