"""Rigid-body dynamics of a `RobotSpec` in NumPy, batched over leading axes.

A tree with generalized velocity v = [v_base; w_base; qd], all base quantities in world axes at the base
link's origin:

    M(q) dv/dt + h(q, v) = [wrench on the base; tau]

Every sum runs over the moving links b with Jacobians J_v,b of the center of mass and J_w,b of the rotation:

    M   = sum_b  m_b J_v^T J_v + J_w^T I_b J_w
    tau = sum_b  J_v^T m_b (a_b + g z) + J_w^T (I_b alpha_b + w_b x I_b w_b)

the second one as Newton-Euler sums over the links that each joint carries. Of a robot whose base is fixed, only the
joints' part matters: `joint_mass_matrix` and `joint_torques`. Rotor links follow their gear, so that `n`
counts only independent joints. Source: Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 2 and 5; the form
with explicit Jacobians is Siciliano et al., Robotics (2009), section 7.2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from artde_gym.arrays import Array
from artde_gym.errors import RobotError
from artde_gym.multibody.spec import RobotSpec

GRAVITY = 9.81  # m/s^2


class Frames(NamedTuple):
    """Frames of the moving links, in world axes with the base origin at zero.

    `rot` (..., b, 3, 3) maps link coordinates to world ones, `origin` and `com` are (..., b, 3), `axis`
    (..., b - 1, 3) holds the joint axes of all links but the base.
    """

    rot: Array
    origin: Array
    com: Array
    axis: Array


class RigidBodyTree:
    """Kinematics and dynamics of one robot; `joints` names the independent joints in the order of `q`."""

    def __init__(self, spec: RobotSpec) -> None:
        links = spec.merged().links
        self._index = {link.name: b for b, link in enumerate(links)}
        self._mass = np.array([link.mass for link in links])
        self._com = np.array([link.com for link in links])
        self._inertia = np.array([link.tensor for link in links])
        moving = links[1:]
        self._parent = [0] + [self._index[str(link.parent)] for link in moving]
        self._offset = np.array([link.origin for link in moving]).reshape(-1, 3)
        self._axis = np.array([link.axis for link in moving], dtype=np.float64).reshape(-1, 3)
        at_zero = [np.eye(3) if link.rotation is None else np.array(link.rotation) for link in moving]
        self._at_zero = None if all(link.rotation is None for link in moving) else np.array(at_zero)
        self._slides = np.array([link.prismatic for link in moving], dtype=np.bool_)
        self._sliding = bool(self._slides.any())
        self._supports = np.zeros((len(links), len(moving)))  # [b, j]: joint j moves link b
        for b in range(1, len(links)):
            self._supports[b] = self._supports[self._parent[b]]
            self._supports[b, b - 1] = 1.0

        rotors = {gear.rotor: gear for gear in spec.gears}
        self.joints = tuple(link.name for link in moving if link.name not in rotors)
        self._transmission = np.zeros((len(moving), len(self.joints)))  # tree joint rates = S qd
        for row, link in enumerate(moving):
            gear = rotors.get(link.name)
            column = self.joints.index(gear.driven if gear else link.name)
            self._transmission[row, column] = gear.ratio if gear else 1.0
        self._armature = np.zeros(len(self.joints))
        for name, armature in zip(spec.actuated, spec.armature, strict=True):
            self._armature[self.joints.index(name)] = armature
        self.mass = float(self._mass.sum())

    @property
    def n(self) -> int:
        """Number of independent joints."""
        return len(self.joints)

    def frames(self, q: Array, rot_base_to_world: Array | None = None) -> Frames:
        """Compute forward kinematics of joint positions `q` (..., n) (rad or m)."""
        angles = q @ self._transmission.T
        bodies = len(self._mass)
        rot = np.empty((*q.shape[:-1], bodies, 3, 3))
        origin = np.zeros((*q.shape[:-1], bodies, 3))
        rot[..., 0, :, :] = np.eye(3) if rot_base_to_world is None else rot_base_to_world
        turn = _rotations(self._axis, np.where(self._slides, 0.0, angles) if self._sliding else angles)
        if self._at_zero is not None:
            turn = self._at_zero @ turn
        for b in range(1, bodies):
            parent = self._parent[b]
            origin[..., b, :] = origin[..., parent, :] + rot[..., parent, :, :] @ self._offset[b - 1]
            rot[..., b, :, :] = rot[..., parent, :, :] @ turn[..., b - 1, :, :]
            if self._slides[b - 1]:
                origin[..., b, :] += (rot[..., b, :, :] @ self._axis[b - 1]) * angles[..., b - 1, None]
        com = origin + (rot @ self._com[..., None])[..., 0]
        axis = (rot[..., 1:, :, :] @ self._axis[..., None])[..., 0]
        return Frames(rot, origin, com, axis)

    def center_of_mass(self, q: Array, rot_base_to_world: Array | None = None) -> Array:
        """Return the whole-body center of mass relative to the base origin, (..., 3) (m)."""
        com = self.frames(q, rot_base_to_world).com
        return np.einsum("b,...bi->...i", self._mass, com) / self.mass

    def mass_matrix(self, q: Array, rot_base_to_world: Array | None = None) -> Array:
        """Return M(q), (..., 6 + n, 6 + n)."""
        frames = self.frames(q, rot_base_to_world)
        linear, angular = self._jacobians(frames, frames.com, self._supports)
        inertia = frames.rot @ self._inertia @ np.swapaxes(frames.rot, -1, -2)
        tree = np.einsum("b,...bik,...bil->...kl", self._mass, linear, linear)
        tree += np.einsum("...bik,...bij,...bjl->...kl", angular, inertia, angular)
        reduced = self._reduction.T @ tree @ self._reduction
        reduced[..., 6:, 6:] += np.diag(self._armature)
        return reduced

    def inverse_dynamics(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        base_velocity: Array | None = None,
        base_acceleration: Array | None = None,
        rot_base_to_world: Array | None = None,
    ) -> Array:
        """Return the generalized force of a motion, (..., 6 + n): [force, moment on the base; joint torques].

        `base_velocity` and `base_acceleration` are (..., 6), [linear; angular], zero by default; the linear
        acceleration is that of the base origin (not the spatial one).
        """
        frames = self.frames(q, rot_base_to_world)
        force, moment = self._wrenches(frames, qd, qdd, base_velocity, base_acceleration)
        # the load of each joint: the sum over the links that it moves
        force_carried = np.einsum("bj,...bi->...ji", self._supports, force)
        moment_carried = np.einsum("bj,...bi->...ji", self._supports, moment)
        moment_carried -= _cross(frames.origin[..., 1:, :], force_carried)
        if self._sliding:
            moment_carried = np.where(self._slides[:, None], force_carried, moment_carried)
        torque = np.einsum("...ji,...ji->...j", frames.axis, moment_carried) @ self._transmission
        return np.concatenate([force.sum(axis=-2), moment.sum(axis=-2), torque + self._armature * qdd], axis=-1)

    def base_wrench(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        base_velocity: Array | None = None,
        base_acceleration: Array | None = None,
    ) -> Array:
        """Return the force and moment on an upright base, (..., 6): the first components of `inverse_dynamics`."""
        force, moment = self._wrenches(self.frames(q), qd, qdd, base_velocity, base_acceleration)
        return np.concatenate([force.sum(axis=-2), moment.sum(axis=-2)], axis=-1)

    def joint_mass_matrix(self, q: Array) -> Array:
        """Return M(q) of the joints (..., n, n) where the base is fixed."""
        return self.mass_matrix(q)[..., 6:, 6:]

    def joint_torques(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return M(q) qdd + h(q, qd) (..., n) where the base is fixed."""
        return self.inverse_dynamics(q, qd, qdd)[..., 6:]

    def jacobian(self, link: str, q: Array, rot_base_to_world: Array | None = None) -> Array:
        """Return J (..., 6, 6 + n) of the velocity [linear; angular] of the origin of `link`."""
        frames = self.frames(q, rot_base_to_world)
        body = self._body(link)
        linear, angular = self._jacobians(frames, frames.origin[..., [body], :], self._supports[[body]])
        return np.concatenate([linear, angular], axis=-2)[..., 0, :, :] @ self._reduction

    def bias_acceleration(
        self, link: str, q: Array, qd: Array, base_velocity: Array, rot_base_to_world: Array | None = None
    ) -> Array:
        """Return dJ/dt v, (..., 6): the acceleration of the origin of `link` for dv/dt = 0."""
        frames = self.frames(q, rot_base_to_world)
        _, alpha, accel = self._accelerations(frames, qd, np.zeros_like(qd), base_velocity, None)
        body = self._body(link)
        return np.concatenate([accel[..., body, :], alpha[..., body, :]], axis=-1)

    def position(self, link: str, q: Array, rot_base_to_world: Array | None = None) -> Array:
        """Return the origin of `link` relative to the base origin, (..., 3) (m)."""
        return self.frames(q, rot_base_to_world).origin[..., self._body(link), :]

    def rotation(self, link: str, q: Array) -> Array:
        """Return the orientation of `link` in base axes, (..., 3, 3)."""
        return self.frames(q).rot[..., self._body(link), :, :]

    @property
    def _reduction(self) -> Array:
        size = 6 + self._transmission.shape[0]
        reduction = np.zeros((size, 6 + self.n))
        reduction[:6, :6] = np.eye(6)
        reduction[6:, 6:] = self._transmission
        return reduction

    def _body(self, link: str) -> int:
        if link not in self._index:
            raise RobotError("link", link, ", ".join(self._index))
        return self._index[link]

    def _jacobians(self, frames: Frames, point: Array, supports: Array) -> tuple[Array, Array]:
        """Return linear and angular Jacobians of a `point` (..., b, 3) on each link with `supports` (b, joints)."""
        shape = (*point.shape[:-1], 3, 6 + supports.shape[1])
        linear, angular = np.zeros(shape), np.zeros(shape)
        linear[..., :3] = angular[..., 3:6] = np.eye(3)
        linear[..., 3:6] = -_skew(point)
        arm = point[..., :, None, :] - frames.origin[..., None, 1:, :]  # (..., b, j, 3)
        axis = frames.axis[..., None, :, :] * supports[..., None]
        moved = _cross(frames.axis[..., None, :, :], arm) * supports[..., None]
        if self._sliding:
            slides = self._slides[:, None]
            moved, axis = np.where(slides, axis, moved), np.where(slides, 0.0, axis)
        linear[..., 6:] = np.swapaxes(moved, -1, -2)
        angular[..., 6:] = np.swapaxes(axis, -1, -2)
        return linear, angular

    def _wrenches(
        self, frames: Frames, qd: Array, qdd: Array, base_velocity: Array | None, base_acceleration: Array | None
    ) -> tuple[Array, Array]:
        """Return the force and the moment about the base origin that move each link, (..., b, 3)."""
        omega, alpha, accel = self._accelerations(frames, qd, qdd, base_velocity, base_acceleration)
        arm = frames.com - frames.origin
        accel_com = accel + _cross(alpha, arm) + _cross(omega, _cross(omega, arm))
        accel_com[..., 2] += GRAVITY
        force = self._mass[:, None] * accel_com
        inertia = frames.rot @ self._inertia @ np.swapaxes(frames.rot, -1, -2)
        moment = (inertia @ alpha[..., None])[..., 0] + _cross(omega, (inertia @ omega[..., None])[..., 0])
        moment += _cross(frames.com, force)  # about the base origin
        return force, moment

    def _accelerations(
        self, frames: Frames, qd: Array, qdd: Array, base_velocity: Array | None, base_acceleration: Array | None
    ) -> tuple[Array, Array, Array]:
        """Return angular velocity, angular acceleration and acceleration of the origin of each link, (..., b, 3)."""
        rate, rate_dot = qd @ self._transmission.T, qdd @ self._transmission.T
        omega, alpha, accel = (np.zeros_like(frames.com) for _ in range(3))
        if base_velocity is not None:
            omega[..., 0, :] = base_velocity[..., 3:]
        if base_acceleration is not None:
            accel[..., 0, :], alpha[..., 0, :] = base_acceleration[..., :3], base_acceleration[..., 3:]
        for b in range(1, len(self._mass)):
            parent, spin = self._parent[b], frames.axis[..., b - 1, :] * rate[..., b - 1, None]
            w, dw = omega[..., parent, :], alpha[..., parent, :]
            arm = frames.origin[..., b, :] - frames.origin[..., parent, :]
            accel[..., b, :] = accel[..., parent, :] + _cross(dw, arm) + _cross(w, _cross(w, arm))
            if self._slides[b - 1]:
                omega[..., b, :], alpha[..., b, :] = w, dw
                accel[..., b, :] += frames.axis[..., b - 1, :] * rate_dot[..., b - 1, None] + 2.0 * _cross(w, spin)
                continue
            omega[..., b, :] = w + spin
            alpha[..., b, :] = dw + frames.axis[..., b - 1, :] * rate_dot[..., b - 1, None] + _cross(w, spin)
        return omega, alpha, accel


def joint_space_inertia(mass_matrix: Array) -> Array:
    """Return the effective joint inertia of a free-floating robot: the Schur complement of M over its base.

    M_jj - M_jb M_bb^-1 M_bj, (..., n, n); its inverse is the joint block of M^-1, so that qdd = inertia^-1 tau + ....
    """
    base, cross = mass_matrix[..., :6, :6], mass_matrix[..., :6, 6:]
    return mass_matrix[..., 6:, 6:] - np.swapaxes(cross, -1, -2) @ np.linalg.solve(base, cross)


def constrained_inverse_inertia(mass_matrix: Array, jacobian: Array) -> Array:
    """Return A (..., n, n) in qdd = A tau + ... of a robot whose `jacobian` (..., m, 6 + n) times v stays constant.

    The joint block of M^-1 - M^-1 J^T (J M^-1 J^T)^-1 J M^-1; of the links that stand, `RigidBodyTree.jacobian`.
    Constraints that repeat each other count once.
    """
    inverse = np.linalg.inv(mass_matrix)
    coupled = inverse @ np.swapaxes(jacobian, -1, -2)
    shared = np.linalg.pinv(jacobian @ coupled, rcond=1e-9, hermitian=True)
    return (inverse - coupled @ shared @ np.swapaxes(coupled, -1, -2))[..., 6:, 6:]


def _rotations(axis: Array, angle: Array) -> Array:
    """Return Rodrigues' R = 1 + sin(a) [axis]x + (1 - cos(a)) [axis]x^2, (..., j, 3, 3)."""
    cross = _skew(axis)
    sine, cosine = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    return np.eye(3) + sine * cross + (1 - cosine) * (cross @ cross)


def _skew(v: Array) -> Array:
    """Return [v]x, with [v]x u = v x u."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def _cross(a: Array, b: Array) -> Array:
    """Return a x b, several times faster than np.cross on short vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out
