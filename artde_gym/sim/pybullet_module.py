"""PyBullet, imported without the line that its C code prints; where it is missing, the error says why."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from artde_gym.errors import MissingDependencyError
from artde_gym.sim.factory import why_no_bullet


@contextlib.contextmanager
def _silent_stderr() -> Iterator[None]:
    saved, sink = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(sink)


try:
    with _silent_stderr():
        import pybullet as bullet
    import pybullet_data as bullet_data
except ImportError as error:
    missing = MissingDependencyError("engine", "bullet", why_no_bullet(error))
    missing.name = error.name
    raise missing from error

__all__ = ["bullet", "bullet_data"]
