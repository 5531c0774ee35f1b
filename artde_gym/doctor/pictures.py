"""Checks of rendering, ffmpeg and Chromium, which results do not need."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import gymnasium as gym

from artde_gym.doctor.check_result import CheckResult
from artde_gym.errors import MissingDependencyError, OptionError
from artde_gym.sim.factory import ENGINES
from artde_gym.video.writer import ffmpeg

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
        return CheckResult(what, "missing", str(error).partition("; ")[0], error.allowed)
    height, width, _ = picture.shape
    return CheckResult(what, "ok", f"{width} x {height}, without a display")


def _ffmpeg() -> CheckResult:
    """Check for ffmpeg as videos find it: the system's, or the one that comes with imageio-ffmpeg."""
    try:
        path = ffmpeg(Path("video.mp4")).get_ffmpeg_exe()
    except OptionError as error:
        return CheckResult("ffmpeg", "missing", "not found: no .mp4", error.allowed)
    said = subprocess.run([path, "-version"], capture_output=True, text=True, timeout=20, check=False).stdout
    return CheckResult("ffmpeg", "ok", " ".join(said.split()[:3]))


def _browser() -> CheckResult:
    """Check for Chromium, which only the tests of reports need."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        return CheckResult("Chromium", "missing", "not found: tests of reports are skipped", "apt install chromium")
    said = subprocess.run([path, "--version"], capture_output=True, text=True, timeout=20, check=False).stdout
    return CheckResult("Chromium", "ok", said.strip())
