"""MuJoCo's window, on a virtual display: it shows a robot, and says what was pressed and clicked."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest

SCRIPT = """
import gymnasium as gym
import numpy as np
import artde_gym, controllers
from artde_gym.play import Session
from artde_gym.sim.mujoco_window import MujocoWindow, glfw

window = MujocoWindow()
env = gym.make("BipedPush-v0", engine="mujoco", duration=3.0, disturbances={"payload": 1.3})
window.load(env.unwrapped.engine.spec)
session = Session(env, controllers.make("artde", env), window, "artde")
assert session.turn() and window.open
chest = np.array([env.unwrapped.engine.site("chest")])
(x, y), = window._project(chest)
window._presses.append((x + 5.0, y))
assert window.clicked(chest) == 0
window._presses.append((x + 200.0, y))
assert window.clicked(chest) is None
window._on_key(None, glfw.KEY_UP, 0, glfw.PRESS, 0)
assert window.pressed() == ["up"] and window.pressed() == []
assert abs(np.hypot(*window.ahead()[:2]) - 1.0) < 1e-12
session.press("up")
session.turn()
assert len(window._arrows) == 1
session.press("q")
assert not session.turn()
window.close()
window.close()
assert not window.open
print("well")
"""


@pytest.mark.linux
def test_a_session_in_the_window() -> None:
    xvfb = shutil.which("xvfb-run")
    if xvfb is None:
        pytest.skip("no xvfb-run here; on Debian: apt-get install xvfb xauth")
    done = subprocess.run([xvfb, "-a", sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=False)
    assert done.stdout.strip().endswith("well"), done.stderr
