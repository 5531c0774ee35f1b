"""Provenance of a result: versions, commit, source code, platform and command."""

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
"""Packages whose version may change the last bits of a result."""

SOURCES = ("artde_gym", "baselines", "controllers")
_SOFTWARE = ("commit", "source_sha256", "packages", "behind_controllers")
MIXED = "mixed_with"
"""Key of a provenance for the other software that produced results in its folder."""


def provenance(
    behind: Mapping[str, str] | None = None,
    identified_by: Mapping[str, str] | None = None,
    engines: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Return everything needed to reproduce a run.

    Args:
        behind: hashes of the controllers' weights and code, see `artde_gym.evaluation.identity.behind`.
        identified_by: controller -> the method that determined its identity.
        engines: physics engine -> whether it was asked for, see `artde_gym.evaluation.cells.engines_of`.
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
        "engines": dict(engines or {}),
    }


def continued(
    folder: Path, before: Mapping[str, Any] | None, now: dict[str, Any], *, allow_mixed: bool
) -> dict[str, Any]:
    """Return the provenance of a resumed folder: the current one, with all other software that produced its results.

    Args:
        folder: the results folder.
        before: the provenance in it; None if it has no results.
        now: the provenance of this process.
        allow_mixed: whether to resume results of other software.

    Raises:
        StoreError: if the results are of other software and `allow_mixed` is not set.
    """
    if before is None:
        return now
    with wrap_read_errors("provenance of the results", folder, "as it was written; or choose a new folder", StoreError):
        mixed, differences = list(before.get(MIXED, [])), _differences(before, now)
    for what, (old, new) in differences.items():
        if not allow_mixed:
            problem = f"differs from {old}, with which the results in {folder} were made"
            todo = "choose a new folder, or --allow-mixed (allow_mixed=True), which stays in its provenance"
            raise StoreError(what, new, todo, problem)
    software = {name: before.get(name) for name in _SOFTWARE}
    mixed += [software] if differences and software not in mixed else []
    return {**now, MIXED: mixed} if mixed else now


def _differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> dict[str, tuple[object, object]]:
    """Return decisive differences as name -> (before, now). The source code counts, not the commit's name."""
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
    """Return the command line of this process, as text that any file can hold.

    In a locale that is not UTF-8's, Python keeps the bytes of other characters as lone surrogates.
    """
    words = " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])
    return words.encode("utf-8", sys.getfilesystemencodeerrors()).decode("utf-8", "backslashreplace")


@functools.cache  # an imported module stays what it was, whatever happens to its file
def source_hash() -> str:
    """Return the hash of all modules of this project, uncommitted changes included."""
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
    """Return what must match for equal results: versions of the decisive packages, and the source code's hash."""
    return {**versions(DECISIVE), "source_sha256": source_hash()}


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Return the versions of the installed ones of these packages."""
    return {name: version for name in packages if (version := _version(name)) is not None}


@functools.cache
def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


@functools.cache
def _commit() -> str | None:
    """Return the commit of this checkout, with "-dirty" if it has changes; None for an installed package."""
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
