"""Arms from URDF or MJCF files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from artde_gym.errors import RobotError
from artde_gym.multibody.manipulator import manipulator
from artde_gym.multibody.model_file import ModelTree, model_text, parsed
from artde_gym.multibody.spec import RobotSpec
from artde_gym.multibody.urdf_reader import read_urdf
from artde_gym.sim.mjcf_reader import read_mjcf


def read_arm(
    path: str | os.PathLike[str],
    *,
    tip: str | None = None,
    armature: float | Sequence[float] | None = None,
    joints: Sequence[str] | None = None,
) -> RobotSpec:
    """Read an arm on a fixed base; no engine reads the file itself, and meshes are ignored.

    Args:
        path: URDF or MJCF file, recognized by its root element.
        tip: see `artde_gym.multibody.manipulator.manipulator`, also for `armature` and `joints`.

    Raises:
        RobotError: for a file that is broken or has what cannot be simulated; it names file, element and what is
            allowed.
    """
    return manipulator(read_tree(Path(path)), tip=tip, armature=armature, joints=joints)


def read_tree(path: Path) -> ModelTree:
    """Read the links of a file.

    Raises:
        RobotError: as `read_arm`.
    """
    text = model_text(path)
    root = parsed(text, path.name)
    if root.tag == "robot":
        return read_urdf(root, path.name)
    if root.tag == "mujoco":
        return read_mjcf(root, text, path.name)
    raise RobotError(f"root element of {path.name}", f"<{root.tag}>", "<robot> of a URDF, <mujoco> of an MJCF")
