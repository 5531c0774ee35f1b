"""Forward kinematics of many robots at once: MuJoCo's own, of a model that holds several copies of the robot.

A call of MuJoCo from Python takes longer than the kinematics of one robot.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from artde_gym.arrays import Array
from artde_gym.multibody.mjcf import mjcf
from artde_gym.multibody.spec import RobotSpec
from artde_gym.sim.mujoco_module import mj

COPIES = 16
"""Robots in a model: of more the call takes no less per robot, and compiling takes much longer."""


class Kinematics:
    """Positions of a robot's sites, bitwise those of `mj_kinematics` on a single robot."""

    def __init__(self, spec: RobotSpec) -> None:
        self._model = mj.MjModel.from_xml_string(_copies(spec))
        self._data = data = mj.MjData(self._model)
        self._q = data.qpos.reshape(COPIES, -1)
        self._places = data.site_xpos.reshape(COPIES, -1, 3)

    def site(self, number: int, poses: Array) -> Array:
        """Return the positions (n, 3) (m, world axes) of the site of this index in all robots.

        Args:
            number: index of the site in the model of one robot.
            poses: generalized coordinates of the robots (n, nq).
        """
        places = self._places[:, number]
        positions = np.empty((len(poses), 3))
        for first in range(0, len(poses), COPIES):
            some = poses[first : first + COPIES]
            self._q[: len(some)] = some
            mj.mj_kinematics(self._model, self._data)
            positions[first : first + COPIES] = places[: len(some)]
        return positions


def _copies(spec: RobotSpec) -> str:
    """Return the MJCF of robots at one place, without shapes, contacts and sensors."""
    root = ET.fromstring(mjcf(spec))
    for part in [*root]:
        if part.tag in ("contact", "equality", "sensor"):
            root.remove(part)
    world = root.findall("worldbody")[0]
    robot = world.findall("body")[0]
    world.remove(robot)
    for body in robot.iter("body"):
        for shape in body.findall("geom"):
            body.remove(shape)
    ET.SubElement(world, "replicate", count=str(COPIES)).append(robot)
    return ET.tostring(root, encoding="unicode")
