"""What an environment asks of a physics engine."""

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
    """One robot at one instant; positions and velocities are those of the base link's origin, in world axes.

    `q`, `qd` (n,) are the actuated joints in the order of the spec (rad, rad/s).
    """

    q: Array
    qd: Array
    position: Vector
    quat_xyzw: Quaternion
    velocity: Vector
    angular_velocity: Vector


PAYLOAD_RADIUS = 0.08  # m, of the homogeneous ball that is the payload
PAYLOAD_LOOK = 0.09  # m, likewise in pictures, so that it shows on either side of Ojas' torso
PAYLOAD_COLOR = (0.85, 0.45, 0.1, 1.0)


class World(Protocol):
    """What happens to one robot from outside; gravity, friction and masses stay as they were set."""

    def apply_force(self, site: str, force: Vector) -> None:
        """Add a force (N, world axes) at a named site of the spec, where it is now, for the next step only.

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
        """Add upward forces (N) at the centers of mass of the feet, one a foot, for the next step only."""
        ...

    def foot_loads(self) -> tuple[float, ...]:
        """Normal force of the ground on each foot during the last step (N): z of `ground_forces`, and cheaper."""
        ...

    def set_friction(self, coefficient: float) -> None:
        """Set the coefficient of Coulomb friction of the pair foot and ground, from the next step on.

        Of the *pair*: whatever rule the engine has to combine coefficients of two bodies.
        """
        ...

    def set_gravity(self, gravity: Vector) -> None:
        """Set the acceleration of free fall (m/s^2, world axes)."""
        ...

    def scale_masses(
        self, factor: float, links: Mapping[str, float] = MappingProxyType({}), armature: float = 1.0
    ) -> None:
        """Set mass and inertia of every link, and armature, to `factor` times the spec's; a payload keeps its own.

        Args:
            factor: of everything.
            links: name -> further factor of a link's mass and inertia; 1 for any other.
            armature: further factor of the armature.
        """
        ...

    def set_contact_time(self, time: float | None) -> None:
        """Set the time constant (s) with which the ground pushes a foot out; None for the engine's own.

        MuJoCo: of its soft contacts, which are critically damped (its own is 0.005 s). Bullet: one time step over the
        share of the depth that it corrects in each (its own is 0.0125 s).
        """
        ...

    def attach_payload(self, mass: float, position: Vector) -> None:
        """Fix a ball of `mass` (kg) and `PAYLOAD_RADIUS` to the base link, its center at `position` in its frame (m).

        It takes over the base's motion, touches nothing, and falls freely, also through the ground, once released. A
        former payload is gone.
        """
        ...

    def release_payload(self) -> None:
        """Let go of the payload, if there is one."""
        ...


class Engine(World, Protocol):
    """One robot on flat, level ground, which only the spec's collision shapes touch.

    Its parts pass through each other, unless the spec says that its feet do not.

    A copy (`copy.deepcopy`, `pickle`) is a world of its own that goes on as the copied one would, bit for bit.

    Joints that the spec does not actuate are held at zero. Gravity and masses stay as they were set, whatever is placed
    or restored afterwards; they start at 9.81 m/s^2 downward and at the spec's. Friction has no default: set it.
    """

    name: str
    spec: RobotSpec
    time_step: float

    def reset(self, position: Vector, q: Array) -> None:
        """Put the upright robot with its base origin at `position` (m) and the joints at `q`, all at rest.

        A payload is gone. The ground is felt from the next step on.
        """
        ...

    def save_state(self) -> int:
        """Remember the whole state of a robot without a payload; returns a handle.

        That is what `state`, `foot_loads` and `ground_forces` say, what the solver remembers, and the friction.
        """
        ...

    def restore_state(self, snapshot: int) -> None:
        """Return to a snapshot, bit for bit; a payload attached since is gone.

        Forces must not be pending: whether a push that no step has taken up yet survives is up to the engine.
        """
        ...

    def state(self) -> State:
        """The state now: after the last step, or as placed or restored. Later steps do not change what was read."""
        ...

    def step(self, tau: Array) -> None:
        """Advance one `time_step` under joint torques `tau` (n,) (Nm)."""
        ...

    def apply_base_wrench(self, force: Vector, torque: Vector) -> None:
        """Add a force (N) at the base link's own center of mass and a torque (Nm), for the next step only.

        Both along the base's axes, as they are now; a payload does not move their point of action.
        """
        ...

    def site(self, name: str) -> Vector:
        """Where a named site of the spec is now (m, world axes).

        Raises:
            RobotError: for a site that the spec does not have.
        """
        ...

    def payload_position(self) -> Vector | None:
        """Where the payload's center is now (m, world axes), held or falling; None without one."""
        ...

    def ground_forces(self) -> Array:
        """Whole force of the ground on each foot during the last step, (feet, 3) (N, world axes)."""
        ...

    def render(self, camera: Camera, load: Vector | None = None) -> NDArray[np.uint8]:
        """A picture, (height, width, 3), of robot and payload on the ground of `artde_gym.sim.ground`.

        It changes nothing. `load` is where the payload is in place of the engine's own (m), such as one on a cable.

        Raises:
            OptionError: where the engine cannot draw on this machine.
        """
        ...

    def close(self) -> None:
        """Free the engine; safe to call twice."""
        ...
