"""Files that are written completely or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from artde_gym.errors import StoreError


def check_replaceable(path: Path) -> None:
    """See that a file may take the place of what is there: a device such as /dev/null would be lost to everybody.

    Raises:
        StoreError: if it is anything but a file.
    """
    if path.exists() and not path.is_file():
        raise StoreError("output file", str(path), "choose another name", "is not a file that could be replaced")


def write_atomically(path: Path, write: Callable[[BinaryIO], Any], by_way_of: Path | None = None) -> None:
    """Write a file completely or not at all; until it is complete, it has a temporary name in `by_way_of`.

    Args:
        path: of the file.
        write: writes its content.
        by_way_of: a folder of the same file system; None for the file's own.

    Raises:
        StoreError: if it would take the place of a folder or a device.
    """
    check_replaceable(path)
    handle, temporary = tempfile.mkstemp(dir=by_way_of or path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
