"""Many robots at once in MuJoCo, each in its own world, stepped by a pool of threads with `mujoco.batch`.

Each world behaves bitwise like `MujocoEngine`, for any number of worlds and threads.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.errors import RobotError
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.mujoco_kinematics import Kinematics
from artde_gym.sim.mujoco_module import Batch, mj
from artde_gym.sim.mujoco_world import FIELDS, Blueprint, Fields, MujocoWorld
from artde_gym.sim.rotation import rotate

Ids = NDArray[np.int32]
"""Indices of worlds, sorted and unique."""
Motion: TypeAlias = tuple[Array, Array, Array]
"""State, loads on the feet and friction of a world."""


class States(NamedTuple):
    """The states of robots, as `artde_gym.sim.engine.State`; `q` and `qd` are (n, joints), other components (n,)."""

    q: Array
    qd: Array
    position: tuple[Array, Array, Array]
    quat_xyzw: tuple[Array, Array, Array, Array]
    velocity: tuple[Array, Array, Array]
    angular_velocity: tuple[Array, Array, Array]


class MujocoBatch:
    """`n` worlds of one robot.

    Args:
        spec: the robot's spec.
        n: number of worlds.
        time_step: physics time step (s).
        threads: number of threads that step the worlds, including the caller's.

    Attributes:
        worlds: the interface of each world.

    Raises:
        RobotError: for a robot whose rotors are links, or whose actuated joints are not consecutive in the tree.
    """

    def __init__(self, spec: RobotSpec, n: int, time_step: float, threads: int) -> None:
        self._built = (spec, n, time_step, threads)
        self._blueprint = blueprint = Blueprint(spec, time_step)
        joints = blueprint.joints
        if not isinstance(joints, slice):
            raise RobotError("actuated joints", spec.actuated, "consecutive joints of the tree")
        base_q, base_v = blueprint.base_q, blueprint.base_v
        self._angles = slice(base_q + joints.start, base_q + joints.stop)
        self._speeds = slice(base_v + joints.start, base_v + joints.stop)
        self._batch = batch = Batch(blueprint.model, n, threads)
        self._pose, self._twist, self._torque = (batch.bind(name) for name in ("qpos", "qvel", "qfrc_applied"))
        self._sensors = batch.bind("sensordata")
        self._forces = np.zeros(self._sensors.shape)  # from `_sensors`, or from restored states
        self._place = mj.MjData(blueprint.model)
        self._pushes = batch.bind("xfrc_applied")
        self._pushed: list[int] = []  # worlds with forces for the next step
        self._lifted = False  # whether feet may have such forces in any world
        fields = [*map(batch.expand, FIELDS), self._pushes]
        self._friction = fields[FIELDS.index("pair_friction")]
        self.worlds = [_Row(blueprint, Fields(*(field[i] for field in fields)), self, i) for i in range(n)]
        self._snapshots: list[Motion] = []

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a copy: independent worlds that step bitwise like these."""
        return {
            "built": self._built,
            "snapshots": self._snapshots,
            "set": [world.settings() for world in self.worlds],
            "state": self._batch.state.copy(),
            "forces": self._forces.copy(),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(*state["built"])
        for world, settings in zip(self.worlds, state["set"], strict=True):
            world.set_up(settings)
        self._snapshots = state["snapshots"]
        self._batch.state[:] = state["state"]
        self._forces[:] = state["forces"]

    def reset(self, world: int, position: Vector, q: Array) -> None:
        """Put the upright robot of a world at `position` (m) with joints at `q`, all at rest, without a payload."""
        self.worlds[world].release_payload()
        self._batch.reset(np.array([world]), stage=mj.mjtStage.mjSTAGE_NONE)
        if not self._blueprint.spec.fixed:
            self._pose[world, :7] = (*position, 1.0, 0.0, 0.0, 0.0)
        self._pose[world, self._angles] = q

    def save_state(self, world: int) -> int:
        """Save the state of a world without a payload; return a handle."""
        self._snapshots.append(self.motion(world))
        return len(self._snapshots) - 1

    def restore_state(self, worlds: Ids, snapshot: int) -> None:
        """Restore a saved state in some worlds bitwise; payloads are removed."""
        for world in worlds.tolist():
            self.worlds[world].release_payload()
        self.set_motion(worlds, self._snapshots[snapshot])

    def motion(self, world: int) -> Motion:
        """Return a copy of the motion of a world: its state, the loads on its feet, and the friction."""
        return self._batch.state[world].copy(), self._forces[world].copy(), self._friction[world].copy()

    def set_motion(self, worlds: Ids, motion: Motion) -> None:
        """Give some worlds a motion bitwise; their masses, gravity and payloads must be those that it was made with."""
        self._batch.state[worlds], self._forces[worlds], self._friction[worlds] = motion

    def state(self) -> States:
        """Return the current states; where possible views, which the next step changes."""
        if self._blueprint.spec.fixed:
            zero, one = np.zeros(len(self._pose)), np.ones(len(self._pose))
            nothing = (zero, zero, zero)
            return States(*self.joints(), nothing, (*nothing, one), nothing, nothing)
        x, y, z, w, i, j, k = self._pose[:, :7].T
        vx, vy, vz, wx, wy, wz = self._twist[:, :6].T
        quat = (i, j, k, w)
        return States(*self.joints(), (x, y, z), quat, (vx, vy, vz), rotate((wx, wy, wz), quat))

    def joints(self, worlds: Ids | slice = slice(None)) -> tuple[Array, Array]:
        """Return q and qd (n, joints) of some worlds; views if of all."""
        return self._pose[worlds, self._angles], self._twist[worlds, self._speeds]

    def step(self, tau: Array, worlds: Ids | None = None, steps: int = 1) -> None:
        """Advance some worlds, or all, by `steps` time steps under torques `tau` (worlds, joints) (Nm)."""
        rows = slice(None) if worlds is None else worlds
        self._torque[rows, self._speeds] = tau
        self._batch.step(worlds, steps)
        self._forces[rows] = self._sensors[rows]
        if self._pushed:
            self._pushes[self._pushed] = 0.0
            self._pushed = []
        if self._lifted:
            self._pushes[:, self._blueprint.feet, 2] = 0.0
            self._lifted = False

    def lift_feet(self, forces: Array) -> None:
        """Add upward forces (n, feet) (N) at the centers of mass of the feet, for the next step only.

        The next step must include every world that has a force.
        """
        self._pushes[:, self._blueprint.feet, 2] += forces
        self._lifted = True

    def foot_loads(self) -> Array:
        """Return the normal forces on the feet in the last step (n, feet) (N); a view."""
        return self._forces[:, 2::3]

    def ground_forces(self) -> Array:
        """Return the forces of the ground on the feet in the last step (n, 3 feet) (N, world axes); a view."""
        return self._forces

    def placed(self, world: int) -> Any:
        """See `MujocoWorld.placed`; valid until the next call."""
        self._place.qpos[:] = self._pose[world]
        mj.mj_kinematics(self._blueprint.model, self._place)
        return self._place

    def site(self, name: str) -> Array:
        """Return the positions of a site in all worlds (n, 3) (m, world axes)."""
        return self._kinematics.site(self._blueprint.site(name), self._pose)

    @functools.cached_property
    def _kinematics(self) -> Kinematics:
        return Kinematics(self._blueprint.spec)

    def masses_changed(self, world: int) -> None:
        """See `MujocoWorld.masses_changed`."""
        self._batch.set_const(np.array([world]))

    def pushed(self, world: int) -> None:
        """Note that a world has forces for the next step."""
        self._pushed.append(world)


class _Row(MujocoWorld):
    """One world of a batch."""

    def __init__(self, blueprint: Blueprint, fields: Fields, batch: MujocoBatch, number: int) -> None:
        super().__init__(blueprint, fields)
        self._batch, self._number = batch, number

    def placed(self) -> Any:
        return self._batch.placed(self._number)

    def masses_changed(self) -> None:
        self._batch.masses_changed(self._number)

    def foot_loads(self) -> tuple[float, ...]:
        return tuple(self._batch.foot_loads()[self._number].tolist())

    def add_force(self, body: int, force: Vector, torque: Vector | NDArray[Any]) -> None:
        super().add_force(body, force, torque)
        self._batch.pushed(self._number)
