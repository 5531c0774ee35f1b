"""Pinocchio as the independent judge of robots and walks, and the engines to be judged."""

from typing import Any

import numpy as np
import pytest

from artde_gym.errors import OptionError
from artde_gym.multibody.spec import RobotSpec
from artde_gym.multibody.urdf import urdf
from artde_gym.robots.ojas.model import ojas
from artde_gym.sim.factory import EngineName, make_engine

try:
    import pinocchio
except ImportError:  # on Windows; tests that need it are deselected
    pinocchio = None
pin: Any = pinocchio  # compiled, without type information


class Judge:
    """A robot spec in Pinocchio, by way of its URDF, in our coordinates.

    Base velocities and forces are in world axes at the base origin, joints are the independent ones in the order of
    the tree; rotor links follow their gears.
    """

    def __init__(self, spec: RobotSpec) -> None:
        self.model = pin.buildModelFromXML(urdf(spec), pin.JointModelFreeFlyer())
        self.data = self.model.createData()
        gears = {gear.rotor: gear for gear in spec.gears}
        self.joints = tuple(link.name for link in spec.joints if link.name not in gears)
        self._turning = []  # joint of the model, index in q, ratio
        for name in self.model.names[2:]:
            driven, ratio = (gears[name].driven, gears[name].ratio) if name in gears else (name, 1.0)
            self._turning.append((self.model.joints[self.model.getJointId(name)], self.joints.index(driven), ratio))
        armature = np.zeros(self.model.nv)
        for name, value in zip(spec.actuated, spec.armature, strict=True):
            armature[self.model.joints[self.model.getJointId(name)].idx_v] = value
        self.model.armature = armature

    def configuration(self, q: np.ndarray, rot: np.ndarray | None = None, position: tuple = (0, 0, 0)) -> np.ndarray:
        rot = np.eye(3) if rot is None else rot
        out = pin.neutral(self.model)
        out[:7] = pin.SE3ToXYZQUAT(pin.SE3(rot, np.array(position, dtype=np.float64)))
        for joint, index, ratio in self._turning:
            angle = ratio * q[index]
            out[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(angle), np.sin(angle)] if joint.nq == 2 else angle
        return out

    def map(self, rot: np.ndarray | None = None) -> np.ndarray:
        """The matrix from our velocities to the model's, which has the base's in base axes."""
        rot = np.eye(3) if rot is None else rot
        out = np.zeros((self.model.nv, 6 + len(self.joints)))
        out[:3, :3] = out[3:6, 3:6] = rot.T
        for joint, index, ratio in self._turning:
            out[joint.idx_v, 6 + index] = ratio
        return out

    def mass_matrix(self, q: np.ndarray, rot: np.ndarray | None = None) -> np.ndarray:
        upper = np.triu(pin.crba(self.model, self.data, self.configuration(q, rot)))
        matrix = upper + np.triu(upper, 1).T
        return self.map(rot).T @ matrix @ self.map(rot)

    def inverse_dynamics(
        self,
        q: np.ndarray,
        qd: np.ndarray,
        qdd: np.ndarray,
        base_velocity: np.ndarray | None = None,
        base_acceleration: np.ndarray | None = None,
        rot: np.ndarray | None = None,
    ) -> np.ndarray:
        velocity = np.zeros(6) if base_velocity is None else base_velocity
        acceleration = np.zeros(6) if base_acceleration is None else base_acceleration.copy()
        acceleration[:3] -= np.cross(velocity[3:], velocity[:3])  # from the origin's to the spatial one
        forces = pin.rnea(
            self.model,
            self.data,
            self.configuration(q, rot),
            self.map(rot) @ np.concatenate([velocity, qd]),
            self.map(rot) @ np.concatenate([acceleration, qdd]),
        )
        return self.map(rot).T @ forces

    def kinetic_energy(self, q: np.ndarray, velocity: np.ndarray, rot: np.ndarray | None = None) -> float:
        """Of the bodies alone, as a sum over them: without armature."""
        pin.forwardKinematics(self.model, self.data, self.configuration(q, rot), self.map(rot) @ velocity)
        energy = 0.0
        for joint in range(1, self.model.njoints):
            motion = self.data.v[joint]
            energy += 0.5 * motion.dot(self.model.inertias[joint] * motion)
        return energy

    def placement(self, link: str, q: np.ndarray, rot: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Position and orientation of a link's frame in world axes, the base origin at zero."""
        pin.framesForwardKinematics(self.model, self.data, self.configuration(q, rot))
        frame = self.data.oMf[self.model.getFrameId(link, pin.BODY)]
        return frame.translation.copy(), frame.rotation.copy()


@pytest.fixture(scope="session")
def judge():
    """Turns a spec into its judge."""
    return Judge


@pytest.fixture(params=["bullet", "mujoco"])
def engine_name(request: pytest.FixtureRequest) -> EngineName:
    """Each engine in turn: what is physics must hold in both."""
    return request.param


@pytest.fixture
def drawing_engine(engine_name: EngineName) -> EngineName:
    """Each engine that can draw on this machine."""
    if engine_name == "mujoco":
        try:
            make_engine("mujoco", ojas(), 0.001, renders=True).close()
        except OptionError as error:
            pytest.skip(str(error))
    return engine_name


def pilot(observation: np.ndarray) -> np.ndarray:
    """A plain cascade of PD loops for the quadrotor's observations (..., 41)."""
    position, velocity, rates = observation[..., 0:3], observation[..., 3:6], observation[..., 15:18]
    rot = observation[..., 6:15].reshape(*observation.shape[:-1], 3, 3)
    acceleration = observation[..., 24:27] + 5.0 * (observation[..., 18:21] - position)
    acceleration = acceleration + 4.0 * (observation[..., 21:24] - velocity) + np.array([0.0, 0.0, 9.81])
    up = acceleration / np.linalg.norm(acceleration, axis=-1, keepdims=True)
    ahead = np.cross([0.0, 1.0, 0.0], up)
    ahead = ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)
    wanted = np.stack([ahead, np.cross(up, ahead), up], axis=-1)
    skew = np.swapaxes(wanted, -1, -2) @ rot
    skew = 0.5 * (skew - np.swapaxes(skew, -1, -2))
    error = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    thrust = 1.48 * (acceleration * rot[..., :, 2]).sum(axis=-1, keepdims=True)
    return np.concatenate([thrust, np.array([0.0125, 0.0125, 0.0225]) * (-60.0 * error - 12.0 * rates)], axis=-1)


@pytest.fixture(name="pilot", scope="session")
def _pilot():
    """A controller of the quadrotor that owes nothing to the project's."""
    return pilot
