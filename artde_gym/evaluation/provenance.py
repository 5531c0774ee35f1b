"""What produced a result: versions, commit, source code, platform and command."""

from __future__ import annotations

import datetime
import functools
import hashlib
import platform
import subprocess
import sys
from collections.abc import Iterable, Mapping
from importlib import metadata, util
from pathlib import Path
from typing import Any

from artde_gym.arguments import wrap_read_errors
from artde_gym.errors import StoreError

PACKAGES = (
    "artde-gym", "gymnasium", "numpy", "scipy", "pandas", "pyarrow", "pybullet", "mujoco", "optuna", "ray", "torch",
    "stable-baselines3",
)  # fmt: skip

DECISIVE = ("artde-gym", "gymnasium", "mujoco", "numpy", "pybullet", "scipy")
"""Packages of which another version may change the last bits of a result."""

SOURCES = ("artde_gym", "baselines", "controllers")
_SOFTWARE = ("commit", "source_sha256", "packages", "behind_controllers")
MIXED = "mixed_with"
"""Where a provenance keeps the other software that results in its folder were made with."""


def provenance(
    behind: Mapping[str, str] | None = None, identified_by: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Everything that a reader needs to run the same again.

    Args:
        behind: hashes of weights and code behind controllers, see `artde_gym.evaluation.identity.behind`.
        identified_by: controller -> by what its identity was found.
    """
    return {
        "time": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "command": command(),
        "commit": _commit(),
        "source_sha256": source_hash(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": versions(PACKAGES),
        "behind_controllers": dict(behind or {}),
        "identified_by": dict(identified_by or {}),
    }


def continued(
    folder: Path, before: Mapping[str, Any] | None, now: dict[str, Any], *, allow_mixed: bool
) -> dict[str, Any]:
    """The provenance of a folder that is continued: that of now, with all other software that its results are of.

    Args:
        folder: of the results.
        before: the provenance that it holds; None if it holds no results.
        now: of this process.
        allow_mixed: whether results of other software may be continued.

    Raises:
        StoreError: if the results are of other software and must not be mixed.
    """
    if before is None:
        return now
    with wrap_read_errors(
        "provenance of the results", folder, "a record as it was written; or a new folder", StoreError
    ):
        mixed, differences = list(before.get(MIXED, [])), _differences(before, now)
    for what, (old, new) in differences.items():
        if not allow_mixed:
            allowed = f"{old}, which the results in {folder} were made with; or a new folder, or --allow-mixed"
            raise StoreError(what, new, f"{allowed} (allow_mixed=True), which stays in its provenance")
    software = {name: before.get(name) for name in _SOFTWARE}
    mixed += [software] if differences and software not in mixed else []
    return {**now, MIXED: mixed} if mixed else now


def _differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, tuple[object, object]]:
    """What decides about results and is not as it was -> before, now. The source counts, not the commit's name."""
    old, new = before["packages"], now["packages"]
    found = {f"version of {name}": (old[name], new.get(name)) for name in DECISIVE if name in old}
    if "source_sha256" in before:
        shown = [f"{record['source_sha256']} (commit {record['commit']})" for record in (before, now)]
        if before["source_sha256"] != now["source_sha256"]:
            found["source code of artde-gym"] = (shown[0], shown[1])
    behind, here = before.get("behind_controllers", {}), now["behind_controllers"]
    found |= {what: (behind[what], here[what]) for what in behind if what in here}
    return {what: pair for what, pair in found.items() if pair[0] != pair[1]}


def command() -> str:
    """The command line of this process."""
    return " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])


@functools.cache  # what was imported stays what it was, whatever happens to the files
def source_hash() -> str:
    """Hash of all modules of this project, changes that are not committed included."""
    found = hashlib.sha256()
    for package in SOURCES:
        spec = util.find_spec(package)
        roots = [] if spec is None else list(spec.submodule_search_locations or [])
        files = sorted((file.relative_to(root).as_posix(), file) for root in roots for file in Path(root).rglob("*.py"))
        for name, file in files:
            found.update(f"{package}/{name}\0".encode())
            found.update(hashlib.sha256(file.read_bytes()).digest())
    return found.hexdigest()


def software() -> dict[str, str]:
    """What must be equal for results to be so: versions of the decisive packages, and the source code's hash."""
    return {**versions(DECISIVE), "source_sha256": source_hash()}


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Versions of those packages that are installed."""
    return {name: version for name in packages if (version := _version(name)) is not None}


@functools.cache
def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


@functools.cache
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
