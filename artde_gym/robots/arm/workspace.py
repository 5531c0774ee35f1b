"""Inertia and weight of an arm over its workspace."""

from __future__ import annotations

import functools
import math

import numpy as np

from artde_gym.arrays import Array
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.spec import RobotSpec

POSES, SEED = 500, 0


@functools.lru_cache(maxsize=8)
def workspace(spec: RobotSpec) -> Array:
    """Return random poses (poses, n) within the limits, the same for each call."""
    limits = np.array([spec.by_name[name].limits for name in spec.actuated])
    low = np.where(np.isfinite(limits[:, 0]), limits[:, 0], -math.pi)
    high = np.where(np.isfinite(limits[:, 1]), limits[:, 1], math.pi)
    return np.random.default_rng(SEED).uniform(low, high, (POSES, len(limits)))


@functools.lru_cache(maxsize=8)
def workspace_inertia(spec: RobotSpec) -> Array:
    """Return M (poses, n, n) over the workspace."""
    return RigidBodyTree(spec).joint_mass_matrix(workspace(spec))


def largest_weight(spec: RobotSpec) -> Array:
    """Return the largest torque (n,) (Nm or N) that holds each joint at rest over the workspace."""
    q = workspace(spec)
    return np.abs(RigidBodyTree(spec).joint_torques(q, 0 * q, 0 * q)).max(axis=0)


def smallest_inertia(spec: RobotSpec) -> Array:
    """Return min 1 / [M(q)^-1]_ii of each joint over the workspace (n,) (kg m^2 or kg): what it meets alone."""
    inverse = np.linalg.inv(workspace_inertia(spec))
    return (1.0 / np.diagonal(inverse, axis1=1, axis2=2)).min(axis=0)
