"""What produced a result: versions, commit, platform and command."""

from __future__ import annotations

import datetime
import functools
import platform
import subprocess
import sys
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

PACKAGES = (
    "artde-gym", "gymnasium", "numpy", "scipy", "pandas", "pyarrow", "pybullet", "mujoco", "optuna", "ray", "torch",
    "stable-baselines3",
)  # fmt: skip

DECISIVE = ("artde-gym", "gymnasium", "mujoco", "numpy", "pybullet", "scipy")
"""Packages of which another version may change the last bits of a result."""


def provenance() -> dict[str, Any]:
    """Everything that a reader needs to run the same again."""
    return {
        "time": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "command": " ".join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "commit": _commit(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": versions(PACKAGES),
    }


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Versions of those packages that are installed."""
    return {name: version for name in packages if (version := _version(name)) is not None}


@functools.cache
def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _commit() -> str | None:
    """The commit of this checkout, "-dirty" with changes on top; None for an installed package."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    try:
        result = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return result.stdout.strip()
