"""Two equal rods that hang from a hinge and swing in a vertical plane, with a payload at the tip."""

import dataclasses
import math

import numpy as np

MASS, LENGTH, ROTOR, GRAVITY = 1.0, 0.4, 0.05, 9.81  # kg, m, kg m^2 at the joint, m/s^2
TORQUE = 30.0  # Nm, of each motor


@dataclasses.dataclass(frozen=True)
class Arm:
    """The arm; `mass`, `sites` and `joint_inertia` are what artde-gym asks for."""

    payload: float = 0.0  # kg
    mass: float = 2 * MASS
    sites: tuple[tuple[str, str, tuple[float, float, float]], ...] = (("tip", "forearm", (0.0, 0.0, -LENGTH)),)

    def joint_inertia(self, q):
        """Return the joint-space inertia (..., 2, 2) at angles q (..., 2), each from straight on."""
        near, far, coupled = self._inertias()
        cos = np.cos(np.asarray(q)[..., 1])
        off = far + coupled * cos
        rows = [[near + far + 2 * coupled * cos + ROTOR, off], [off, far + ROTOR + 0 * cos]]
        return np.moveaxis(np.array(rows), (0, 1), (-2, -1))

    def bias(self, q, qd):
        """Return the torques (2,) of centrifugal and Coriolis forces and of weight."""
        turn = self._inertias()[2] * math.sin(q[1])
        elbow = (MASS / 2 + self.payload) * GRAVITY * LENGTH * math.sin(q[0] + q[1])
        shoulder = (1.5 * MASS + self.payload) * GRAVITY * LENGTH * math.sin(q[0]) + elbow
        return np.array([shoulder - turn * (2 * qd[0] + qd[1]) * qd[1], elbow + turn * qd[0] ** 2])

    def points(self, q):
        """Return shoulder, elbow and tip (3, 2), x ahead and z up (m)."""
        angles = np.cumsum(q)
        return np.vstack([[0.0, 0.0], LENGTH * np.cumsum(np.stack([np.sin(angles), -np.cos(angles)], axis=-1), axis=0)])

    def _inertias(self):
        tip = self.payload
        return (MASS / 3 + MASS + tip) * LENGTH**2, (MASS / 3 + tip) * LENGTH**2, (MASS / 2 + tip) * LENGTH**2
