"""One writer per folder: a lock that names its holder and that the system releases when the process dies.

The lock is held on the file `.lock`, which exists while a process writes; `.lock.json` names that process. Files left
behind by a killed process lock nothing. Decorate a function that writes a folder with `writes_folder`.
"""

from __future__ import annotations

import contextlib
import datetime
import functools
import inspect
import json
import os
import platform
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ParamSpec, TypeVar

from filelock import FileLock, Timeout

from artde_gym.errors import StoreError
from artde_gym.evaluation.provenance import command
from artde_gym.evaluation.workers import end_unguarded
from artde_gym.files import making_folder

LOCK, HOLDER = ".lock", ".lock.json"
NEW_OR_EMPTY = "choose a new or empty folder"

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")

_held: set[tuple[int, Path]] = set()
"""Folders held by threads of this process: a function that holds one may call another that writes to it."""


def writes_folder(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Lock the folder given as the argument `out` while the function runs; None is no folder."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def holding(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        end_unguarded()
        out = signature.bind(*args, **kwargs).arguments.get("out")
        with contextlib.nullcontext() if out is None else locked(Path(out)):
            return function(*args, **kwargs)

    return holding


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder, which is created if missing and removed again if it stays empty.

    Raises:
        StoreError: if another process or thread holds it, or it is not writable.
    """
    key = threading.get_ident(), folder.resolve()
    if key in _held:
        yield
        return
    made, lock = _acquire(folder)
    _held.add(key)
    try:
        yield
    finally:
        _held.discard(key)
        with contextlib.suppress(OSError):  # the folder was removed meanwhile
            (folder / HOLDER).unlink(missing_ok=True)
            if sys.platform != "win32":  # before the release, so that a waiting process begins with a new file
                (folder / LOCK).unlink()
                for empty in reversed(made):
                    empty.rmdir()
        lock.release()


def is_empty(folder: Path) -> bool:
    """Return whether a folder contains nothing but its lock."""
    return all(path.name in (LOCK, HOLDER) for path in folder.iterdir())


def _acquire(folder: Path) -> tuple[list[Path], FileLock]:
    """Return the created folders and the held lock."""
    with making_folder(folder):
        made = _make(folder)
        lock = FileLock(folder / LOCK, blocking=False, thread_local=False, is_singleton=False)
        try:
            lock.acquire()
        except Timeout:
            problem = f"is in use by {_holder(folder)}"
            raise StoreError("output folder", str(folder), "choose a folder without another writer", problem) from None
        _sign(folder)
    return made, lock


def _make(folder: Path) -> list[Path]:
    """Create a folder and its parents; return the created ones, topmost first."""
    missing = [path for path in reversed([folder, *folder.parents]) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def _sign(folder: Path) -> None:
    """Write the lock's holder beside it."""
    now = datetime.datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    holder = {"pid": os.getpid(), "host": platform.node(), "since": now, "command": command()}
    with contextlib.suppress(OSError):  # a full disk is reported when results are written
        (folder / HOLDER).write_text(json.dumps(holder))


def _holder(folder: Path) -> str:
    """Name the lock's holder, which signs a moment after it has locked."""
    for patience in (0.05, 0.2, 1.0, None):
        try:
            found = json.loads((folder / HOLDER).read_text())
            return f"process {found['pid']} on {found['host']} ({found['command']!r}, since {found['since']})"
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            if patience is not None:
                time.sleep(patience)
    return "another process"
