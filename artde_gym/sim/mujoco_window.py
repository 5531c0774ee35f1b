"""MuJoCo's window with GLFW: shows a robot that is simulated elsewhere and reads keys and clicks."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Sequence
from typing import Any

import glfw
import mujoco
import numpy as np

from artde_gym.arrays import Array
from artde_gym.errors import OptionError
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.sim.camera import FIELD_OF_VIEW, WITHOUT_WINDOW, Camera
from artde_gym.sim.engine import PAYLOAD_COLOR, PAYLOAD_LOOK, State
from artde_gym.sim.mujoco_world import Blueprint

mj: Any = mujoco  # compiled, without type information

SIZE = (1024, 768)
CLICK_RADIUS = 60.0  # pixels, largest distance of a click from its target
RED, GROUND = (0.77, 0.09, 0.24, 1.0), (0.82, 0.84, 0.86, 1.0)
ARROW_THICKNESS = 0.012  # m
ARROW_FRAMES = 12  # lifetime of an arrow
MAX_SHAPES = 1000  # most shapes in a scene
ZOOM_SHARE = -0.05  # of the distance, per notch of the wheel

_KEYS = {
    glfw.KEY_LEFT: "left",
    glfw.KEY_RIGHT: "right",
    glfw.KEY_UP: "up",
    glfw.KEY_DOWN: "down",
    glfw.KEY_SPACE: "space",
    glfw.KEY_ESCAPE: "escape",
}


class MujocoWindow:
    """A window that displays the robot of any engine; it simulates nothing.

    Dragging with the left button turns the view, the wheel zooms. Call `load` first.

    Raises:
        OptionError: without a display with OpenGL.
    """

    def __init__(self) -> None:
        errors: list[str] = []
        glfw.set_error_callback(lambda _, text: errors.append(str(text, "utf-8") if isinstance(text, bytes) else text))
        self._window: Any = glfw.create_window(*SIZE, "artde-gym", None, None) if glfw.init() else None
        if self._window is None:
            why = errors[-1] if errors else "GLFW reports no reason"
            raise OptionError("display", os.environ.get("DISPLAY"), WITHOUT_WINDOW, f"has no OpenGL ({why})")
        glfw.make_context_current(self._window)
        glfw.swap_interval(0)
        self._keys: deque[str] = deque()
        self._presses: list[tuple[float, float]] = []
        self._drag: tuple[float, float] | None = None
        self._eye = mj.MjvCamera()
        self._lines: Sequence[str] = ()
        self._arrows: list[tuple[Vector, Vector, int]] = []
        glfw.set_key_callback(self._window, self._on_key)
        glfw.set_char_callback(self._window, lambda _, code: self._keys.append(chr(code)) if code != 32 else None)
        glfw.set_mouse_button_callback(self._window, self._on_button)
        glfw.set_cursor_pos_callback(self._window, self._on_move)
        glfw.set_scroll_callback(
            self._window, lambda _, _x, y: self._turn(mj.mjtMouse.mjMOUSE_ZOOM, 0.0, ZOOM_SHARE * y)
        )

    def load(self, spec: RobotSpec) -> None:
        """Build the robot and start drawing."""
        blueprint = Blueprint(spec, 0.001)
        self._model, self._joints = blueprint.model, blueprint.joints
        self._data = mj.MjData(self._model)
        self._scene = mj.MjvScene(self._model, MAX_SHAPES)
        self._painter = mj.MjrContext(self._model, mj.mjtFontScale.mjFONTSCALE_150)

    def show(self, state: State, payload: Vector | None) -> None:
        """Show the robot's state and the center of its payload (m), if it has one."""
        if not self.open:
            return
        self._data.qpos[:3] = state.position
        self._data.qpos[3:7] = np.roll(state.quat_xyzw, 1)
        self._data.qpos[7:][self._joints] = state.q
        mj.mj_forward(self._model, self._data)
        everything = mj.mjtCatBit.mjCAT_ALL.value
        mj.mjv_updateScene(self._model, self._data, mj.MjvOption(), None, self._eye, everything, self._scene)
        self._shape(mj.mjtGeom.mjGEOM_BOX, (0.0, 0.0, -0.01), (30.0, 30.0, 0.01), GROUND)
        if payload is not None:
            self._shape(mj.mjtGeom.mjGEOM_SPHERE, payload, (PAYLOAD_LOOK, 0.0, 0.0), PAYLOAD_COLOR)
        for tail, tip, _ in self._arrows:
            shape = self._shape(mj.mjtGeom.mjGEOM_ARROW, tail, (ARROW_THICKNESS, ARROW_THICKNESS, ARROW_THICKNESS), RED)
            mj.mjv_connector(shape, mj.mjtGeom.mjGEOM_ARROW, ARROW_THICKNESS, np.array(tail), np.array(tip))
        self._arrows = [(tail, tip, left - 1) for tail, tip, left in self._arrows if left > 1]
        rect = mj.MjrRect(0, 0, *glfw.get_framebuffer_size(self._window))
        mj.mjr_render(rect, self._scene, self._painter)
        place, font = mj.mjtGridPos.mjGRID_TOPLEFT, mj.mjtFont.mjFONT_NORMAL
        mj.mjr_overlay(font, place, rect, "\n".join(self._lines), "", self._painter)
        glfw.swap_buffers(self._window)

    def close(self) -> None:
        """Close it; safe to call twice and after the user closed it."""
        if self._window is not None:
            if hasattr(self, "_painter"):
                self._painter.free()
            glfw.destroy_window(self._window)
            self._window = None
            glfw.terminate()

    @property
    def open(self) -> bool:
        """True until it is closed."""
        return self._window is not None and not glfw.window_should_close(self._window)

    def pressed(self) -> list[str]:
        """Return keys pressed since the last call: "left", "right", "up", "down", "space" or a character."""
        glfw.poll_events()
        keys = list(self._keys)
        self._keys.clear()
        return keys

    def clicked(self, points: Sequence[Vector]) -> int | None:
        """Return the index of the point (m) clicked with the left button since the last call."""
        presses, self._presses = self._presses, []
        if not presses:
            return None
        off = np.hypot(*(self._project(np.asarray(points)) - np.array(presses[-1])).T)
        nearest = int(np.argmin(off))
        return nearest if off[nearest] < CLICK_RADIUS else None

    def ahead(self) -> Vector:
        """Return the horizontal viewing direction (unit vector)."""
        azimuth = np.radians(self._eye.azimuth)
        return float(np.cos(azimuth)), float(np.sin(azimuth)), 0.0

    def look(self, camera: Camera) -> None:
        """Set the view to that of a camera."""
        self._eye.lookat[:] = camera.target
        self._eye.distance, self._eye.elevation = camera.distance, -camera.pitch_deg
        self._eye.azimuth = camera.yaw_deg + 90.0

    def follow(self, target: Vector) -> None:
        """Look at a position (m) in the same direction as before, which the user may have changed."""
        self._eye.lookat[:] = target

    def write(self, lines: Sequence[str], place: Vector) -> None:
        """Show lines of text in the corner, replacing previous ones."""
        del place
        self._lines = lines

    def arrow(self, tail: Vector, tip: Vector) -> None:
        """Show a force briefly as an arrow."""
        self._arrows.append((tail, tip, ARROW_FRAMES))

    def _shape(self, kind: Any, place: Vector, size: Vector, color: tuple[float, ...]) -> Any:
        """Add a shape to the scene."""
        shape = self._scene.geoms[self._scene.ngeom]
        self._scene.ngeom += 1
        turned = np.eye(3).ravel()
        mj.mjv_initGeom(shape, kind, np.array(size), np.array(place), turned, np.array(color, dtype=np.float32))
        return shape

    def _project(self, points: Array) -> Array:
        """Return the pixels (n, 2), from the upper left corner, of points (n, 3) (m)."""
        width, height = glfw.get_window_size(self._window)
        azimuth, elevation = np.radians(self._eye.azimuth), np.radians(self._eye.elevation)
        ahead = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
        right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
        seen = points - self._eye.lookat + self._eye.distance * ahead
        scale = height / 2.0 / np.tan(np.radians(FIELD_OF_VIEW) / 2.0) / (seen @ ahead)
        return np.stack([width / 2 + scale * (seen @ right), height / 2 - scale * (seen @ np.cross(right, ahead))], -1)

    def _turn(self, action: Any, x: float, y: float) -> None:
        mj.mjv_moveCamera(self._model, action, x, y, self._scene, self._eye)

    def _on_key(self, _window: Any, key: int, _code: int, action: int, _more: int) -> None:
        if action == glfw.PRESS and key in _KEYS:
            self._keys.append(_KEYS[key])

    def _on_button(self, window: Any, button: int, action: int, _more: int) -> None:
        if button == glfw.MOUSE_BUTTON_LEFT:
            place = glfw.get_cursor_pos(window)
            self._drag = place if action == glfw.PRESS else None
            if action == glfw.PRESS:
                self._presses.append(place)

    def _on_move(self, window: Any, x: float, y: float) -> None:
        if self._drag is not None:
            height = glfw.get_window_size(window)[1]
            self._turn(mj.mjtMouse.mjMOUSE_ROTATE_H, (x - self._drag[0]) / height, (y - self._drag[1]) / height)
            self._drag = x, y
