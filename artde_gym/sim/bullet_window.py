"""A window of Bullet's own: it shows a robot that is simulated elsewhere, and says what a person does in it."""

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
from artde_gym.sim.camera import Camera
from artde_gym.sim.engine import PAYLOAD_COLOR, PAYLOAD_LOOK, State
from artde_gym.sim.ground import SUN
from artde_gym.sim.pybullet_module import bullet
from artde_gym.sim.rotation import rotate

PATIENCE = 60.0  # s, for a first window to open
NEAR_CLICK = 60.0  # pixels, that a click may be off what it is meant for
INK, RED = (0.1, 0.12, 0.14), (0.77, 0.09, 0.24)
ABOVE = 0.55  # m, of the words above what the camera looks at
LIGHT = 3.0  # of the sun's vector, to the lamp
LASTING = 0.4  # s, that an arrow stays
_AWAY: Vector = (0.0, 0.0, -10.0)  # under the ground
_LINE = 0.09  # m, from one line of words to the next

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
    """See that a window can be opened; Bullet would end the whole process where it cannot.

    Raises:
        OptionError: without a display, or without OpenGL on it.
    """
    where = os.environ.get("DISPLAY")
    if not where:
        raise OptionError(
            "display", None, "one that shows OpenGL 3 (DISPLAY is not set here); `artde-gym video` needs none"
        )
    try:
        done = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired as error:
        raise OptionError("display", where, f"one on which a window opens within {PATIENCE:g} s") from error
    if done.returncode:
        said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        why = said[-1].strip() if said else f"exit code {done.returncode}"
        raise OptionError("display", where, f"one that shows OpenGL 3 (here: {why}); `artde-gym video` needs none")


class BulletWindow:
    """A window onto the world of an engine, whichever it is: it shows what `show` says, and simulates nothing.

    Open it before the first engine of a process: Bullet's window stays black beside an older client. Then `load`.

    Raises:
        OptionError: without a display, or without OpenGL on it.
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
        """Build ground, payload and robot, and begin to draw."""
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
        light = [LIGHT * part for part in SUN]
        bullet.configureDebugVisualizer(bullet.COV_ENABLE_RENDERING, 1, lightPosition=light, **self._client)

    def _body(self, kind: int, **shape: Any) -> int:
        return bullet.createMultiBody(0.0, -1, bullet.createVisualShape(kind, **shape, **self._client), **self._client)

    def show(self, state: State, payload: Vector | None) -> None:
        """The robot as it is, and the center of its payload (m), if it has one."""
        center = np.add(state.position, rotate(self._spec.base.com, state.quat_xyzw)).tolist()
        bullet.resetBasePositionAndOrientation(self._robot, center, state.quat_xyzw, **self._client)
        if self._joints:
            angles = [[angle] for angle in state.q.tolist()]
            bullet.resetJointStatesMultiDof(self._robot, self._joints, angles, **self._client)
        bullet.resetBasePositionAndOrientation(self._payload, payload or _AWAY, (0.0, 0.0, 0.0, 1.0), **self._client)

    def close(self) -> None:
        """Close it; safe to call twice, and after a person closed it."""
        if self.open:
            bullet.disconnect(**self._client)

    @property
    def open(self) -> bool:
        """Whether it is still there."""
        return bool(bullet.isConnected(**self._client))

    def pressed(self) -> list[str]:
        """Keys that were pressed since this was last asked: "left", "right", "up", "down", "space", or a character."""
        new = []
        for key, state in bullet.getKeyboardEvents(**self._client).items():
            if state & bullet.KEY_WAS_TRIGGERED:
                self._down.add(key)
                new.append(key)
            elif state & bullet.KEY_WAS_RELEASED:
                if key not in self._down:  # pressed and released between two questions: Bullet tells of the last only
                    new.append(key)
                self._down.discard(key)
        return [_KEYS.get(key) or chr(key) for key in new if key in _KEYS or 32 < key < 127]

    def clicked(self, points: Sequence[Vector]) -> int | None:
        """Which of some points (m) the left button was pressed at since this was last asked."""
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
        return nearest if off[nearest] < NEAR_CLICK else None

    def ahead(self) -> Vector:
        """Where the eye looks, along the ground (unit vector)."""
        x, y, _ = bullet.getDebugVisualizerCamera(**self._client)[5]
        size = float(np.hypot(x, y)) or 1.0
        return x / size, y / size, 0.0

    def look(self, camera: Camera) -> None:
        """Look from where a camera is."""
        bullet.resetDebugVisualizerCamera(
            camera.distance, camera.yaw_deg, -camera.pitch_deg, camera.target, **self._client
        )

    def follow(self, target: Vector) -> None:
        """Look at a place (m) from the same side as before: a person may have turned the view."""
        *_, yaw, pitch, distance, _ = bullet.getDebugVisualizerCamera(**self._client)
        bullet.resetDebugVisualizerCamera(distance, yaw, pitch, target, **self._client)

    def write(self, lines: Sequence[str], place: Vector) -> None:
        """Show lines of words above a place (m), in place of those before."""
        x, y, z = place
        for number, line in enumerate(lines):
            at = (x, y, z + ABOVE + _LINE * (len(lines) - number))
            more = {"replaceItemUniqueId": self._words[number]} if number < len(self._words) else {}
            item = bullet.addUserDebugText(line, at, INK, 1.2, **more, **self._client)
            self._words[number : number + 1] = [item]

    def arrow(self, tail: Vector, tip: Vector) -> None:
        """Show a force for a moment."""
        bullet.addUserDebugLine(tail, tip, RED, 6.0, LASTING, **self._client)
