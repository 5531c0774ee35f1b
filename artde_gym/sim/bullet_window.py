"""Bullet's window: shows a robot that is simulated elsewhere and reads keys and clicks."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pybullet_data

from artde_gym.errors import OptionError
from artde_gym.multibody.spec import RobotSpec, Vector
from artde_gym.multibody.urdf import urdf
from artde_gym.sim.camera import WITHOUT_WINDOW, Camera
from artde_gym.sim.engine import PAYLOAD_COLOR, PAYLOAD_LOOK, State
from artde_gym.sim.ground import SUN
from artde_gym.sim.pybullet_module import bullet
from artde_gym.sim.rotation import rotate

PATIENCE = 60.0  # s, timeout for the first window
CLICK_RADIUS = 60.0  # pixels, largest distance of a click from its target
INK, RED = (0.1, 0.12, 0.14), (0.77, 0.09, 0.24)
TEXT_HEIGHT = 0.55  # m, height of the text above the camera's target
LIGHT_DISTANCE = 3.0  # multiple of the sun's vector at which the lamp is
ARROW_LIFETIME = 0.4  # s
_HIDDEN_POSITION: Vector = (0.0, 0.0, -10.0)  # m, below the ground
_LINE_SPACING = 0.09  # m, of the text

_KEYS = {
    bullet.B3G_LEFT_ARROW: "left",
    bullet.B3G_RIGHT_ARROW: "right",
    bullet.B3G_UP_ARROW: "up",
    bullet.B3G_DOWN_ARROW: "down",
    bullet.B3G_SPACE: "space",
    27: "escape",
}
_PROBE = "import pybullet; pybullet.disconnect(pybullet.connect(pybullet.GUI))"


def require_window() -> None:
    """Check that a window can be opened; otherwise Bullet would end the process.

    Raises:
        OptionError: without a display with OpenGL.
    """
    where = os.environ.get("DISPLAY")
    if not where:
        raise OptionError("display", None, WITHOUT_WINDOW, "cannot open a window (DISPLAY is not set)")
    try:
        done = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired as error:
        raise OptionError("display", where, WITHOUT_WINDOW, f"opened no window within {PATIENCE:g} s") from error
    if done.returncode:
        said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        why = said[-1].strip() if said else f"exit code {done.returncode}"
        raise OptionError("display", where, WITHOUT_WINDOW, f"has no OpenGL 3 ({why})")


class BulletWindow:
    """A window that displays the robot of any engine; it simulates nothing.

    Open it before the first engine of a process: Bullet's window stays black beside an older client. Then `load`.

    Raises:
        OptionError: without a display with OpenGL.
    """

    def __init__(self) -> None:
        require_window()
        number = bullet.connect(bullet.GUI)
        self._client: dict[str, Any] = {"physicsClientId": number}
        self._words: list[int] = []
        self._down: set[int] = set()
        hidden = (
            bullet.COV_ENABLE_GUI,
            bullet.COV_ENABLE_KEYBOARD_SHORTCUTS,
            bullet.COV_ENABLE_MOUSE_PICKING,
            bullet.COV_ENABLE_RENDERING,
        )
        for flag in hidden:
            bullet.configureDebugVisualizer(flag, 0, **self._client)

    def load(self, spec: RobotSpec) -> None:
        """Build ground, payload and robot, and start drawing."""
        self._spec = spec
        data = Path(pybullet_data.getDataPath())
        ground = self._body(bullet.GEOM_MESH, fileName=str(data / "plane100.obj"))
        checks = bullet.loadTexture(str(data / "checker_blue.png"), **self._client)
        bullet.changeVisualShape(ground, -1, textureUniqueId=checks, specularColor=[0.0] * 3, **self._client)
        self._payload = self._body(bullet.GEOM_SPHERE, radius=PAYLOAD_LOOK, rgbaColor=PAYLOAD_COLOR)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(urdf(spec), encoding="utf-8")
            self._robot = bullet.loadURDF(str(file), flags=bullet.URDF_USE_INERTIA_FROM_FILE, **self._client)
        joints = range(bullet.getNumJoints(self._robot, **self._client))
        links = {bullet.getJointInfo(self._robot, i, **self._client)[12].decode(): i for i in joints}
        self._joints = [links[name] for name in spec.actuated]
        light = [LIGHT_DISTANCE * part for part in SUN]
        bullet.configureDebugVisualizer(bullet.COV_ENABLE_RENDERING, 1, lightPosition=light, **self._client)

    def _body(self, kind: int, **shape: Any) -> int:
        return bullet.createMultiBody(0.0, -1, bullet.createVisualShape(kind, **shape, **self._client), **self._client)

    def show(self, state: State, payload: Vector | None) -> None:
        """Show the robot's state and the center of its payload (m), if it has one."""
        center = np.add(state.position, rotate(self._spec.base.com, state.quat_xyzw)).tolist()
        bullet.resetBasePositionAndOrientation(self._robot, center, state.quat_xyzw, **self._client)
        if self._joints:
            angles = [[angle] for angle in state.q.tolist()]
            bullet.resetJointStatesMultiDof(self._robot, self._joints, angles, **self._client)
        bullet.resetBasePositionAndOrientation(
            self._payload, payload or _HIDDEN_POSITION, (0.0, 0.0, 0.0, 1.0), **self._client
        )

    def close(self) -> None:
        """Close it; safe to call twice and after the user closed it."""
        if self.open:
            bullet.disconnect(**self._client)

    @property
    def open(self) -> bool:
        """True until it is closed."""
        return bool(bullet.isConnected(**self._client))

    def pressed(self) -> list[str]:
        """Return keys pressed since the last call: "left", "right", "up", "down", "space" or a character."""
        new = []
        for key, state in bullet.getKeyboardEvents(**self._client).items():
            if state & bullet.KEY_WAS_TRIGGERED:
                self._down.add(key)
                new.append(key)
            elif state & bullet.KEY_WAS_RELEASED:
                if key not in self._down:  # pressed and released between two calls: Bullet reports only the release
                    new.append(key)
                self._down.discard(key)
        return [_KEYS.get(key) or chr(key) for key in new if key in _KEYS or 32 < key < 127]

    def clicked(self, points: Sequence[Vector]) -> int | None:
        """Return the index of the point (m) clicked with the left button since the last call."""
        presses = [
            (x, y)
            for kind, x, y, button, state in bullet.getMouseEvents(**self._client)
            if kind == 2 and button == 0 and state & bullet.KEY_WAS_TRIGGERED
        ]
        if not presses:
            return None
        width, height, view, lens, *_ = bullet.getDebugVisualizerCamera(**self._client)
        through = np.reshape(lens, (4, 4)).T @ np.reshape(view, (4, 4)).T
        seen = np.column_stack([np.asarray(points), np.ones(len(points))]) @ through.T
        x = (seen[:, 0] / seen[:, 3] + 1) * width / 2
        y = (1 - seen[:, 1] / seen[:, 3]) * height / 2
        off = np.hypot(x - presses[-1][0], y - presses[-1][1])
        nearest = int(np.argmin(off))
        return nearest if off[nearest] < CLICK_RADIUS else None

    def ahead(self) -> Vector:
        """Return the horizontal viewing direction (unit vector)."""
        x, y, _ = bullet.getDebugVisualizerCamera(**self._client)[5]
        size = float(np.hypot(x, y)) or 1.0
        return x / size, y / size, 0.0

    def look(self, camera: Camera) -> None:
        """Set the view to that of a camera."""
        bullet.resetDebugVisualizerCamera(
            camera.distance, camera.yaw_deg, -camera.pitch_deg, camera.target, **self._client
        )

    def follow(self, target: Vector) -> None:
        """Look at a position (m) in the same direction as before, which the user may have changed."""
        *_, yaw, pitch, distance, _ = bullet.getDebugVisualizerCamera(**self._client)
        bullet.resetDebugVisualizerCamera(distance, yaw, pitch, target, **self._client)

    def write(self, lines: Sequence[str], place: Vector) -> None:
        """Show lines of text above a position (m), replacing previous ones."""
        x, y, z = place
        for number, line in enumerate(lines):
            at = (x, y, z + TEXT_HEIGHT + _LINE_SPACING * (len(lines) - number))
            more = {"replaceItemUniqueId": self._words[number]} if number < len(self._words) else {}
            item = bullet.addUserDebugText(line, at, INK, 1.2, **more, **self._client)
            self._words[number : number + 1] = [item]

    def arrow(self, tail: Vector, tip: Vector) -> None:
        """Show a force briefly as an arrow."""
        bullet.addUserDebugLine(tail, tip, RED, 6.0, ARROW_LIFETIME, **self._client)
