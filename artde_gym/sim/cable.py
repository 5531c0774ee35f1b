"""A load on a cable under a rigid body: one unilateral constraint, solved in closed form for every engine.

The load is a point mass m_L; the cable is massless, does not stretch, and goes slack. With r = load - hook,
q = r / |r|, the hook at a from the body's center of mass (body axes), the cable's length l, and r* what r becomes
within a step h without the cable (the attitude R turned by h w), the tension during that step is

    D  = q (1/m_L + 1/m) + R [(I^-1 (a x R^T q)) x a]                      how fast r shortens, per tension
    C  = |r*|^2 - l^2,   B = r*^T D
    T  = C / (h^2 (B + sqrt(B^2 - |D|^2 C)))   if C > 0, else 0            the smaller root of |r* - h^2 T D| = l

T q pulls at the hook, -T q at the load. Slack, taut and the inelastic end of a fall into the cable all come out of this
line; a release is its end. If the root is not real, the load comes as close as it can.

It is the constraint of SHAKE (Ryckaert, Ciccotti, Berendsen 1977), for one bond and one-sided. It belongs to any
integrator that moves positions by the new velocities. All is elementwise, on plain floats for one vehicle, where small
arrays would be six times as slow, or on arrays for many.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from artde_gym.arrays import Array

Number = TypeVar("Number", float, Array)
Vector3 = tuple[Number, Number, Number]
Matrix3 = tuple[Number, Number, Number, Number, Number, Number, Number, Number, Number]

DRAG = 0.0058  # N s^2/m^2: half the density of air times c_d = 0.47 times the cross-section of a ball of 8 cm
TINY = 1e-12


class Functions(NamedTuple):
    """Functions for one kind of number."""

    root: Callable[[Any], Any]
    larger: Callable[[Any, Any], Any]
    smaller: Callable[[Any, Any], Any]


FLOATS = Functions(math.sqrt, max, min)
ARRAYS = Functions(np.sqrt, np.maximum, np.minimum)


class Body(NamedTuple, Generic[Number]):
    """A rigid body, with the velocities that a step gives it without the cable.

    Attributes:
        inverse_mass: (1/kg).
        inverse_inertia: about the center of mass, along the body's axes (1/(kg m^2)).
        rot: from body to world, row by row.
        com, velocity: of the center of mass, world axes (m, m/s).
        rates: angular velocity, body axes (rad/s).
    """

    inverse_mass: Number
    inverse_inertia: Vector3[Number]
    rot: Matrix3[Number]
    com: Vector3[Number]
    velocity: Vector3[Number]
    rates: Vector3[Number]


class Load(NamedTuple, Generic[Number]):
    """A point mass (1/kg, m, m/s), its velocity being the one that a step gives it without the cable."""

    inverse_mass: Number
    position: Vector3[Number]
    velocity: Vector3[Number]


class Pull(NamedTuple, Generic[Number]):
    """Effect of a cable during a step.

    Attributes:
        tension: T (N).
        direction: q, from the hook to the load, world axes.
        in_body: R^T q, the same in body axes.
        moment: a x R^T q (m), body axes: the torque on the body per tension.
    """

    tension: Number
    direction: Vector3[Number]
    in_body: Vector3[Number]
    moment: Vector3[Number]


def pull(
    body: Body[Number], load: Load[Number], hook: Vector3[Number], length: Number, step: float, by: Functions
) -> Pull[Number]:
    """Compute the tension at the top; `hook` is a (m), `by` are functions for this kind of number."""
    rot = body.rot
    r = minus(minus(load.position, body.com), times(rot, hook))
    q = scaled(1.0 / by.larger(by.root(dot(r, r)), TINY), r)
    in_body = transposed_times(rot, q)
    moment = cross(hook, in_body)
    i_x, i_y, i_z = body.inverse_inertia
    turning = cross((i_x * moment[0], i_y * moment[1], i_z * moment[2]), hook)
    shortening = plus(scaled(load.inverse_mass + body.inverse_mass, q), times(rot, turning))

    ahead = plus(minus(load.position, body.com), scaled(step, minus(load.velocity, body.velocity)))
    ahead = minus(ahead, times(rot, _turned(hook, scaled(0.5 * step, body.rates))))
    beyond = by.larger(dot(ahead, ahead) - length * length, 0.0)
    along, square = by.larger(dot(ahead, shortening), 0.0), dot(shortening, shortening)
    discriminant = by.larger(along * along - square * beyond, 0.0)
    nearest = along / by.larger(square, TINY)
    root = by.smaller(beyond / by.larger(along + by.root(discriminant), TINY), nearest)
    return Pull(root / (step * step), q, in_body, moment)


def _turned(vector: Vector3[Number], half: Vector3[Number]) -> Vector3[Number]:
    """Turn a vector about `half` by 2 atan |half|, as `artde_gym.sim.rigid_bodies.rotate_frames` does."""
    across = cross(half, vector)
    factor = 2.0 / (1.0 + dot(half, half))
    return plus(vector, scaled(factor, plus(across, cross(half, across))))


def drag(wind: Vector3[Number], velocity: Vector3[Number], inverse_mass: Number, step: float, root: Any) -> Number:
    """Compute the factor (N s/m) by which the velocity of the air past a load is the force on it.

    It is c |u| / (1 + h c |u| / m): the force at the end of the step h to first order, which slows down, but never
    throws back, a light load in a fast stream.
    """
    u = minus(wind, velocity)
    rate = DRAG * root(dot(u, u))
    return rate / (1.0 + step * rate * inverse_mass)


def dot(a: Vector3[Number], b: Vector3[Number]) -> Number:
    """Compute a^T b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector3[Number], b: Vector3[Number]) -> Vector3[Number]:
    """Compute a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(a: Vector3[Number], b: Vector3[Number]) -> Vector3[Number]:
    """Compute a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Vector3[Number], b: Vector3[Number]) -> Vector3[Number]:
    """Compute a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scaled(factor: Any, a: Vector3[Number]) -> Vector3[Number]:
    """Compute factor a."""
    return factor * a[0], factor * a[1], factor * a[2]


def times(rot: Matrix3[Number], a: Vector3[Number]) -> Vector3[Number]:
    """Compute R a."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rot
    x, y, z = a
    return xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z


def transposed_times(rot: Matrix3[Number], a: Vector3[Number]) -> Vector3[Number]:
    """Compute R^T a."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rot
    x, y, z = a
    return xx * x + yx * y + zx * z, xy * x + yy * y + zy * z, xz * x + yz * y + zz * z
