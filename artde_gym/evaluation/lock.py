"""One writer for each folder: a lock that the system releases when its process dies, and that says who holds it.

The lock is held on the file `.lock`, which is there as long as a process writes, and `.lock.json` says which one; files
that a killed process has left behind lock nothing. A function that writes a folder is decorated by `writes_folder`.
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
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ParamSpec, TypeVar

from filelock import FileLock, Timeout

from artde_gym.errors import StoreError
from artde_gym.evaluation.provenance import command
from artde_gym.evaluation.workers import end_unguarded

LOCK, HOLDER = ".lock", ".lock.json"

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")

_held: set[tuple[int, Path]] = set()
"""Folders that threads of this process hold: a function that holds one may call another one that writes it."""


def writes_folder(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Let a function hold the folder that its argument `out` names for as long as it runs; None is no folder."""
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
    """Hold a folder; it is made for that, and goes again if it stays empty.

    Raises:
        StoreError: if another process or thread holds it, or it cannot be written.
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
        with contextlib.suppress(OSError):  # somebody has removed the folder
            (folder / HOLDER).unlink(missing_ok=True)
            if sys.platform != "win32":  # before the release: whoever waits for it then begins with a new file
                (folder / LOCK).unlink()
                for empty in reversed(made):
                    empty.rmdir()
        lock.release()


def is_empty(folder: Path) -> bool:
    """Return whether a folder holds nothing but its lock."""
    return all(path.name in (LOCK, HOLDER) for path in folder.iterdir())


def _acquire(folder: Path) -> tuple[list[Path], FileLock]:
    """Return the folders that were made for it, and the lock that is held."""
    try:
        made = _make(folder)
        lock = FileLock(folder / LOCK, blocking=False, thread_local=False, is_singleton=False)
        lock.acquire()
        _sign(folder)
    except Timeout:
        allowed = f"a folder that nobody else writes; {_holder(folder)} does"
        raise StoreError("output folder", str(folder), allowed) from None
    except (FileExistsError, NotADirectoryError):
        raise StoreError("output folder", str(folder), "a new or empty folder; this one holds something else") from None
    except OSError as error:
        raise StoreError("output folder", str(folder), f"a folder that can be written ({error})") from error
    return made, lock


def _make(folder: Path) -> list[Path]:
    """Make a folder and all above it; return those that were not there yet, the uppermost first."""
    missing = [path for path in reversed([folder, *folder.parents]) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def _sign(folder: Path) -> None:
    """Say beside the lock who holds it."""
    now = datetime.datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")
    holder = {"pid": os.getpid(), "host": platform.node(), "since": now, "command": command()}
    with contextlib.suppress(OSError):  # a full disk shows where results are written
        (folder / HOLDER).write_text(json.dumps(holder))


def _holder(folder: Path) -> str:
    try:
        found = json.loads((folder / HOLDER).read_text())
        return f"process {found['pid']} on {found['host']} ({found['command']!r}, since {found['since']})"
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return "another process"
