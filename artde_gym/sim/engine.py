"""What an environment asks of a physics engine."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.robots.spec import RobotSpec, Vector

PAYLOAD_RADIUS = 0.08  # m, of the homogeneous ball


class State(NamedTuple):
    """One robot at one instant; positions and velocities are those of the base link's origin, in world axes.

    `q`, `qd` (n,) are the actuated joints in the order of the spec (rad, rad/s).
    """

    q: Array
    qd: Array
    position: Vector
    quat_xyzw: tuple[float, float, float, float]
    velocity: Vector
    angular_velocity: Vector


class Camera(NamedTuple):
    """A camera that looks at `target` (m) from `distance` (m), `yaw_deg` about z and `pitch_deg` above the horizon."""

    target: Vector
    distance: float = 1.9
    yaw_deg: float = 55.0
    pitch_deg: float = 12.0
    width: int = 640
    height: int = 480


class Engine(Protocol):
    """One robot on flat, level ground. Joints that the spec does not actuate are held at zero.

    Ground friction is the coefficient of the *pair* foot and ground, whatever the engine's rule of combination.
    """

    spec: RobotSpec
    time_step: float

    def place(self, position: Vector, q: Array) -> None:
        """Put the upright robot with its base origin at `position` (m) and the joints at `q`, all at rest."""
        ...

    def snapshot(self) -> int:
        """Remember the whole state, contacts and solver memory included; returns a handle."""
        ...

    def restore(self, snapshot: int) -> None:
        """Return to a snapshot, bit for bit; a payload attached since is gone."""
        ...

    def read(self) -> State:
        """The state now."""
        ...

    def base_twist(self) -> tuple[Vector, Vector]:
        """Velocity of the base link's origin (m/s) and angular velocity (rad/s), world axes: a cheap part of `read`."""
        ...

    def step(self, tau: Array) -> None:
        """Advance one `time_step` under joint torques `tau` (n,) (Nm)."""
        ...

    def push_base(self, force: Vector, torque: Vector, *, body_axes: bool) -> None:
        """Add a force (N) at the base link's centre of mass and a torque (Nm), for the next step only.

        Both along the base's own axes or along the world's.
        """
        ...

    def push(self, site: str, force: Vector) -> None:
        """Add a force (N, world axes) at a named site of the spec, for the next step only."""
        ...

    def foot_loads(self) -> tuple[float, ...]:
        """Normal force of the ground on each foot during the last step (N)."""
        ...

    def ground_forces(self) -> Array:
        """Whole force of the ground on each foot during the last step, (feet, 3) (N, world axes)."""
        ...

    def set_friction(self, coefficient: float) -> None:
        """Set the friction coefficient of feet and ground."""
        ...

    def set_gravity(self, gravity: Vector) -> None:
        """Set the acceleration of free fall (m/s^2, world axes)."""
        ...

    def scale_masses(self, factor: float) -> None:
        """Set mass and inertia of every link to so many times the spec's."""
        ...

    def attach_payload(self, mass: float, position: Vector) -> None:
        """Fix a ball of `mass` (kg) and `PAYLOAD_RADIUS` to the base link, its centre at `position` in its frame (m).

        It takes over the base's motion, and falls freely once released.
        """
        ...

    def release_payload(self) -> None:
        """Let go of the payload, if there is one."""
        ...

    def render(self, camera: Camera) -> NDArray[np.uint8]:
        """A picture, (height, width, 3)."""
        ...

    def close(self) -> None:
        """Free the engine; safe to call twice."""
        ...
