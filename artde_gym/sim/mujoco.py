"""MuJoCo as an `Engine`.

MuJoCo's peculiarities are handled here: a quaternion's w comes first; the angular velocity of a free base is in base
axes; applied forces stay until they are cleared; after a step, positions of links and sites are still those before it;
the solver's constants that depend on masses are updated only on request; a diverging robot would be reset.

The payload is a body without a joint, and so a rigid part of the base. Once released, it collides with nothing and its
position follows from the formula of free fall.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import AT_ORIGIN, State
from artde_gym.sim.ground import Shadow, paint
from artde_gym.sim.mujoco_canvas import Canvas
from artde_gym.sim.mujoco_module import mj
from artde_gym.sim.mujoco_world import STATE, Blueprint, Fields, MujocoWorld
from artde_gym.sim.rotation import Quaternion, point_velocity, rotate


class _Fall(NamedTuple):
    """A released payload: its position, velocity and time of release."""

    position: Array
    velocity: Array
    time: float


class MujocoEngine(MujocoWorld):
    """One robot on a plane in its own MuJoCo model.

    Raises:
        RobotError: for a robot whose rotors are links.
    """

    name = "mujoco"

    def __init__(self, spec: RobotSpec, time_step: float = 0.001, *, renders: bool = False) -> None:
        blueprint = Blueprint(spec, time_step)
        self.time_step = time_step
        self._model = model = blueprint.model
        self._data = data = mj.MjData(model)
        fields = (model.body_mass, model.body_inertia, model.body_pos, model.dof_armature, model.pair_friction)
        fields += (model.pair_solref,)
        super().__init__(blueprint, Fields(*fields, model.opt.gravity, data.xfrc_applied))
        # views into MuJoCo's memory
        base_q, base_v = blueprint.base_q, blueprint.base_v
        self._q = data.qpos[base_q:]
        self._qd = data.qvel[base_v:]
        self._torque = data.qfrc_applied[base_v:]
        self._joints = blueprint.joints
        self._fixed = spec.fixed
        self._pose, self._twist = data.qpos[:base_q], data.qvel[:base_v]
        self._pushes, self._pushed = data.xfrc_applied, False
        self._forces, self._loads = data.sensordata, data.sensordata[2::3]
        self._fall: _Fall | None = None
        self._scratch = mj.MjData(model)
        self._snapshots: list[tuple[Array, Array, Array]] = []
        self._canvas = Canvas(spec) if renders else None
        self._shadow = Shadow(spec)

    def reset(self, position: Vector, q: Array) -> None:
        self._remove_payload()
        mj.mj_resetData(self._model, self._data)
        if not self._fixed:
            self._pose[:] = (*position, 1.0, 0.0, 0.0, 0.0)
        self._q[self._joints] = q

    def save_state(self) -> int:
        self._snapshots.append((self._saved(), self._forces.copy(), self._model.pair_friction.copy()))
        return len(self._snapshots) - 1

    def restore_state(self, snapshot: int) -> None:
        self._remove_payload()
        state, self._forces[:], self._model.pair_friction[:] = self._snapshots[snapshot]
        mj.mj_setState(self._model, self._data, state, STATE)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a copy: an independent world that steps bitwise like this one."""
        return {
            "built": (self.spec, self.time_step),
            "renders": self._canvas is not None,
            "snapshots": self._snapshots,
            "set": self.settings(),
            "fall": self._fall,
            "pushed": self._pushed,
            "state": self._saved(),
            "forces": self._forces.copy(),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(*state["built"], renders=state["renders"])
        self.set_up(state["set"])
        self._snapshots, self._fall, self._pushed = state["snapshots"], state["fall"], state["pushed"]
        mj.mj_setState(self._model, self._data, state["state"], STATE)
        self._forces[:] = state["forces"]

    def _saved(self) -> Array:
        state = np.empty(mj.mj_stateSize(self._model, STATE))
        mj.mj_getState(self._model, self._data, state, STATE)
        return state

    def state(self) -> State:
        if self._fixed:
            return State(self._q[self._joints].copy(), self._qd[self._joints].copy(), *AT_ORIGIN)
        x, y, z, w, i, j, k = self._pose.tolist()
        vx, vy, vz, wx, wy, wz = self._twist.tolist()
        quat = (i, j, k, w)
        q, qd = self._q[self._joints].copy(), self._qd[self._joints].copy()
        return State(q, qd, (x, y, z), quat, (vx, vy, vz), rotate((wx, wy, wz), quat))

    def step(self, tau: Array) -> None:
        if self.spec.actuated:
            self._torque[self._joints] = tau
        mj.mj_step(self._model, self._data)
        if self._pushed:
            self._pushes[:] = 0.0
            self._pushed = False

    def apply_base_wrench(self, force: Vector, torque: Vector) -> None:
        quat = self._quat()
        self.add_force(self._blueprint.base, rotate(force, quat), rotate(torque, quat))

    def add_force(self, body: int, force: Vector, torque: Vector | NDArray[Any]) -> None:
        super().add_force(body, force, torque)
        self._pushed = True

    def placed(self) -> Any:
        mj.mj_kinematics(self._model, self._data)
        return self._data

    def foot_loads(self) -> tuple[float, ...]:
        return tuple(self._loads.tolist())

    def ground_forces(self) -> Array:
        return self._forces.reshape(-1, 3).copy()

    def attach_payload(self, mass: float, position: Vector) -> None:
        self._fall = None
        super().attach_payload(mass, position)

    def release_payload(self) -> None:
        if self.held is not None and self.spec.carrier:
            self._fall = _Fall(*self._carried(), self._data.time)
        elif self.held is not None:
            _, _, position, quat, velocity, spin = self.state()
            arm = rotate(self.held, quat)
            self._fall = _Fall(np.add(position, arm), np.array(point_velocity(velocity, spin, arm)), self._data.time)
        super().release_payload()

    def _carried(self) -> tuple[Array, Array]:
        """Return position and velocity of a payload on a link of the spec's choice."""
        data, jacobian = self.placed(), np.zeros((3, self._model.nv))
        mj.mj_comPos(self._model, data)
        mj.mj_jacBody(self._model, data, jacobian, None, self._blueprint.payload)
        return data.xpos[self._blueprint.payload].copy(), jacobian @ data.qvel

    def masses_changed(self) -> None:
        mj.mj_setConst(self._model, self._scratch)

    def _remove_payload(self) -> None:
        super().release_payload()
        self._fall = None

    def payload_position(self) -> Vector | None:
        if self.held is not None and self.spec.carrier:
            x, y, z = self.placed().xpos[self._blueprint.payload].tolist()
            return x, y, z
        if self.held is not None:
            state = self.state()
            (x, y, z), (ax, ay, az) = state.position, rotate(self.held, state.quat_xyzw)
            return x + ax, y + ay, z + az
        if self._fall is not None:
            position, velocity, start = self._fall
            time = self._data.time - start
            x, y, z = (position + velocity * time + self._model.opt.gravity * (time * time / 2)).tolist()
            return x, y, z
        return None

    def render(self, camera: Camera, load: Vector | None = None) -> NDArray[np.uint8]:
        if self._canvas is None:
            self._canvas = Canvas(self.spec)
        ball = self.payload_position() if load is None else load
        picture, bare = self._canvas.draw(self._data.qpos, camera, ball)
        paint(picture, bare, camera, self._shadow.polygons(self.state(), ball))
        return picture

    def close(self) -> None:
        if self._canvas is not None:
            self._canvas.close()
            self._canvas = None

    def _quat(self) -> Quaternion:
        if self._fixed:
            return AT_ORIGIN[1]
        w, x, y, z = self._pose[3:].tolist()
        return x, y, z, w
