"""Protocols of physics engines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.camera import Camera
from artde_gym.sim.rotation import Quaternion


class State(NamedTuple):
    """The state of one robot; positions and velocities are those of the base link's origin, in world axes.

    `q`, `qd` (n,) are the actuated joints in the order of the spec (rad, rad/s).
    """

    q: Array
    qd: Array
    position: Vector
    quat_xyzw: Quaternion
    velocity: Vector
    angular_velocity: Vector


AT_ORIGIN = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
"""Position, attitude and velocities of a fixed base."""
PAYLOAD_RADIUS = 0.08  # m, of the payload, a homogeneous ball
PAYLOAD_LOOK = 0.09  # m, its radius in rendered images, so that it is visible on either side of Ojas' torso
PAYLOAD_COLOR = (0.85, 0.45, 0.1, 1.0)


class World(Protocol):
    """The external influences on one robot; gravity, friction and masses keep their values until changed."""

    def apply_force(self, site: str, force: Vector) -> None:
        """Add a force (N, world axes) at the current position of a named site of the spec, for the next step only.

        Raises:
            RobotError: for a site that the spec does not have.
        """
        ...

    def apply_world_wrench(self, force: Vector, torque: Vector) -> None:
        """Add a force (N) at the base link's own center of mass and a torque (Nm), world axes, for the next step only.

        A payload does not move their point of action.
        """
        ...

    def lift_feet(self, forces: Sequence[float]) -> None:
        """Add upward forces (N), one per foot, at the centers of mass of the feet, for the next step only."""
        ...

    def foot_loads(self) -> tuple[float, ...]:
        """Return the normal force of the ground on each foot in the last step (N): z of `ground_forces`, but faster."""
        ...

    def set_friction(self, coefficient: float) -> None:
        """Set the coefficient of Coulomb friction between feet and ground, from the next step on.

        It is that of the *pair*, whatever the engine's rule for combining coefficients of two bodies.
        """
        ...

    def set_gravity(self, gravity: Vector) -> None:
        """Set the gravitational acceleration (m/s^2, world axes)."""
        ...

    def scale_masses(
        self, factor: float, links: Mapping[str, float] = MappingProxyType({}), armature: float = 1.0
    ) -> None:
        """Set mass and inertia of every link, and armature, to `factor` times the spec's; a payload keeps its own.

        Args:
            factor: factor of all masses, inertias and armatures.
            links: name -> additional factor of a link's mass and inertia; 1 for any other.
            armature: additional factor of the armature.
        """
        ...

    def set_contact_time(self, time: float | None) -> None:
        """Set the time constant (s) with which the ground pushes a foot out; None for the engine's default.

        MuJoCo: that of its critically damped soft contacts (default 0.005 s). Bullet: one time step divided by the
        share of the penetration depth that is corrected per step (default 0.0125 s).
        """
        ...

    def attach_payload(self, mass: float, position: Vector) -> None:
        """Fix a ball of `mass` (kg) and `PAYLOAD_RADIUS` to a link, its center at `position` in its frame (m).

        The link is the base or the spec's `carrier`. The ball has its velocity, collides with nothing, and falls
        freely, even through the ground, once released. It replaces a previous payload.
        """
        ...

    def release_payload(self) -> None:
        """Release the payload, if there is one."""
        ...


class Engine(World, Protocol):
    """One robot on flat, level ground, which only the spec's collision shapes touch.

    Its parts pass through each other, unless the spec makes its feet collide.

    A copy (`copy.deepcopy`, `pickle`) is an independent world that steps bitwise like the original.

    Unactuated joints are held at zero. Gravity and masses keep their values through `reset` and `restore_state`; they
    start at 9.81 m/s^2 downward and at the spec's. Friction has no default: set it.
    """

    name: str
    spec: RobotSpec
    time_step: float

    def reset(self, position: Vector, q: Array) -> None:
        """Put the upright robot with its base origin at `position` (m) and the joints at `q`, all at rest.

        A fixed base stays at the origin.

        A payload is removed. Contact forces begin with the next step.
        """
        ...

    def save_state(self) -> int:
        """Save the whole state of a robot without a payload; return a handle.

        It contains `state`, `foot_loads`, `ground_forces`, the solver's warm start and the friction.
        """
        ...

    def restore_state(self, snapshot: int) -> None:
        """Restore a saved state bitwise; a payload attached since is removed.

        No forces may be pending: engines differ in whether a push before the next step survives.
        """
        ...

    def state(self) -> State:
        """Return the current state: after the last step, reset or restore. Later steps do not change it."""
        ...

    def step(self, tau: Array) -> None:
        """Advance one `time_step` under joint torques `tau` (n,) (Nm)."""
        ...

    def apply_base_wrench(self, force: Vector, torque: Vector) -> None:
        """Add a force (N) at the base link's own center of mass and a torque (Nm), for the next step only.

        Both in the base's current axes; a payload does not move their point of action.
        """
        ...

    def site(self, name: str) -> Vector:
        """Return the current position of a named site of the spec (m, world axes).

        Raises:
            RobotError: for a site that the spec does not have.
        """
        ...

    def payload_position(self) -> Vector | None:
        """Return the current position of the payload's center (m, world axes), held or falling; None without one."""
        ...

    def ground_forces(self) -> Array:
        """Return the total force of the ground on each foot in the last step, (feet, 3) (N, world axes)."""
        ...

    def render(self, camera: Camera, load: Vector | None = None) -> NDArray[np.uint8]:
        """Render an image (height, width, 3) of robot and payload on the ground of `artde_gym.sim.ground`.

        This does not change the state. `load` (m) replaces the engine's own payload, for one on a cable.

        Raises:
            OptionError: if the engine cannot render on this machine.
        """
        ...

    def close(self) -> None:
        """Free the engine; safe to call twice."""
        ...
