"""Loads on cables under many rigid bodies at once, on the steps of `artde_gym.sim.rigid_bodies`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from artde_gym.arrays import Array
from artde_gym.multibody.dynamics import GRAVITY
from artde_gym.multibody.spec import Vector
from artde_gym.sim.cable import ARRAYS, Body, Load, drag, pull
from artde_gym.sim.rigid_bodies import ALL, RigidBodies, cross, times

FREE = 1e3  # m, of the cable that never pulls where nothing hangs


class Cables:
    """Loads of `n` bodies, of which any may have one; a body along whose axes its inertia is not diagonal has none.

    Positions in the middle of steps keep the cables' lengths, to rounding.

    Attributes:
        position, velocity: of the loads (3, n) (m, m/s), world axes; hanging, or falling since their release.
        held: whether a load hangs on a body (n,).
        tension: of each cable during the last step (n,) (N).
    """

    def __init__(self, n: int, dtype: DTypeLike) -> None:
        self.position, self.velocity = np.zeros((3, n), dtype), np.zeros((3, n), dtype)
        self.held = np.zeros(n, np.bool_)
        self.tension = np.zeros(n, dtype)
        self.length = np.full(n, FREE, dtype)
        self._hook = np.zeros((3, n), dtype)  # in the body's frame
        self._inverse_mass = np.ones(n, dtype)
        self._gravity = np.zeros(n, dtype)
        self._still = np.zeros((3, n), dtype)  # air

    def clear(self, body: int | NDArray[np.intp]) -> None:
        """Take the loads of one body or several away."""
        self.release(body)
        self.position[:, body] = self.velocity[:, body] = self._gravity[body] = 0.0

    def hang(self, body: int, bodies: RigidBodies, mass: float, hook: Vector, length: float) -> None:
        """Hang a load of `mass` (kg) straight below a hook (m, body frame), moving as the hook does."""
        self._hook[:, body] = hook
        self.length[body], self._inverse_mass[body] = length, 1.0 / mass
        self._gravity[body], self.held[body] = GRAVITY, True
        own = slice(body, body + 1)
        self.position[:, body] = self._hooks(bodies, own)[:, 0] - (0.0, 0.0, length)
        self.velocity[:, body] = self._hook_velocities(bodies, own)[:, 0]

    def release(self, body: int | NDArray[np.intp]) -> None:
        """Let go of the loads of one body or several, which fall from now on."""
        self.held[body] = False
        self.length[body], self.tension[body] = FREE, 0.0

    def motion(self) -> tuple[Array, ...]:
        """Return the arrays that a step changes, bodies along the last axis."""
        return self.position, self.velocity, self.tension

    def relative(self, bodies: RigidBodies) -> tuple[Array, Array]:
        """Vectors from the hooks to the loads (3, n) (m), world axes, and their rates (m/s)."""
        return self.position - self._hooks(bodies), self.velocity - self._hook_velocities(bodies)

    def load_error(self, reference: Array) -> Array:
        """From where the loads are to where they would hang at rest under vehicles at `reference` (3, n) (m)."""
        error = reference + self._hook - self.position
        error[2] -= self.length
        return np.where(self.held, error, 0.0)

    def drift(self, duration: float) -> None:
        """Move along the velocities for `duration` (s)."""
        self.position += duration * self.velocity

    def kick(self, bodies: RigidBodies, duration: float, force: Array, wind: Array | None) -> None:
        """Change velocities by a `force` (3, n) (N) on the loads, gravity, air that moves at `wind`, and the cables.

        It comes right after the bodies' own kick.
        """
        air = self._still if wind is None else wind
        factor = drag(_each(air), _each(self.velocity), self._inverse_mass, duration, np.sqrt)
        factor = np.where(self._gravity > 0, factor, 0.0)
        self.velocity += (duration * self._inverse_mass) * (force + factor * (air - self.velocity))
        self.velocity[2] -= duration * self._gravity
        self._constrain(bodies, duration)

    def _constrain(self, bodies: RigidBodies, duration: float) -> None:
        inverse_inertia = bodies.principal_inverse_inertia()
        motion = (bodies.rot.reshape(9, -1), bodies.com, bodies.com_velocity, bodies.rates)
        body = Body(bodies.inverse_mass, _each(inverse_inertia), *map(_each, motion))
        load = Load(self._inverse_mass, _each(self.position), _each(self.velocity))
        found = pull(body, load, _each(self._hook - bodies.arm), self.length, duration, ARRAYS)
        taut = self.held & (found.tension > 0)
        np.copyto(self.tension, np.where(taut, found.tension, 0.0))
        along = self.tension * np.stack(found.direction)
        np.subtract(self.velocity, (duration * self._inverse_mass) * along, out=self.velocity, where=taut)
        turning = self.tension * (inverse_inertia * np.stack(found.moment))
        bodies.add_kick(duration, bodies.inverse_mass * along, turning, taut)

    def _hooks(self, bodies: RigidBodies, some: slice = ALL) -> Array:
        arm = self._hook[:, some] - bodies.arm[:, some]
        return bodies.com[:, some] + times(bodies.rot[..., some], arm)

    def _hook_velocities(self, bodies: RigidBodies, some: slice = ALL) -> Array:
        arm = self._hook[:, some] - bodies.arm[:, some]
        return bodies.com_velocity[:, some] + times(bodies.rot[..., some], cross(bodies.rates[:, some], arm))


def _each(rows: Array) -> Any:
    """Return the rows of an array, one by one."""
    return tuple(rows)
