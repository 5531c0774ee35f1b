"""An engine with a load on a cable under its robot, which is one rigid body.

The engine knows nothing of the load: it is a point mass of this module's own, and the tension of `artde_gym.sim.cable`
acts on the base as any outer force does. So every engine has the same cable, and no model is built anew.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.errors import RobotError
from artde_gym.kit import PAYLOAD
from artde_gym.multibody.dynamics import GRAVITY
from artde_gym.multibody.spec import Vector
from artde_gym.sim.cable import FLOATS, Body, Load, cross, dot, drag, minus, plus, pull, scaled, times, transposed_times
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import Engine, State
from artde_gym.sim.rotation import matrix, point_velocity

NOTHING: Vector = (0.0, 0.0, 0.0)
CURVE = 48  # pieces of a cable in pictures


class _Hanging(NamedTuple):
    """Constants of a load: mass (kg), the hook's place from the center of mass (m), length (m)."""

    mass: float
    hook: Vector
    length: float


class Sling:
    """An engine whose robot may have a load on a cable; all that is not said here is the engine's own.

    Args:
        engine: with a robot of one link.

    Attributes:
        wind: velocity of the air at the load (m/s), world axes.
        tension: of the cable during the last step (N).
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._factor = 1.0  # of the masses
        self._sites = {name: place for name, _, place in engine.spec.sites}
        self._clear()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # what copies look for before there is anything
            raise AttributeError(name)
        return getattr(self._engine, name)

    def _clear(self) -> None:
        self._hanging: _Hanging | None = None
        self._fixed: Vector | None = None  # where a payload without a cable is
        self.held = False
        self._position = self._velocity = self._pushed = self.wind = NOTHING
        self._force, self._torque = NOTHING, NOTHING  # on the base in the next step: world axes, body axes
        self.tension = 0.0

    def reset(self, position: Vector, q: Array) -> None:
        """See `artde_gym.sim.engine.Engine`; a load is gone, as in `restore`."""
        self._clear()
        self._engine.reset(position, q)

    def restore_state(self, snapshot: int) -> None:
        self._clear()
        self._engine.restore_state(snapshot)

    def scale_masses(
        self, factor: float, links: Mapping[str, float] = MappingProxyType({}), armature: float = 1.0
    ) -> None:
        self._factor = factor
        self._engine.scale_masses(factor, links, armature)

    def attach_payload(self, mass: float, position: Vector) -> None:
        self._clear()
        self._fixed = position
        self._engine.attach_payload(mass, position)

    def hang_payload(self, mass: float, hook: Vector, length: float) -> None:
        """Hang a load of `mass` (kg) straight below a hook (m, base frame) on a cable (m), moving as the hook does.

        Raises:
            RobotError: for a robot of several links.
        """
        if len(self._engine.spec.links) != 1:
            raise RobotError("links", len(self._engine.spec.links), "1, to hang a load under")
        self._clear()
        self._hanging = _Hanging(mass, minus(hook, self._engine.spec.base.com), length)
        self.held = True
        point, velocity = self.hook(self._engine.state())
        self._position, self._velocity = minus(point, (0.0, 0.0, length)), velocity

    def release_payload(self) -> None:
        self.held, self._fixed, self.tension = False, None, 0.0
        self._engine.release_payload()

    def apply_force(self, site: str, force: Vector) -> None:
        """See `artde_gym.sim.engine.Engine`; the site `payload` is that of whatever payload there is, if any."""
        if site == PAYLOAD:
            self._push_payload(force)
            return
        self._engine.apply_force(site, force)
        if self._hanging is not None and site in self._sites:
            self._add(force, self._moment(self._sites[site], force))

    def apply_base_wrench(self, force: Vector, torque: Vector) -> None:
        self._engine.apply_base_wrench(force, torque)
        if self._hanging is not None:
            self._add(times(self._rot(), force), torque)

    def apply_world_wrench(self, force: Vector, torque: Vector) -> None:
        self._engine.apply_world_wrench(force, torque)
        if self._hanging is not None:
            self._add(force, transposed_times(self._rot(), torque))

    def step(self, tau: Array) -> None:
        if self._hanging is not None:
            self._advance(self._hanging)
        self._engine.step(tau)

    def state(self) -> State:
        return self._engine.state()

    @property
    def moved(self) -> Engine:
        """The engine to apply wrenches to and to step: without a cable, the robot's own."""
        return self._engine if self._hanging is None else cast(Engine, self)

    def site(self, name: str) -> Vector:
        if name != PAYLOAD:
            return self._engine.site(name)
        return self.payload_position() or self._engine.state().position

    def payload_position(self) -> Vector | None:
        return self._engine.payload_position() if self._hanging is None else self._position

    def hook(self, state: State) -> tuple[Vector, Vector]:
        """Place and velocity of the hook (m, m/s), world axes, in a state of the robot."""
        hook = NOTHING if self._hanging is None else plus(self._hanging.hook, self._engine.spec.base.com)
        arm = times(matrix(state.quat_xyzw), hook)
        return plus(state.position, arm), point_velocity(state.velocity, state.angular_velocity, arm)

    def cable(self, state: State) -> tuple[Vector, Vector]:
        """Vector from the hook to the load (m) and its rate (m/s), world axes; zeros while nothing hangs."""
        if not self.held:
            return NOTHING, NOTHING
        point, velocity = self.hook(state)
        return minus(self._position, point), minus(self._velocity, velocity)

    @property
    def length(self) -> float:
        """Length of the cable (m); 0 while nothing hangs."""
        return self._hanging.length if self._hanging is not None and self.held else 0.0

    def curve(self) -> list[Vector]:
        """Points of the cable from the hook to the load (m), a parabola where it is slack; none while nothing hangs."""
        if not self.held:
            return []
        (x, y, z), _ = self.hook(self._engine.state())
        r = minus(self._position, (x, y, z))
        free = max(self.length - math.sqrt(dot(r, r)), 0.0)
        sag = math.sqrt(0.375 * free * self.length)  # of a shallow parabola that is so much longer than its chord
        along = [i / CURVE for i in range(CURVE + 1)]
        return [(x + s * r[0], y + s * r[1], z + s * r[2] - 4.0 * sag * s * (1.0 - s)) for s in along]

    def load_error(self, reference: Vector) -> Vector:
        """From where the load is to where it would hang at rest under a vehicle at `reference` (m)."""
        if self._hanging is None or not self.held:
            return NOTHING
        hook = plus(self._hanging.hook, self._engine.spec.base.com)
        return minus(plus(reference, minus(hook, (0.0, 0.0, self._hanging.length))), self._position)

    def render(self, camera: Camera) -> NDArray[np.uint8]:
        if self._hanging is None:
            return self._engine.render(camera)
        return self._engine.render(camera, self._position)

    def _push_payload(self, force: Vector) -> None:
        if self._hanging is not None:
            self._pushed = plus(self._pushed, force)
        elif self._fixed is not None:
            place = minus(self._fixed, self._engine.spec.base.com)
            self._engine.apply_world_wrench(
                force, times(self._rot(), cross(place, transposed_times(self._rot(), force)))
            )

    def _moment(self, place: Vector, force: Vector) -> Vector:
        """Torque of a force (world axes) at a site about the center of mass, body axes."""
        return cross(minus(place, self._engine.spec.base.com), transposed_times(self._rot(), force))

    def _add(self, force: Vector, torque: Vector) -> None:
        self._force, self._torque = plus(self._force, force), plus(self._torque, torque)

    def _rot(self) -> tuple[float, float, float, float, float, float, float, float, float]:
        return matrix(self._engine.state().quat_xyzw)

    def _advance(self, hanging: _Hanging) -> None:
        """Move the load by a step, and let the cable pull at both ends."""
        step, inverse_mass = self._engine.time_step, 1.0 / hanging.mass
        air = minus(self.wind, self._velocity)
        force = plus(self._pushed, scaled(drag(self.wind, self._velocity, inverse_mass, step, FLOATS.root), air))
        velocity = plus(self._velocity, scaled(step * inverse_mass, force))
        velocity = minus(velocity, (0.0, 0.0, step * GRAVITY))
        if self.held:
            body, load = self._body(step), Load(inverse_mass, self._position, velocity)
            found = pull(body, load, hanging.hook, hanging.length, step, FLOATS)
            self.tension = found.tension
            self._engine.apply_base_wrench(scaled(found.tension, found.in_body), scaled(found.tension, found.moment))
            velocity = minus(velocity, scaled(step * inverse_mass * found.tension, found.direction))
        self._velocity, self._position = velocity, plus(self._position, scaled(step, velocity))
        self._force = self._torque = self._pushed = NOTHING

    def _body(self, step: float) -> Body[float]:
        """Return the base with the velocities that the next step gives it without the cable."""
        base, state = self._engine.spec.base, self._engine.state()
        rot = matrix(state.quat_xyzw)
        mass = self._factor * base.mass
        x, y, z = base.inertia
        inertia = (self._factor * x, self._factor * y, self._factor * z)
        inverse = (1.0 / inertia[0], 1.0 / inertia[1], 1.0 / inertia[2])
        arm = times(rot, base.com)
        velocity = point_velocity(state.velocity, state.angular_velocity, arm)
        velocity = minus(plus(velocity, scaled(step / mass, self._force)), (0.0, 0.0, step * GRAVITY))
        rates = transposed_times(rot, state.angular_velocity)
        torque = minus(self._torque, cross(rates, _each(inertia, rates)))
        rates = plus(rates, scaled(step, _each(inverse, torque)))
        return Body(1.0 / mass, inverse, rot, plus(state.position, arm), velocity, rates)


def _each(a: Vector, b: Vector) -> Vector:
    """Multiply components."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]
