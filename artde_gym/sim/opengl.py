"""Offscreen OpenGL for MuJoCo, as the environment variable MUJOCO_GL wants it: through EGL or else OSMesa on Linux.

Only drawing needs it. MuJoCo reads the variable when it is imported and fails if it cannot honor it, so that a wrong
value would end whatever draws nothing, too; `without_bad_choice` hides such a value from that import.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import sys
from collections.abc import Iterator
from typing import Any

from artde_gym.errors import OptionError

VARIABLE = "MUJOCO_GL"
_PYOPENGL = "PYOPENGL_PLATFORM"  # MuJoCo draws through PyOpenGL and refuses another platform than its own
_LIBRARIES = {"egl": "libEGL.so.1", "osmesa": "libOSMesa.so.8"}
_PACKAGES = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}  # Debian's
_UNSPECIFIC = ("", "enable", "enabled", "on", "true", "1", "disable", "disabled", "off", "false", "0", "glfw")
_OWN = {"linux": (*_LIBRARIES, "glx"), "darwin": ("cgl",), "win32": ("wgl",)}
_INSTALL = (
    "install EGL or OSMesa (Debian: apt install libegl1 libgl1-mesa-dri, or libosmesa6), or use engine 'bullet' where "
    "it is installed"
)


@contextlib.contextmanager
def without_bad_choice() -> Iterator[None]:
    """Hide a value of MUJOCO_GL that cannot be honored; drawing reports it."""
    try:
        _check_choice()
    except OptionError:
        hidden = os.environ.pop(VARIABLE)
        try:
            yield
        finally:
            os.environ[VARIABLE] = hidden
    else:
        yield


def context() -> Any:
    """Create an offscreen OpenGL context; on macOS and Windows, MuJoCo uses the system's.

    Raises:
        OptionError: if there is none, or not the one of MUJOCO_GL.
    """
    _check_choice()
    if sys.platform != "linux":
        return _made("gl_context")
    chosen = _choice()
    for name in (chosen,) if chosen in _LIBRARIES else _LIBRARIES:
        if _loads(name):
            return _made(name)
    raise OptionError("render_mode", "rgb_array", _INSTALL, "needs OpenGL, which is missing")


def _choice() -> str:
    """Return the value of MUJOCO_GL as MuJoCo reads it."""
    return os.environ.get(VARIABLE, "").lower().strip()


def _check_choice() -> None:
    """See that MUJOCO_GL has a value that can be honored.

    Raises:
        OptionError: if it has not.
    """
    chosen, field, given = _choice(), f"environment variable {VARIABLE}", os.environ.get(VARIABLE)
    own = _OWN.get(sys.platform, ())
    if chosen not in (*_UNSPECIFIC, *own):
        named = " or ".join(repr(name) for name in own if name != "glx")  # which needs a display
        raise OptionError(field, given, f"set it to {named}, or unset it", "is no renderer here")
    if sys.platform == "linux" and chosen in _LIBRARIES and not _loads(chosen):
        other = next(name for name in _LIBRARIES if name != chosen)
        remedy = f"install it (Debian: apt install {_PACKAGES[chosen]}), set {VARIABLE} to {other!r}, or unset it"
        raise OptionError(field, given, remedy, f"needs {_LIBRARIES[chosen]}, which is missing")


def _loads(name: str) -> bool:
    try:
        ctypes.CDLL(_LIBRARIES[name])
    except OSError:
        return False
    return True


def _made(name: str) -> Any:
    platform = os.environ.get(_PYOPENGL, "")
    if name in _LIBRARIES and platform.lower() not in ("", name):
        remedy = f"set it to {name!r}, or unset it"
        raise OptionError(f"environment variable {_PYOPENGL}", platform, remedy, f"contradicts MuJoCo's {name!r}")
    try:
        return importlib.import_module(f"mujoco.{name}").GLContext(1, 1)  # any size: it draws into its own buffer
    except Exception as error:  # PyOpenGL raises AttributeError, GLFW an error of its own
        raise OptionError("render_mode", "rgb_array", _INSTALL, f"needs OpenGL ({name}: {error})") from error
