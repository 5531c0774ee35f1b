"""Offscreen rendering of a MuJoCo world with OpenGL."""

from __future__ import annotations

import atexit
import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.multibody.mjcf import mjcf
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim import opengl
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import PAYLOAD_COLOR, PAYLOAD_LOOK
from artde_gym.sim.mujoco_module import mj

_MAX_SHAPES = 1000  # most shapes in a scene


class Canvas:
    """A renderer of one robot, with a model of its own that has the shapes which physics do without.

    Raises:
        OptionError: if offscreen OpenGL is unavailable.
    """

    def __init__(self, spec: RobotSpec) -> None:
        self._model = model = mj.MjModel.from_xml_string(mjcf(spec))
        self._data = mj.MjData(model)
        self._context = context = opengl.context()
        context.make_current()
        self._painter = mj.MjrContext(model, mj.mjtFontScale.mjFONTSCALE_100)
        mj.mjr_setBuffer(mj.mjtFramebuffer.mjFB_OFFSCREEN, self._painter)
        self._scene = mj.MjvScene(model, _MAX_SHAPES)
        self._finalizer = weakref.finalize(self, _free, context, self._painter)
        self._finalizer.atexit = False  # too late: EGL's display is closed by then
        atexit.register(self._finalizer)

    def draw(self, qpos: Array, camera: Camera, ball: Vector | None) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
        """Render an image (height, width, 3), with the payload at `ball` (m), if any; also return its empty pixels."""
        self._data.qpos[:] = qpos
        mj.mj_kinematics(self._model, self._data)
        mj.mj_camlight(self._model, self._data)
        scene, rect = self._scene, mj.MjrRect(0, 0, camera.width, camera.height)
        eye = mj.MjvCamera()
        eye.lookat[:] = camera.target
        eye.distance, eye.azimuth, eye.elevation = camera.distance, camera.yaw_deg + 90.0, -camera.pitch_deg
        everything = mj.mjtCatBit.mjCAT_ALL.value
        mj.mjv_updateScene(self._model, self._data, mj.MjvOption(), None, eye, everything, scene)
        if ball is not None and ball[2] > -PAYLOAD_LOOK:  # the ground, which would hide it, is not drawn
            size, color = np.full(3, PAYLOAD_LOOK), np.array(PAYLOAD_COLOR, dtype=np.float32)
            shape = mj.mjtGeom.mjGEOM_SPHERE
            mj.mjv_initGeom(scene.geoms[scene.ngeom], shape, size, np.array(ball), np.eye(3).ravel(), color)
            scene.ngeom += 1
        picture = np.empty((camera.height, camera.width, 3), dtype=np.uint8)
        depth = np.empty((camera.height, camera.width), dtype=np.float32)
        self._context.make_current()
        if (self._painter.offWidth, self._painter.offHeight) != (camera.width, camera.height):
            mj.mjr_resizeOffscreen(camera.width, camera.height, self._painter)
        mj.mjr_render(rect, scene, self._painter)
        mj.mjr_readPixels(picture, depth, rect, self._painter)
        return picture[::-1].copy(), depth[::-1] == 1.0  # OpenGL counts rows from below

    def close(self) -> None:
        """Free the context; safe to call twice."""
        self._finalizer()
        atexit.unregister(self._finalizer)


def _free(context: Any, painter: Any) -> None:
    context.make_current()
    painter.free()
    context.free()
