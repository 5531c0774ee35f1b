"""Arrays that take long to compute, in the user's cache folder: an aid that nothing depends on.

A file is named by a hash of everything its array depends on and begins with a hash of its content. One that is damaged
or cannot be read or written is as good as none: the array is computed.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import json
import os
import platform
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
import scipy

from artde_gym.arrays import Array
from artde_gym.files import write_atomically

KEPT = 64
"""Number of files in the folder; the oldest ones go."""
_HASH = hashlib.sha256().digest_size


def cached(kind: str, key: Mapping[str, Any], modules: tuple[str, ...], compute: Callable[[], Array]) -> Array:
    """Return an array from the cache, or compute it and store it there.

    Args:
        kind: first part of the file's name.
        key: values that the array depends on, as JSON can write them.
        modules: source files that compute it.
        compute: computes the array.
    """
    file = None
    with contextlib.suppress(OSError, ValueError):  # sources may be missing, a file damaged
        name = _hash(json.dumps([_software(modules), key], sort_keys=True).encode()).hex()
        file = folder() / f"{kind}-{name[:32]}.npy"
        return _read(file)
    found = compute()
    if file is not None:
        with contextlib.suppress(Exception):  # a full disk, a home that is read-only, ...
            _write(file, found)
    return found


def folder() -> Path:
    """Return the folder, which may not exist.

    Raises:
        OSError: if the user has no home, as in a container that runs as a user whom it does not know.
    """
    try:
        found = platformdirs.user_cache_path("artde-gym", appauthor=False)
    except RuntimeError as error:
        raise OSError(str(error)) from error
    if not found.is_absolute():  # older releases of platformdirs return a folder named ~
        raise OSError("no home")
    return found


def _read(file: Path) -> Array:
    """Return the array of a file.

    Raises:
        OSError: if it cannot be read.
        ValueError: if its content is not what was written.
    """
    content = file.read_bytes()
    if content[:_HASH] != _hash(content[_HASH:]):
        raise ValueError(f"{file} is damaged")
    return np.load(io.BytesIO(content[_HASH:]), allow_pickle=False)


def _write(file: Path, array: Array) -> None:
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    content = buffer.getvalue()
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, lambda stream: stream.write(_hash(content) + content))
    stored = sorted(file.parent.glob("*.npy"), key=lambda one: one.stat().st_mtime)
    for old in stored[:-KEPT]:
        old.unlink(missing_ok=True)


def _hash(content: bytes) -> bytes:
    return hashlib.sha256(content).digest()


@functools.lru_cache
def _software(modules: tuple[str, ...]) -> str:
    """Describe the sources, libraries and machine by which a result may differ in its last bits."""
    sources = [_hash(Path(module).read_bytes()).hex() for module in modules]
    libraries: list[Any] = [(one.__version__, one.show_config(mode="dicts")) for one in (np, scipy)]
    machine = platform.platform(), os.environ.get("OPENBLAS_CORETYPE")
    return json.dumps([sources, libraries, machine], sort_keys=True, default=str)
