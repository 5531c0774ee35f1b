"""Vectors in space as three components, each an array (...): what `controllers.laws.tracking.components` gives.

Arithmetic on components rounds the same for one vector and for many, and runs along contiguous memory; products of
stacked 3 x 3 matrices do neither. A rotation is its three columns: the body's axes in world axes.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from controllers.laws.tracking import Array

Vector: TypeAlias = tuple[Array, Array, Array]
Axes: TypeAlias = tuple[Vector, Vector, Vector]
"""x, y and z axis of a body, each in world axes: the columns of its rotation matrix."""


def dot(a: Vector, b: Vector) -> Array:
    """a^T b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Compute a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(a: Vector, b: Vector) -> Vector:
    """Compute a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Vector, b: Vector) -> Vector:
    """Compute a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scaled(factor: float | Array, a: Vector) -> Vector:
    """factor a."""
    return factor * a[0], factor * a[1], factor * a[2]


def to_body(axes: Axes, a: Vector) -> Vector:
    """R^T a: a vector's components along the body's axes."""
    return dot(axes[0], a), dot(axes[1], a), dot(axes[2], a)


def to_world(axes: Axes, a: Vector) -> Vector:
    """R a: the world's components of a vector given along the body's axes."""
    return plus(plus(scaled(a[0], axes[0]), scaled(a[1], axes[1])), scaled(a[2], axes[2]))


def joined(a: tuple[Array, ...], xp: Any = np) -> Array:
    """Components as one array (..., n), each component contiguous."""
    if xp is not np:
        return xp.stack(a, axis=-1)
    columns = np.array(a)
    return columns.transpose((*range(1, columns.ndim), 0))
