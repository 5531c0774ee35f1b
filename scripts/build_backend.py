"""The build backend: setuptools, after one readable sentence where PyBullet has no wheel.

pip reads `requires-python` only after the first steps of a build, knows no platforms, and would compile PyBullet.
"""

from __future__ import annotations

import platform
import sys
from typing import Any


def refusal(implementation: str, version: tuple[int, int], system: str, machine: str, libc: str) -> str | None:
    """Why artde-gym cannot be installed on this platform, or None where it can."""
    supported = (implementation, system, machine, libc) == ("CPython", "Linux", "x86_64", "glibc")
    if supported and version in ((3, 10), (3, 11)):
        return None
    here = f"{implementation} {version[0]}.{version[1]} on {system} {machine}"
    if system == "Linux" and libc != "glibc":
        here += " without glibc"
    return (
        "artde-gym needs CPython 3.10 or 3.11 on Linux x86-64 (glibc), where PyBullet 3.2.7 has wheels; "
        f"this is {here}. Install it with python3.11 there, or in a linux/amd64 container of python:3.11."
    )


def __getattr__(hook: str) -> Any:  # pip asks for the hooks of PEP 517 and PEP 660 by name
    implementation, libc = platform.python_implementation(), platform.libc_ver()[0]
    message = refusal(implementation, sys.version_info[:2], platform.system(), platform.machine(), libc)
    if message:
        sys.exit(message)
    from setuptools import build_meta

    return getattr(build_meta, hook)
