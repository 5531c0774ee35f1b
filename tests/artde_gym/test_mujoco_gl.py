"""MUJOCO_GL with a value that cannot be honored: what draws nothing works, what draws says what to do."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from artde_gym.errors import OptionError
from artde_gym.sim import opengl

# OSMesa's library is hidden by its name, so that it is missing on every machine
SCRIPT = """
import json, os, sys
from artde_gym.sim import opengl
opengl._LIBRARIES["osmesa"] = "libNone.so.8"
import gymnasium as gym, artde_gym
from artde_gym.errors import OptionError
from artde_gym.doctor import pictures
from artde_gym.doctor.machine import python
kwargs = dict(duration=3.0, disable_env_checker=True, engine="mujoco")
env = gym.make("QuadInfinity-Payload-v0", **kwargs)
env.reset(seed=0)
env.step(env.action_space.sample())
vector = gym.make_vec("BipedWalk-Payload-v0", 2, vectorization_mode="vector_entry_point", engine="mujoco")
vector.reset(seed=0)
try:
    gym.make("QuadInfinity-Payload-v0", render_mode="rgb_array", **kwargs)
    said = ""
except OptionError as error:
    said = str(error)
failed = [line.what for line in python() if line.status == "failed"]
print(json.dumps([said, list(pictures._picture("mujoco", "MuJoCo")), failed, os.environ["MUJOCO_GL"]]))
"""


@pytest.mark.parametrize(
    ("value", "problem", "remedy"),
    [
        pytest.param(
            "nonsense", "is no renderer here", "set it to 'egl' or 'osmesa', or unset it", marks=pytest.mark.linux
        ),
        pytest.param(
            " OSMesa", "needs libNone.so.8, which is missing", "apt install libosmesa6", marks=pytest.mark.linux
        ),
        ("wgl" if sys.platform != "win32" else "cgl", "is no renderer here", "or unset it"),
    ],
)
def test_only_what_draws_minds_the_variable(value: str, problem: str, remedy: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        env={**os.environ, "MUJOCO_GL": value},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    said, (what, status, found, todo), failed, left = json.loads(done.stdout)
    assert said == f"environment variable MUJOCO_GL {value!r} {problem}; {todo}"
    assert remedy in todo
    assert (what, status) == ("pictures in MuJoCo", "missing")
    assert found == f"environment variable MUJOCO_GL {value!r} {problem}"
    assert failed == []
    assert left == value, "the user's variable is changed"


@pytest.mark.linux
def test_another_platform_of_pyopengl_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opengl, "_loads", lambda name: name == "egl")
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setenv("PYOPENGL_PLATFORM", "glx")
    with pytest.raises(OptionError, match="PYOPENGL_PLATFORM 'glx' contradicts MuJoCo's 'egl'; set it to 'egl', or"):
        opengl.context()
