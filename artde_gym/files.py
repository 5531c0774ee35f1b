"""Files that are written completely or not at all."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from artde_gym.errors import OptionError, StoreError


@contextlib.contextmanager
def making_folder(folder: Path) -> Iterator[None]:
    """Report what keeps a results folder from being made, or written to.

    Raises:
        StoreError: if it cannot be made or written to.
    """
    remedy = "choose another one with --out (out=)"
    try:
        yield
    except (FileExistsError, NotADirectoryError):
        raise StoreError("output folder", str(folder), remedy, "is a file, or lies in one") from None
    except OSError as error:
        raise StoreError("output folder", str(folder), remedy, f"is not writable ({error})") from error


def check_replaceable(path: Path) -> None:
    """See that a file may take the place of what is there: a device such as /dev/null would be lost to everybody.

    Raises:
        StoreError: if it is anything but a file, or its folder, or the one in which that would be made, is read-only.
    """
    if path.exists() and not path.is_file():
        raise StoreError("output file", str(path), "choose another name", "is not a file that could be replaced")
    there = next((folder for folder in path.parents if folder.exists()), None)
    if there is None or not os.access(there, os.W_OK | os.X_OK):
        raise StoreError("output file", str(path), "choose another place", "is in a folder that is not writable")


def check_figure(field: str, path: Path) -> None:
    """See that a figure can be written, before anything is computed for it.

    Raises:
        OptionError: for the name of no SVG file, or of one in a folder that does not exist.
        StoreError: if it would take the place of a folder or a device.
    """
    if path.suffix.lower() != ".svg":
        raise OptionError(field, str(path), "the path of an SVG file, such as figure.svg")
    if not path.parent.is_dir():
        raise OptionError(
            field, str(path), "create the folder, or choose another", "is in a folder that does not exist"
        )
    check_replaceable(path)


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
    try:
        handle, temporary = tempfile.mkstemp(dir=by_way_of or path.parent, prefix=f".{path.name}.")
    except OSError as error:
        error.filename = str(path)  # not the temporary name, which tells nothing
        raise
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
