"""MuJoCo, imported whatever the environment variable MUJOCO_GL says, since physics needs no OpenGL."""

from __future__ import annotations

from typing import Any

from artde_gym.sim.opengl import without_bad_choice

with without_bad_choice():
    import mujoco
    from mujoco.batch import Batch

mj: Any = mujoco  # compiled, without type information

__all__ = ["Batch", "mj"]
