"""Joint torques of a walking robot from its motion, without measured ground forces.

A foot that rests level on the ground determines the base's velocity, v_base = -J_base^-1 J_joints qd. Inverse dynamics
of that motion gives the wrench (F, N) of the ground; in single support it acts on one foot. In double support its
distribution is not unique: foot i carries the share w_i of the force, at the center c_i of its sole, and the share w_i
of the remaining moment about c = sum_i w_i c_i. Then the feet do not work against each other, and a body balanced over
c leaves no moment.

    tau = ID_joints - sum_i J_i^T [w_i F; w_i (N - c x F) about c_i]
"""

from __future__ import annotations

import numpy as np

from artde_gym.arrays import Array
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.spec import RobotSpec


class Supported:
    """Inverse dynamics of a robot on its feet; see `torque`."""

    def __init__(self, spec: RobotSpec) -> None:
        self._tree = RigidBodyTree(spec)
        self._feet = spec.feet
        self._soles = [np.asarray(spec.sole(foot)) for foot in spec.feet]

    def torque(self, load_left: float | Array, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the joint torques (..., n) (Nm) of the motion q, qd, qdd (..., n).

        Args:
            load_left: share of the weight on the left (first) foot (...), 0 to 1.
        """
        tree, left = self._tree, np.asarray(load_left, dtype=np.float64)[..., None]
        rotations = [tree.rotation(foot, q) for foot in self._feet]
        level = np.where(left[..., None] >= 0.5, rotations[0], rotations[1])
        rot = np.swapaxes(level, -1, -2)  # base to world: the axes of a level foot are the world's
        shares = (left, 1.0 - left)

        jacobians = [tree.jacobian(foot, q, rot) for foot in self._feet]
        velocity, acceleration = np.zeros((2, *q.shape[:-1], 6))
        for share, jacobian in zip(shares, jacobians, strict=True):
            velocity = velocity - share * _solve(jacobian[..., :6], jacobian[..., 6:] @ qd[..., None])
        for share, jacobian, foot in zip(shares, jacobians, self._feet, strict=True):
            drift = tree.bias_acceleration(foot, q, qd, velocity, rot)[..., None] + jacobian[..., 6:] @ qdd[..., None]
            acceleration = acceleration - share * _solve(jacobian[..., :6], drift)

        needed = tree.inverse_dynamics(q, qd, qdd, velocity, acceleration, rot)
        force, moment, torque = needed[..., :3], needed[..., 3:6], needed[..., 6:]
        arms = [(rot @ rotation @ sole) for rotation, sole in zip(rotations, self._soles, strict=True)]
        ankles = [tree.position(foot, q, rot) for foot in self._feet]
        center = sum(share * (ankle + arm) for share, ankle, arm in zip(shares, ankles, arms, strict=True))
        left_over = moment - np.cross(center, force)
        for share, jacobian, arm in zip(shares, jacobians, arms, strict=True):
            wrench = np.concatenate([share * force, share * (left_over + np.cross(arm, force))], axis=-1)
            torque = torque - (np.swapaxes(jacobian[..., 6:], -1, -2) @ wrench[..., None])[..., 0]
        return torque


def _solve(matrix: Array, column: Array) -> Array:
    return np.linalg.solve(matrix, column)[..., 0]
