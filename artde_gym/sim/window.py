"""A window of Bullet's own onto a world that is being simulated: what it shows, and what a person does in it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from artde_gym.errors import OptionError
from artde_gym.robots.spec import Vector
from artde_gym.sim.camera import Camera
from artde_gym.sim.quiet import bullet

PATIENCE = 60.0  # s, for a first window to open
NEAR_CLICK = 60.0  # pixels, that a click may be off what it is meant for
INK, RED = (0.1, 0.12, 0.14), (0.77, 0.09, 0.24)
ABOVE = 0.7  # m, of the words above what the camera looks at
LASTING = 0.4  # s, that an arrow stays
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
    if not os.environ.get("DISPLAY"):
        raise OptionError("window", True, "False without a display (DISPLAY is not set); `artde-gym video` needs none")
    try:
        done = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired as error:
        raise OptionError("window", True, f"False: no window opened within {PATIENCE:g} s") from error
    if done.returncode:
        said = [line for line in (done.stdout + done.stderr).splitlines() if line.strip()]
        why = said[-1].strip() if said else f"exit code {done.returncode}"
        where = os.environ["DISPLAY"]
        raise OptionError("window", True, f"False: display {where!r} shows no OpenGL 3 ({why}); `artde-gym video` can")


class Window:
    """The window of one client of Bullet."""

    def __init__(self, client: int) -> None:
        self._client: dict[str, Any] = {"physicsClientId": client}
        self._words: list[int] = []
        for flag in (bullet.COV_ENABLE_GUI, bullet.COV_ENABLE_KEYBOARD_SHORTCUTS, bullet.COV_ENABLE_MOUSE_PICKING):
            bullet.configureDebugVisualizer(flag, 0, **self._client)

    @property
    def open(self) -> bool:
        """Whether it is still there."""
        return bool(bullet.isConnected(**self._client))

    def keys(self) -> list[str]:
        """Keys that were pressed since this was last asked: "left", "right", "up", "down", "space", or a character."""
        pressed = [
            key for key, state in bullet.getKeyboardEvents(**self._client).items() if state & bullet.KEY_WAS_TRIGGERED
        ]
        return [_KEYS.get(key) or chr(key) for key in pressed if key in _KEYS or 32 < key < 127]

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
            at = (x, y, z + ABOVE - _LINE * number)
            more = {"replaceItemUniqueId": self._words[number]} if number < len(self._words) else {}
            item = bullet.addUserDebugText(line, at, INK, 1.2, **more, **self._client)
            self._words[number : number + 1] = [item]

    def arrow(self, tail: Vector, tip: Vector) -> None:
        """Show a force for a moment."""
        bullet.addUserDebugLine(tail, tip, RED, 6.0, LASTING, **self._client)
