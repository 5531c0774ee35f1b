"""Minimal simulation loops of the bare engines, the reference for the speed of environments."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.sim.engine import Engine
from artde_gym.sim.factory import missing_bullet

MAX_CLIENTS = 1024  # per process, PyBullet's limit


def joint_loop(engine: Engine) -> Callable[[Array], Any]:
    """Return a function of joint torques that writes them, steps and reads the joints."""
    if engine.name == "bullet":
        bullet, client, robot, joints = _bullet(engine)

        def in_bullet(tau: Array) -> Any:
            bullet.setJointMotorControlArray(
                robot, joints, bullet.TORQUE_CONTROL, forces=tau.tolist(), physicsClientId=client
            )
            bullet.stepSimulation(physicsClientId=client)
            return bullet.getJointStates(robot, joints, physicsClientId=client)

        return in_bullet
    mj, model, data, joints = _mujoco(engine)
    torques = data.qfrc_applied[0 if engine.spec.fixed else 6 :]

    def in_mujoco(tau: Array) -> Any:
        torques[joints] = tau
        mj.mj_step(model, data)
        return data.qpos.copy(), data.qvel.copy()

    return in_mujoco


def joint_loops(engine: Engine, n: int) -> Callable[[Array], Any]:
    """Return a function of joint torques (n, joints) that writes them, steps and reads the joints, robot by robot.

    The `n` robots are in MuJoCo, share the engine's model, and begin as its robot is now, each in memory of its own.
    """
    mj, model, data, joints = _mujoco(engine)
    first = 0 if engine.spec.fixed else 6
    robots = [copy.copy(data) for _ in range(n)]
    torques = [robot.qfrc_applied[first:] for robot in robots]

    def in_mujoco(tau: Array) -> Any:
        read = []
        for robot, written, given in zip(robots, torques, tau, strict=True):
            written[joints] = given
            mj.mj_step(model, robot)
            read.append((robot.qpos.copy(), robot.qvel.copy()))
        return read

    return in_mujoco


def body_loop(engine: Engine, steps: int) -> Callable[[Array], Any]:
    """Return a function of a wrench [u1 (N), u2, u3, u4 (Nm)] that writes it and steps `steps` times, then reads."""
    if engine.name == "bullet":
        (bullet, client, robot, _), origin = _bullet(engine), (0.0, 0.0, 0.0)

        def in_bullet(wrench: Array) -> Any:
            u1, *torque = wrench.tolist()
            force = (0.0, 0.0, u1)
            for _ in range(steps):
                bullet.applyExternalForce(robot, -1, force, origin, bullet.LINK_FRAME, physicsClientId=client)
                bullet.applyExternalTorque(robot, -1, torque, bullet.LINK_FRAME, physicsClientId=client)
                bullet.stepSimulation(physicsClientId=client)
            position = bullet.getBasePositionAndOrientation(robot, physicsClientId=client)
            return position, bullet.getBaseVelocity(robot, physicsClientId=client)

        return in_bullet
    mj, model, data, _ = _mujoco(engine)
    mj.mj_kinematics(model, data)  # after a restore, MuJoCo updates orientations only in the first step

    def in_mujoco(wrench: Array) -> Any:
        u1, *torque = wrench.tolist()
        for _ in range(steps):
            rot = data.xmat[1].reshape(3, 3)
            data.xfrc_applied[1, :3] = u1 * rot[:, 2]
            data.xfrc_applied[1, 3:] = rot @ np.array(torque)
            mj.mj_step(model, data)
        return data.qpos.copy(), data.qvel.copy()

    return in_mujoco


def open_clients() -> int:
    """Count Bullet's open physics clients of this process; MuJoCo has none."""
    if missing_bullet():
        return 0
    from artde_gym.sim.pybullet_module import bullet

    return sum(bool(bullet.isConnected(physicsClientId=client)) for client in range(MAX_CLIENTS))


def _bullet(engine: Any) -> tuple[Any, Any, Any, Any]:
    from artde_gym.sim.pybullet_module import bullet  # not installed everywhere, but a Bullet engine implies it

    return bullet, engine._client, engine._robot, engine._joints


def _mujoco(engine: Any) -> tuple[Any, Any, Any, Any]:
    from artde_gym.sim.mujoco_module import mj  # only when asked for

    return mj, engine._model, engine._data, engine._joints
