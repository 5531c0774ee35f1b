"""Files that are written whole take the place of files alone, never of a device or a folder."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import numpy as np
import pytest

from artde_gym.errors import StoreError
from artde_gym.evaluation.store import write_atomically
from artde_gym.video.writer import write

PICTURE = np.zeros((16, 16, 3), np.uint8)


def test_a_device_stays_what_it_is(tmp_path: Path) -> None:
    if not hasattr(os, "mkfifo"):
        pytest.skip("no devices in folders here")
    device = tmp_path / "device.png"
    os.mkfifo(device)
    with pytest.raises(StoreError, match="not a file that could be replaced"):
        write_atomically(device, lambda file: file.write(b"x"))
    with pytest.raises(StoreError, match="not a file that could be replaced"):
        write(device, iter([PICTURE]), 25.0)
    assert stat.S_ISFIFO(device.stat().st_mode)
    assert list(tmp_path.iterdir()) == [device]


def test_a_folder_is_refused_before_the_first_picture(tmp_path: Path) -> None:
    folder = tmp_path / "film.gif"
    folder.mkdir()
    drawn = iter([PICTURE])
    with pytest.raises(StoreError, match="not a file that could be replaced"):
        write(folder, drawn, 25.0)
    assert next(drawn) is PICTURE


def test_what_another_process_is_writing_is_left_alone(tmp_path: Path) -> None:
    other = tmp_path / ".film.1.part.png"
    other.write_bytes(b"half a picture")
    write(tmp_path / "film.png", iter([PICTURE]), 25.0)
    assert other.read_bytes() == b"half a picture"
    assert sorted(path.name for path in tmp_path.iterdir()) == [other.name, "film.png"]
