"""The engine protocol on MuJoCo.

MuJoCo's habits that stay in here: a quaternion's w comes first; the spin of a free base is in base axes; applied forces
stay until they are taken back; after a step the places of links and sites are still those of before it; what the
constraint solver knows of the masses follows them only when asked to; a robot that diverges would jump to its start.

The payload is a body without a joint, and so a rigid part of the base. Once released nothing touches it any more: its
fall is the formula of free fall.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.errors import RobotError
from artde_gym.robots.mjcf import PAYLOAD, mjcf
from artde_gym.robots.spec import RobotSpec, Vector
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import PAYLOAD_RADIUS, State
from artde_gym.sim.ground import Shadow, paint
from artde_gym.sim.mujoco_canvas import Canvas
from artde_gym.sim.rotation import Quaternion, moved, rotated

mj: Any = mujoco  # compiled, without type information

_STATE = mj.mjtState.mjSTATE_INTEGRATION  # all that the next step depends on


class _Fall(NamedTuple):
    """A released payload: where and how fast it was, and when."""

    position: Array
    velocity: Array
    time: float


class MujocoEngine:
    """One robot on a plane in a MuJoCo world of its own.

    Raises:
        RobotError: for a robot whose rotors are links.
    """

    def __init__(self, spec: RobotSpec, time_step: float = 0.001, *, renders: bool = False) -> None:
        if spec.gears:
            raise RobotError("gears", spec.gears, "none, rotors being armature; engine 'bullet' couples rotor links")
        self.spec = spec
        self.time_step = time_step
        self.window = None
        self._model = model = mj.MjModel.from_xml_string(mjcf(spec))
        self._data = data = mj.MjData(model)
        model.opt.timestep = time_step
        self._bodies = [model.body(link.name).id for link in spec.links]
        self._base = self._bodies[0]
        self._payload = model.body(PAYLOAD).id
        self._sites = {name: model.site(name).id for name, _, _ in spec.sites}
        # views into MuJoCo's memory; it numbers the coordinates of the base first, and those of joints by the tree
        self._q = data.qpos[7:]
        self._qd = data.qvel[6:]
        self._torque = data.qfrc_applied[6:]
        self._joints = _span([model.joint(name).dofadr[0] - 6 for name in spec.actuated])
        self._pose, self._twist = data.qpos[:7], data.qvel[:6]
        self._pushes, self._pushed = data.xfrc_applied, False
        self._forces = data.sensordata
        self._nominal = (model.body_mass.copy(), model.body_inertia.copy(), model.dof_armature.copy())
        self._mass_factor = 1.0
        self._held: Vector | None = None  # where the payload is on the base
        self._fall: _Fall | None = None
        self._scratch = mj.MjData(model)
        self._snapshots: list[tuple[Array, Array, Array]] = []
        self._canvas = Canvas(model) if renders else None
        self._shadow = Shadow(spec)

    def place(self, position: Vector, q: Array) -> None:
        self._remove_payload()
        mj.mj_resetData(self._model, self._data)
        self._pose[:] = (*position, 1.0, 0.0, 0.0, 0.0)
        self._q[self._joints] = q

    def snapshot(self) -> int:
        state = np.empty(mj.mj_stateSize(self._model, _STATE))
        mj.mj_getState(self._model, self._data, state, _STATE)
        self._snapshots.append((state, self._forces.copy(), self._model.pair_friction.copy()))
        return len(self._snapshots) - 1

    def restore(self, snapshot: int) -> None:
        self._remove_payload()
        state, self._forces[:], self._model.pair_friction[:] = self._snapshots[snapshot]
        mj.mj_setState(self._model, self._data, state, _STATE)

    def read(self) -> State:
        x, y, z, w, i, j, k = self._pose.tolist()
        vx, vy, vz, wx, wy, wz = self._twist.tolist()
        quat = (i, j, k, w)
        q, qd = self._q[self._joints].copy(), self._qd[self._joints].copy()
        return State(q, qd, (x, y, z), quat, (vx, vy, vz), rotated((wx, wy, wz), quat))

    def step(self, tau: Array) -> None:
        self._torque[self._joints] = tau
        mj.mj_step(self._model, self._data)
        if self._pushed:
            self._pushes[:] = 0.0
            self._pushed = False

    def push_base(self, force: Vector, torque: Vector) -> None:
        quat = self._quat()
        self._pushes[self._base] += (*rotated(force, quat), *rotated(torque, quat))
        self._pushed = True

    def push(self, site: str, force: Vector) -> None:
        place, body = np.array(self.site(site)), self._model.site_bodyid[self._sites[site]]
        arm = place - self._data.xipos[body]
        self._pushes[body] += (*force, *np.cross(arm, force))  # at the body's centre of mass
        self._pushed = True

    def site(self, name: str) -> Vector:
        if name not in self._sites:
            raise RobotError("site", name, ", ".join(map(repr, self._sites)))
        mj.mj_kinematics(self._model, self._data)
        x, y, z = self._data.site_xpos[self._sites[name]].tolist()
        return x, y, z

    def foot_loads(self) -> tuple[float, ...]:
        return tuple(self._forces[2::3].tolist())

    def ground_forces(self) -> Array:
        return self._forces.reshape(-1, 3).copy()

    def set_friction(self, coefficient: float) -> None:
        self._model.pair_friction[:, :2] = coefficient

    def set_gravity(self, gravity: Vector) -> None:
        self._model.opt.gravity[:] = gravity

    def scale_masses(self, factor: float) -> None:
        if factor == self._mass_factor:
            return
        self._mass_factor = factor
        model, (mass, inertia, armature) = self._model, self._nominal
        model.body_mass[self._bodies] = factor * mass[self._bodies]
        model.body_inertia[self._bodies] = factor * inertia[self._bodies]
        model.dof_armature[:] = factor * armature
        self._masses_changed()

    def attach_payload(self, mass: float, position: Vector) -> None:
        self._fall, self._held = None, position
        self._model.body_pos[self._payload] = position
        self._weigh_payload(mass)

    def release_payload(self) -> None:
        if self._held is not None:
            _, _, position, quat, velocity, spin = self.read()
            arm = rotated(self._held, quat)
            self._fall = _Fall(np.add(position, arm), np.array(moved(velocity, spin, arm)), self._data.time)
            self._held = None
            self._weigh_payload(0.0)

    def _remove_payload(self) -> None:
        self._fall = None
        if self._held is not None:
            self._held = None
            self._weigh_payload(0.0)

    def _weigh_payload(self, mass: float) -> None:
        self._model.body_mass[self._payload] = mass
        self._model.body_inertia[self._payload] = 0.4 * mass * PAYLOAD_RADIUS**2
        self._masses_changed()

    def _masses_changed(self) -> None:
        mj.mj_setConst(self._model, self._scratch)

    def _payload_center(self) -> Array | None:
        """Where the payload is, held or falling."""
        if self._held is not None:
            state = self.read()
            return np.add(state.position, rotated(self._held, state.quat_xyzw))
        if self._fall is not None:
            position, velocity, start = self._fall
            time = self._data.time - start
            return position + velocity * time + self._model.opt.gravity * (time * time / 2)
        return None

    def render(self, camera: Camera) -> NDArray[np.uint8]:
        if self._canvas is None:
            self._canvas = Canvas(self._model)
        mj.mj_kinematics(self._model, self._data)
        mj.mj_camlight(self._model, self._data)
        ball = self._payload_center()
        picture, bare = self._canvas.draw(self._data, camera, ball)
        paint(picture, bare, camera, self._shadow.polygons(self.read(), ball))
        return picture

    def close(self) -> None:
        if self._canvas is not None:
            self._canvas.close()
            self._canvas = None

    def _quat(self) -> Quaternion:
        w, x, y, z = self._pose[3:].tolist()
        return x, y, z, w


def _span(numbers: list[int]) -> slice | list[int]:
    """Consecutive numbers as a slice, which is faster to index by."""
    first = numbers[0] if numbers else 0
    return slice(first, first + len(numbers)) if numbers == list(range(first, first + len(numbers))) else numbers
