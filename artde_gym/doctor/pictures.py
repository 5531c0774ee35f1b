"""Checks of rendering, ffmpeg and Chromium, which results do not need."""

from __future__ import annotations

import importlib
import importlib.util
import shutil
import subprocess
from typing import Any

import gymnasium as gym

from artde_gym.doctor.check_result import CheckResult
from artde_gym.errors import MissingDependencyError, OptionError
from artde_gym.sim.factory import ENGINES

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def pictures() -> list[CheckResult]:
    """Check rendering, ffmpeg and Chromium."""
    drawn = [_picture(name, engine.title) for name, engine in ENGINES.items()]
    return [*drawn, _ffmpeg(), _browser()]


def _picture(engine: str, written: str) -> CheckResult:
    """Check rendering without a display."""
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


def _ffmpeg() -> CheckResult:
    """Check for ffmpeg: the system's, or the one that comes with MoviePy."""
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
    """Check for Chromium, which only the tests of reports need."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        return CheckResult("Chromium", "missing", "not found: tests of reports are skipped", "apt install chromium")
    said = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=20, check=False).stdout
    return CheckResult("Chromium", "ok", said.strip())
