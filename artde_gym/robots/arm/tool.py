"""Position of an arm's tool, and how it moves with the joints."""

from __future__ import annotations

import numpy as np

from artde_gym.arrays import Array
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.multibody.manipulator import TOOL
from artde_gym.multibody.spec import RobotSpec


class Tool:
    """Forward kinematics of the tool's position."""

    def __init__(self, spec: RobotSpec) -> None:
        self._tree = RigidBodyTree(spec)
        _, self._link, point = next(site for site in spec.sites if site[0] == TOOL)
        self._body = [part.name for part in spec.links].index(self._link)
        self._point = np.asarray(point)

    def position(self, q: Array) -> Array:
        """Return the position (..., 3) (m) at joint positions (..., n)."""
        frames = self._tree.frames(q)
        return frames.origin[..., self._body, :] + frames.rot[..., self._body, :, :] @ self._point

    def jacobian(self, q: Array) -> Array:
        """Return its derivative by the joint positions (3, n) at `q` (n,)."""
        columns = self._tree.jacobian(self._link, q)[:, 6:]
        arm = self._tree.rotation(self._link, q) @ self._point
        return columns[:3] + np.cross(columns[3:], arm, axis=0)
