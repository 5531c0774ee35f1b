"""Checks of Python, packages and files."""

from __future__ import annotations

import importlib
import os
import platform
import shutil
import tempfile
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from artde_gym.doctor.check_result import CheckResult, Status
from artde_gym.sim.factory import missing_bullet

PACKAGE = "artde-gym"
MODULES = {"mujoco": "artde_gym.sim.mujoco_module", "numpy": "numpy", "scipy": "scipy", "pandas": "pandas"}
"""Packages with compiled parts -> modules whose import proves that they load."""
FREE_DISK_BYTES = 1e9  # bytes, enough for most results folders
RUNS = Path("runs")


def python() -> list[CheckResult]:
    """Check the interpreter and the required packages."""
    try:
        wanted = str(metadata.metadata(PACKAGE)["Requires-Python"])
    except metadata.PackageNotFoundError:
        return [
            CheckResult(
                PACKAGE, "failed", "importable, but not installed", "pip install -c constraints.txt -e . in its folder"
            )
        ]
    version = platform.python_version()
    system = f"{platform.system()} {platform.machine()}"
    right = SpecifierSet(wanted).contains(version) and platform.python_implementation() == "CPython"
    here = f"{platform.python_implementation()} {version} on {system}"
    remedy = f"make a virtual environment of CPython {wanted}, 3.11 for both physics engines: python3.11 -m venv .venv"
    outcomes = [CheckResult("Python", "ok", here) if right else CheckResult("Python", "failed", here, remedy)]
    outcomes += [_installed(one, "failed", f"pip install '{one}'") for one in _requirements(None)]
    for name, module in MODULES.items():
        try:
            importlib.import_module(module)
        except Exception as error:
            again = f"pip install --force-reinstall --no-deps {name}"
            outcomes.append(CheckResult(f"import {name}", "failed", f"{type(error).__name__}: {error}", again))
    return [*outcomes, _engine()]


def _engine() -> CheckResult:
    """Report the default physics engine and the reason for it."""
    if missing := missing_bullet():
        return CheckResult("default engine", "missing", "MuJoCo, because PyBullet cannot be imported", missing)
    return CheckResult("default engine", "ok", "PyBullet, because it can be imported")


def extras() -> list[CheckResult]:
    """Check every extra and report the versions of its packages."""
    outcomes = []
    for extra in metadata.metadata(PACKAGE).get_all("Provides-Extra") or ():
        remedy = f"pip install '{PACKAGE}[{extra}]'"
        found = [_installed(requirement, "missing", remedy) for requirement in _requirements(extra)]
        text = ", ".join(f"{outcome.what} {outcome.found}" for outcome in found) or "in the core"
        whole = all(outcome.status == "ok" for outcome in found)
        outcomes.append(CheckResult(f"extra [{extra}]", "ok" if whole else "missing", text, "" if whole else remedy))
    return outcomes


def files() -> list[CheckResult]:
    """Check that the default results folder is writable and has enough space."""
    folder = RUNS.absolute()
    place = next(parent for parent in (folder, *folder.parents) if parent.exists())
    try:
        with tempfile.NamedTemporaryFile(dir=place, prefix=".artde-gym-") as file:
            file.write(b"0" * 4096)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        remedy = "change to a writable folder, or name one with --out"
        return [CheckResult("results folder", "failed", f"{place}: {error.strerror}", remedy)]
    free = shutil.disk_usage(place).free
    room = f"{free / 1e9:.1f} GB free"
    outcomes = [CheckResult("results folder", "ok", f"{RUNS}/ is writable")]
    if free < FREE_DISK_BYTES:
        return [
            *outcomes,
            CheckResult("disk", "missing", room, "free some space, or name a folder elsewhere with --out"),
        ]
    return [*outcomes, CheckResult("disk", "ok", room)]


def _requirements(extra: str | None) -> list[Requirement]:
    """Return the requirements of the package itself, or only of one extra."""
    found = []
    for text in metadata.requires(PACKAGE) or ():
        requirement = Requirement(text)
        marker, requirement.marker = requirement.marker, None
        of_extra = marker is not None and "extra" in str(marker)
        if of_extra != (extra is None) and (marker is None or marker.evaluate({"extra": extra or ""})):
            found.append(requirement)
    return found


def _installed(requirement: Requirement, otherwise: Status, remedy: str) -> CheckResult:
    try:
        version = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return CheckResult(requirement.name, otherwise, "not installed", remedy)
    if not requirement.specifier.contains(version, prereleases=True):
        return CheckResult(requirement.name, otherwise, f"{version}, not {requirement.specifier}", remedy)
    return CheckResult(requirement.name, "ok", version)
