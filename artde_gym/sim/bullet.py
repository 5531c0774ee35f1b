"""PyBullet as an `Engine`.

Bullet's peculiarities are handled here: it has no armature, so that rotors become links with gears; the base is read
and set by its center-of-mass frame; torques last one step; joint motors are on by default; joint speeds are clamped at
100 rad/s by default; friction of a pair is the product of both bodies' coefficients; the solver stops early at a
residual that leaves 1 % errors in geared joints; every call needs the client's id, or a second simulation in the
process corrupts the first.
"""

from __future__ import annotations

import math
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.errors import RobotError
from artde_gym.multibody.mjcf import PAYLOAD
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.multibody.urdf import urdf
from artde_gym.sim.bullet_payload import MASSLESS, Carried, Fall
from artde_gym.sim.camera import FIELD_OF_VIEW, NEAR, Camera
from artde_gym.sim.engine import AT_ORIGIN, PAYLOAD_COLOR, PAYLOAD_LOOK, PAYLOAD_RADIUS, State
from artde_gym.sim.ground import SUN, Shadow, paint
from artde_gym.sim.pybullet_module import bullet, bullet_data
from artde_gym.sim.rotation import Quaternion, point_velocity, rotate

GEAR_ITERATIONS = 60  # of the solver; with 30, the gears' residual raises ARTDE's RMSE in S1 by a third
BARE_ITERATIONS = 50  # of the solver without gears
GEAR_FORCE = 1e6  # N, more than any gear carries
PAYLOAD_FORCE = 1e5  # N, more than any payload's constraint carries
FAR_PLANE = 30.0  # m, from the camera
CONTACT_SHARE = 0.08  # of a foot's penetration depth corrected per time step, Bullet's default
HOLD_TORQUE = 100.0  # Nm, of the motors that hold unactuated joints

_ORIGIN = (0.0, 0.0, 0.0)
_NO_JOINTS = np.zeros(0)
_NO_JOINTS.flags.writeable = False


class _Snapshot(NamedTuple):
    """A saved state: Bullet's handle, the friction of contacts, and the world as bytes for other processes."""

    handle: int
    friction: float
    world: bytes


class BulletEngine:
    """One robot on a plane in its own Bullet world; it can always render, whatever `renders` is."""

    name = "bullet"

    def __init__(self, spec: RobotSpec, time_step: float = 0.001, *, renders: bool = False) -> None:
        self.spec = spec = spec.with_rotor_links() if any(spec.armature) else spec
        self.time_step = time_step
        self._client = bullet.connect(bullet.DIRECT)
        if self._client < 0:
            raise RuntimeError(
                "PyBullet has no free physics client: too many are open in this process; close environments"
            )
        self._finalizer = weakref.finalize(self, _disconnect, self._client)
        bullet.setTimeStep(time_step, physicsClientId=self._client)
        bullet.setGravity(0.0, 0.0, -9.81, physicsClientId=self._client)
        bullet.setPhysicsEngineParameter(
            numSolverIterations=GEAR_ITERATIONS if spec.gears else BARE_ITERATIONS,
            solverResidualThreshold=0.0,
            deterministicOverlappingPairs=1,
            enableFileCaching=0,
            physicsClientId=self._client,
        )
        self._ground = self._build_ground()
        self._carried = Carried(spec) if spec.fixed else None
        self._robot = self._build_robot()
        self._ball = bullet.createVisualShape(  # shape of the payload, made once: Bullet never frees a visual shape
            bullet.GEOM_MESH,
            fileName=str(Path(bullet_data.getDataPath()) / "sphere_smooth.obj"),  # of radius 1
            meshScale=[PAYLOAD_LOOK] * 3,
            rgbaColor=PAYLOAD_COLOR,
            physicsClientId=self._client,
        )
        self._sites = {name: (link, offset) for name, link, offset in spec.sites}
        self._com = x, y, z = spec.base.com
        self._to_origin = (-x, -y, -z)  # of the base, from its center of mass
        self._shadow = Shadow(spec)
        self._scales: tuple[float, dict[str, float], float] = (1.0, {}, 1.0)
        self._contact_time: float | None = None
        self._friction = math.nan
        self._gravity: Vector = (0.0, 0.0, -9.81)
        self._snapshots: list[_Snapshot] = []
        self._steps = 0  # since the beginning
        self._ballast: tuple[float, Vector] = (0.0, _ORIGIN)  # mass and position of the payload
        self._payload: int | None = None  # body
        self._holder: int | None = None  # constraint

    def _build_ground(self) -> int:
        shape = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=self._client)
        mesh = str(Path(bullet_data.getDataPath()) / "plane100.obj")
        visual = bullet.createVisualShape(bullet.GEOM_MESH, fileName=mesh, physicsClientId=self._client)
        ground = bullet.createMultiBody(0.0, shape, visual, physicsClientId=self._client)
        bullet.changeDynamics(ground, -1, lateralFriction=1.0, restitution=0.0, physicsClientId=self._client)
        return ground

    def _build_robot(self) -> int:
        client: dict[str, Any] = {"physicsClientId": self._client}
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{self.spec.name}.urdf"
            file.write_text(urdf(self.spec if self._carried is None else self._carried.spec()), encoding="utf-8")
            flags = bullet.URDF_USE_INERTIA_FROM_FILE
            if self.spec.feet_collide:
                flags |= bullet.URDF_USE_SELF_COLLISION  # only feet have a collision shape
            robot = bullet.loadURDF(str(file), useFixedBase=self.spec.fixed, flags=flags, **client)
        count = bullet.getNumJoints(robot, **client)
        self._links = {bullet.getJointInfo(robot, i, **client)[12].decode(): i for i in range(count)}
        self._links[self.spec.base.name] = -1
        self._joints = [self._links[name] for name in self.spec.actuated]
        self._feet = [self._links[name] for name in self.spec.feet]
        rotors = {gear.rotor for gear in self.spec.gears}
        self._held = [
            self._links[link.name] for link in self.spec.joints if link.name not in (*self.spec.actuated, *rotors)
        ]
        for link in range(-1, count):
            bullet.changeDynamics(
                robot,
                link,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                restitution=0.0,
                maxJointVelocity=1e4,
                **client,
            )
            bullet.changeDynamics(robot, link, activationState=bullet.ACTIVATION_STATE_DISABLE_SLEEPING, **client)
        # where there are products, Bullet's frame of a link has the principal axes
        self._moments = {
            link.name: bullet.getDynamicsInfo(robot, self._links[link.name], **client)[2]
            if any(link.products)
            else link.inertia
            for link in self.spec.links
        }
        for joint in range(count):
            bullet.setJointMotorControl2(robot, joint, bullet.VELOCITY_CONTROL, force=0.0, **client)
        for joint in self._held:
            bullet.setJointMotorControl2(
                robot, joint, bullet.POSITION_CONTROL, targetPosition=0.0, force=HOLD_TORQUE, **client
            )
        self._gears: list[int] = []
        for gear in self.spec.gears:
            rotor, driven = self._links[gear.rotor], self._links[gear.driven]
            constraint = bullet.createConstraint(
                robot, rotor, robot, driven, bullet.JOINT_GEAR, [0, 0, 1], [0, 0, 0], [0, 0, 0], **client
            )
            bullet.changeConstraint(constraint, gearRatio=-gear.ratio, maxForce=GEAR_FORCE, erp=0.0, **client)
            self._gears.append(constraint)
        if self._carried is not None:
            self._fresh = bullet.saveState(**client)
        return robot

    def reset(self, position: Vector, q: Array) -> None:
        self._remove_payload()
        client: dict[str, Any] = {"physicsClientId": self._client}
        if self._carried is None:
            center = np.add(position, self._com).tolist()
            bullet.resetBasePositionAndOrientation(self._robot, center, [0.0, 0.0, 0.0, 1.0], **client)
            bullet.resetBaseVelocity(self._robot, [0.0] * 3, [0.0] * 3, **client)
        angle = dict(zip(self.spec.actuated, q.tolist(), strict=True))
        angle.update({gear.rotor: gear.ratio * angle[gear.driven] for gear in self.spec.gears})
        for name, joint in self._links.items():
            if joint >= 0:
                bullet.resetJointState(self._robot, joint, angle.get(name, 0.0), 0.0, **client)

    def save_state(self) -> int:
        handle = bullet.saveState(physicsClientId=self._client)
        self._snapshots.append(_Snapshot(handle, self._friction, self._world()))
        return len(self._snapshots) - 1

    def restore_state(self, snapshot: int) -> None:
        self._remove_payload()  # Bullet restores only a world with the same bodies
        saved = self._snapshots[snapshot]
        self._set_foot_friction(saved.friction)
        bullet.restoreState(saved.handle, physicsClientId=self._client)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state of a copy: a world in its own client that steps bitwise like this one."""
        payload = None if self._payload is None else (*self._ballast, self._holder is not None)
        if self._carried is not None:
            payload = self._carried.kept()
        return {
            "built": (self.spec, self.time_step),
            "snapshots": [(saved.friction, saved.world) for saved in self._snapshots],
            "set": (self._gravity, self._scales, self._contact_time, self._friction),
            "payload": payload,
            "world": self._world(),
            "steps": self._steps,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(*state["built"])
        for friction, world in state["snapshots"]:
            self._load(friction, world)
            self.save_state()
        gravity, scales, contact_time, friction = state["set"]
        self.set_gravity(gravity)
        self.scale_masses(*scales)
        self.set_contact_time(contact_time)
        if self._carried is not None:
            self._carry(*state["payload"])
        elif state["payload"] is not None:
            mass, position, held = state["payload"]
            self.attach_payload(mass, position)
            if not held:
                self.release_payload()
        self._load(friction, state["world"])
        self._steps = state["steps"]

    def _world(self) -> bytes:
        """Return positions, velocities and contacts of all bodies in Bullet's file format."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "world.bullet"
            bullet.saveBullet(str(file), physicsClientId=self._client)
            return file.read_bytes()

    def _load(self, friction: float, world: bytes) -> None:
        """Load the output of `_world` in a world with the same bodies."""
        if not math.isnan(friction):
            self._set_foot_friction(friction)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "world.bullet"
            file.write_bytes(world)
            bullet.restoreState(fileName=str(file), physicsClientId=self._client)

    def state(self) -> State:
        client = self._client
        center, quat = bullet.getBasePositionAndOrientation(self._robot, physicsClientId=client)
        velocity, spin = bullet.getBaseVelocity(self._robot, physicsClientId=client)
        if not self._joints and not any(self._com):
            return State(_NO_JOINTS, _NO_JOINTS, center, quat, velocity, spin)
        states = bullet.getJointStates(self._robot, self._joints, physicsClientId=client) if self._joints else ()
        n = len(states)
        joints = np.array([state[0] for state in states] + [state[1] for state in states])  # one array is faster
        if self._carried is not None:
            return State(joints[:n], joints[n:], *AT_ORIGIN)
        x, y, z = arm = rotate(self._to_origin, quat)
        position = (center[0] + x, center[1] + y, center[2] + z)
        return State(joints[:n], joints[n:], position, quat, point_velocity(velocity, spin, arm), spin)

    def step(self, tau: Array) -> None:
        if self._joints:
            bullet.setJointMotorControlArray(
                self._robot, self._joints, bullet.TORQUE_CONTROL, forces=tau.tolist(), physicsClientId=self._client
            )
        bullet.stepSimulation(physicsClientId=self._client)
        self._steps += 1

    def apply_base_wrench(self, force: Vector, torque: Vector) -> None:
        client = self._client  # the origin of Bullet's base frame is the base's center of mass
        bullet.applyExternalForce(self._robot, -1, force, _ORIGIN, bullet.LINK_FRAME, physicsClientId=client)
        bullet.applyExternalTorque(self._robot, -1, torque, bullet.LINK_FRAME, physicsClientId=client)

    def apply_force(self, site: str, force: Vector) -> None:
        point = self.site(site)
        link = self._links[self._site(site)[0]]
        bullet.applyExternalForce(self._robot, link, force, point, bullet.WORLD_FRAME, physicsClientId=self._client)

    def apply_world_wrench(self, force: Vector, torque: Vector) -> None:
        quat = bullet.getBasePositionAndOrientation(self._robot, physicsClientId=self._client)[1]
        back = (-quat[0], -quat[1], -quat[2], quat[3])
        self.apply_base_wrench(rotate(force, back), rotate(torque, back))

    def lift_feet(self, forces: Sequence[float]) -> None:
        client = self._client
        for foot, force in zip(self._feet, forces, strict=True):
            center = bullet.getLinkState(self._robot, foot, computeForwardKinematics=1, physicsClientId=client)[0]
            lift = (0.0, 0.0, force)
            bullet.applyExternalForce(self._robot, foot, lift, center, bullet.WORLD_FRAME, physicsClientId=client)

    def site(self, name: str) -> Vector:
        link, offset = self._site(name)
        origin, quat = self._link_frame(link)
        x, y, z = (np.asarray(origin) + _rotation(quat) @ np.asarray(offset)).tolist()
        return x, y, z

    def _site(self, name: str) -> tuple[str, Vector]:
        """Return a site's link and its position on it."""
        if name not in self._sites:
            raise RobotError("site", name, ", ".join(map(repr, self._sites)))
        return self._sites[name]

    def foot_loads(self) -> tuple[float, ...]:
        loads = dict.fromkeys(self._feet, 0.0)  # only feet have a collision shape
        for point in bullet.getContactPoints(self._robot, self._ground, physicsClientId=self._client):
            loads[point[3]] += point[9]
        return tuple(loads.values())

    def ground_forces(self) -> Array:
        forces = {foot: np.zeros(3) for foot in self._feet}
        for point in bullet.getContactPoints(self._robot, self._ground, physicsClientId=self._client):
            # normal force along the normal, then two friction forces along their directions
            for size, direction in ((point[9], point[7]), (point[10], point[11]), (point[12], point[13])):
                forces[point[3]] += size * np.asarray(direction)
        return np.array(list(forces.values()))

    def set_gravity(self, gravity: Vector) -> None:
        bullet.setGravity(*gravity, physicsClientId=self._client)
        self._gravity = gravity

    def set_contact_time(self, time: float | None) -> None:
        if time == self._contact_time:
            return
        share = CONTACT_SHARE if time is None else self.time_step / time
        bullet.setPhysicsEngineParameter(contactERP=share, physicsClientId=self._client)
        self._contact_time = time

    def scale_masses(
        self, factor: float, links: Mapping[str, float] = MappingProxyType({}), armature: float = 1.0
    ) -> None:
        scales = (factor, dict(links), armature)
        if scales == self._scales:
            return
        rotors = {gear.rotor for gear in self.spec.gears}
        for link in self.spec.links:
            own = factor * links.get(link.name, 1.0)
            turning = own * armature if link.name in rotors else own
            bullet.changeDynamics(
                self._robot,
                self._links[link.name],
                mass=own * link.mass,
                localInertiaDiagonal=[turning * moment for moment in self._moments[link.name]],  # else Bullet's own
                physicsClientId=self._client,
            )
        self._scales = scales

    def set_friction(self, coefficient: float) -> None:
        if coefficient == self._friction:
            return
        self._set_foot_friction(coefficient)
        # a contact point keeps the coefficient of its creation: lift the robot briefly, so that all are new
        client: dict[str, Any] = {"physicsClientId": self._client}
        center, quat = bullet.getBasePositionAndOrientation(self._robot, **client)
        velocity, spin = bullet.getBaseVelocity(self._robot, **client)
        bullet.resetBasePositionAndOrientation(self._robot, np.add(center, (0.0, 0.0, 10.0)).tolist(), quat, **client)
        bullet.performCollisionDetection(**client)
        bullet.resetBasePositionAndOrientation(self._robot, center, quat, **client)
        bullet.resetBaseVelocity(self._robot, velocity, spin, **client)

    def _set_foot_friction(self, coefficient: float) -> None:
        for foot in self._feet:
            bullet.changeDynamics(self._robot, foot, lateralFriction=coefficient, physicsClientId=self._client)
        self._friction = coefficient

    def attach_payload(self, mass: float, position: Vector) -> None:
        if self._carried is not None:
            self._carry(mass, position, None)
            return
        self._remove_payload()
        client: dict[str, Any] = {"physicsClientId": self._client}
        center, quat = bullet.getBasePositionAndOrientation(self._robot, **client)
        offset = np.subtract(position, self._com)
        point = np.asarray(center) + _rotation(quat) @ offset
        body = bullet.createMultiBody(
            mass, -1, -1, point.tolist(), quat, **client
        )  # its ball exists only in rendered images
        moment = 0.4 * mass * PAYLOAD_RADIUS**2
        bullet.changeDynamics(
            body, -1, localInertiaDiagonal=[moment] * 3, linearDamping=0.0, angularDamping=0.0, **client
        )
        joint = bullet.createConstraint(
            self._robot, -1, body, -1, bullet.JOINT_FIXED, [0, 0, 0], offset.tolist(), [0, 0, 0], **client
        )
        bullet.changeConstraint(joint, maxForce=PAYLOAD_FORCE, **client)
        velocity, spin = bullet.getBaseVelocity(self._robot, **client)
        velocity = np.asarray(velocity) + np.cross(spin, point - center)
        bullet.resetBaseVelocity(body, velocity.tolist(), spin, **client)
        self._payload, self._holder, self._ballast = body, joint, (mass, position)

    def _carry(self, mass: float, position: Vector, fall: Fall | None) -> None:
        """Set the payload of a fixed robot, which is a link: elsewhere it is another link."""
        carried = self._carried
        if carried is None:
            return
        states = {name: bullet.getJointState(self._robot, joint, physicsClientId=self._client)[:2]
                  for name, joint in self._links.items() if joint >= 0}  # fmt: skip
        if position != carried.position:
            for gear in self._gears:
                bullet.removeConstraint(gear, physicsClientId=self._client)
            bullet.removeState(self._fresh, physicsClientId=self._client)
            bullet.removeBody(self._robot, physicsClientId=self._client)
            carried.position = position
            self._robot = self._build_robot()
            scales, self._scales = self._scales, (1.0, {}, 1.0)
            self.scale_masses(*scales)
        bullet.restoreState(self._fresh, physicsClientId=self._client)  # also without a rebuild: no solver's memory
        for name, (angle, rate) in states.items():
            bullet.resetJointState(self._robot, self._links[name], angle, rate, physicsClientId=self._client)
        carried.mass, carried.fall = mass, fall
        heavy = {"mass": max(mass, MASSLESS), "localInertiaDiagonal": [carried.moment] * 3}
        bullet.changeDynamics(self._robot, self._links[PAYLOAD], **heavy, physicsClientId=self._client)

    def _release(self, carried: Carried) -> None:
        """Let the payload of a fixed robot fall."""
        link = self._links[PAYLOAD]
        state = bullet.getLinkState(self._robot, link, 1, 1, physicsClientId=self._client)
        self._carry(0.0, carried.position, Fall(state[0], state[6], self._steps * self.time_step))

    def release_payload(self) -> None:
        if self._carried is not None:
            if self._carried.mass > 0:
                self._release(self._carried)
            return
        if self._holder is not None:
            bullet.removeConstraint(self._holder, physicsClientId=self._client)
            self._holder = None

    def payload_position(self) -> Vector | None:
        if self._carried is not None:
            if self._carried.mass > 0:
                link = self._links[PAYLOAD]
                return bullet.getLinkState(self._robot, link, computeForwardKinematics=1, physicsClientId=self._client)[
                    0
                ]
            return self._carried.fallen(self._steps * self.time_step, self._gravity)
        if self._payload is None:
            return None
        return bullet.getBasePositionAndOrientation(self._payload, physicsClientId=self._client)[0]

    def _remove_payload(self) -> None:
        if self._carried is not None:
            self._carry(0.0, self._carried.home, None)
            return
        self.release_payload()
        if self._payload is not None:
            bullet.removeBody(self._payload, physicsClientId=self._client)
            self._payload = None

    def render(self, camera: Camera, load: Vector | None = None) -> NDArray[np.uint8]:
        view = bullet.computeViewMatrixFromYawPitchRoll(
            camera.target, camera.distance, camera.yaw_deg, -camera.pitch_deg, 0.0, 2
        )
        lens = bullet.computeProjectionMatrixFOV(FIELD_OF_VIEW, camera.width / camera.height, NEAR, FAR_PLANE)
        payload, ball = self.payload_position() if load is None else load, None
        if payload is not None:  # only now: reading the mesh of its ball takes longer than a reset
            ball = bullet.createMultiBody(0.0, -1, self._ball, payload, physicsClientId=self._client)
        _, _, rgba, _, body = bullet.getCameraImage(
            camera.width,
            camera.height,
            view,
            lens,
            lightDirection=SUN,
            shadow=0,
            renderer=bullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        if ball is not None:
            bullet.removeBody(ball, physicsClientId=self._client)
        size = (camera.height, camera.width)
        picture = np.asarray(rgba, dtype=np.uint8).reshape(*size, 4)[..., :3].copy()
        bare = np.isin(np.asarray(body).reshape(size), (-1, self._ground))
        paint(picture, bare, camera, self._shadow.polygons(self.state(), payload))
        return picture

    def close(self) -> None:
        self._finalizer()

    def _link_frame(self, link: str) -> tuple[Vector, Quaternion]:
        index = self._links[link]
        if index < 0:
            state = self.state()
            return state.position, state.quat_xyzw
        state = bullet.getLinkState(self._robot, index, computeForwardKinematics=1, physicsClientId=self._client)
        return state[4], state[5]


def _rotation(quat_xyzw: Quaternion) -> Array:
    return np.array(bullet.getMatrixFromQuaternion(quat_xyzw)).reshape(3, 3)


def _disconnect(client: int) -> None:
    if bullet.isConnected(physicsClientId=client):
        bullet.disconnect(physicsClientId=client)
