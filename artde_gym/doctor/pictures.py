"""Displays, OpenGL, ffmpeg and Chromium: nothing that results need."""

from __future__ import annotations

import ctypes
import importlib
import importlib.util
import os
import shutil
import subprocess
import sys
from typing import Any

import gymnasium as gym

import artde_gym  # noqa: F401  # registers the environments
from artde_gym.doctor.check_result import CheckResult
from artde_gym.errors import MissingDependencyError, OptionError
from artde_gym.sim.factory import ENGINES

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def pictures() -> list[CheckResult]:
    """Each of them by itself."""
    drawn = [_picture(name, engine.title) for name, engine in ENGINES.items()]
    return [*drawn, _display(), _ffmpeg(), _browser()]


def _picture(engine: str, written: str) -> CheckResult:
    """A picture without a display."""
    what = f"pictures in {written}"
    try:
        env: Any = gym.make("QuadInfinity-Payload-v0", disable_env_checker=True, duration=3.0, engine=engine,
                       render_mode="rgb_array")  # fmt: skip
        env.reset(seed=0)
        picture = env.render()
        env.close()
    except MissingDependencyError as error:
        return CheckResult(what, "missing", f"no {written}", error.allowed)
    except OptionError as error:
        return CheckResult(what, "missing", "no OpenGL without a display", str(error.allowed))
    height, width, _ = picture.shape
    return CheckResult(what, "ok", f"{width} x {height}, without a display")


def _display() -> CheckResult:
    """An X server that answers: a window of Bullet's ends the interpreter where none does."""
    remedy = "nothing but live windows need one: work at a desktop, or with `ssh -X`; pictures and videos need none"
    if sys.platform != "linux":
        return CheckResult("display", "ok", "the window system's")
    name = os.environ.get("DISPLAY")
    if not name:
        return CheckResult("display", "missing", "none", remedy)
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return CheckResult("display", "missing", f"{name}, but no libX11", "apt install libx11-6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    server = x11.XOpenDisplay(None)
    if not server:
        return CheckResult("display", "missing", f"{name} does not answer", remedy)
    x11.XCloseDisplay(ctypes.c_void_p(server))
    return CheckResult("display", "ok", name)


def _ffmpeg() -> CheckResult:
    """The system's, or the one that MoviePy brings."""
    path = shutil.which("ffmpeg")
    if path is None and importlib.util.find_spec("imageio_ffmpeg") is not None:
        try:
            path = importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
        except RuntimeError:
            path = None
    if path is None:
        return CheckResult(
            "ffmpeg", "missing", "not found: no .mp4", "pip install 'artde-gym[video]', or apt install ffmpeg"
        )
    said = subprocess.run([path, "-version"], capture_output=True, text=True, timeout=20, check=False).stdout
    return CheckResult("ffmpeg", "ok", " ".join(said.split()[:3]))


def _browser() -> CheckResult:
    """For the tests of reports alone; any browser opens one."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        return CheckResult("Chromium", "missing", "not found: tests of reports are skipped", "apt install chromium")
    said = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=20, check=False).stdout
    return CheckResult("Chromium", "ok", said.strip())
