"""Stored walking patterns: the same numbers with and without them, whatever happens to their files."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym import cache
from artde_gym.robots.ojas import walking

WALK = (0.1, 1.0, 5.5, 0.01)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(cache, "folder", lambda: tmp_path / "cache")
    return tmp_path / "cache"


def planned() -> bytes:
    """Plan a walk as a new process would."""
    walking._pattern.cache_clear()
    pattern = walking.walking_pattern(*WALK)
    return b"".join(np.ascontiguousarray(value).tobytes() for value in dataclasses.astuple(pattern)[1:])


def test_a_stored_pattern_has_the_same_bits(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = planned()
    assert len(list(folder.iterdir())) == 1
    monkeypatch.setattr(walking, "_solve", None)  # nothing is left to be computed
    assert planned() == first


def test_blocks_of_samples_give_the_same_bits(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = planned()
    (file,) = folder.iterdir()
    for size in (1000, 10**9):
        file.unlink()
        monkeypatch.setattr(walking, "BLOCK", size)
        assert planned() == first


@pytest.mark.parametrize("damage", ["flipped", "cut", "empty", "folder", "pickled"])
def test_damaged_files_are_computed_anew(folder: Path, damage: str) -> None:
    first = planned()
    (file,) = folder.iterdir()
    content = file.read_bytes()
    file.unlink()
    if damage == "folder":
        file.mkdir()
    else:
        middle = len(content) // 2
        flipped = content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]
        file.write_bytes({"flipped": flipped, "cut": content[:-8], "empty": b"", "pickled": b"\x80\x04N."}[damage])
    assert planned() == first
    assert file.is_dir() or file.read_bytes() == content


def test_a_home_that_cannot_be_written_is_no_error(folder: Path) -> None:
    first = planned()
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()
    folder.write_text("a file in place of the folder")
    assert planned() == first


def test_the_file_depends_on_the_walk_the_constants_and_the_sources(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned()
    walking.walking_pattern(0.12, *WALK[1:])
    assert len(list(folder.iterdir())) == 2
    monkeypatch.setattr(walking, "STEP_HEIGHT", 0.05)
    planned()
    assert len(list(folder.iterdir())) == 3
    source = tmp_path / "source.py"
    source.write_text("1")
    first = cache._software((str(source),))
    cache._software.cache_clear()
    source.write_text("2")
    assert cache._software((str(source),)) != first


def test_the_oldest_files_go(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "KEPT", 3)
    for number in range(6):
        found = cache.cached("numbers", {"number": number}, (), lambda number=number: np.full(3, float(number)))
        assert found.tolist() == [number] * 3
    assert len(list(folder.iterdir())) <= 3
    assert np.array_equal(cache.cached("numbers", {"number": 5}, (), lambda: np.empty(0)), np.full(3, 5.0))


@pytest.mark.linux
def test_processes_write_the_same_file_at_once(tmp_path: Path) -> None:
    code = "import hashlib, artde_gym.robots.ojas.walking as walking\n"
    code += f"print(hashlib.sha256(walking.walking_pattern(*{WALK}).q.tobytes()).hexdigest())"
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    running = [
        subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    assert len({process.communicate()[0] for process in running}) == 1
    assert all(process.returncode == 0 for process in running)
    (file,) = (tmp_path / "artde-gym").iterdir()  # and nothing half-made
    assert file.suffix == ".npy"


def test_environments_that_walk_alike_share_a_plan_that_cannot_be_written() -> None:
    walks: list[Any] = [
        gym.make("BipedWalk-Payload-v0", engine="mujoco", duration=1.0, control_period=period).unwrapped
        for period in (0.001, 0.001, 0.002)
    ]
    first, second, slower = walks
    plan = first._task.plan
    assert plan is second._task.plan
    assert np.array_equal(plan[::2], slower._task.plan)
    with pytest.raises(ValueError, match="read-only"):
        plan[0] = 0.0
    observation, _ = first.reset(seed=0)
    observation[:] = 0.0  # an observation is the user's own
    for env in (first, second, slower):
        env.close()


def test_a_user_without_a_home_computes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pwd = pytest.importorskip("pwd")

    def unknown(user: int) -> None:
        raise KeyError(user)

    monkeypatch.setattr(pwd, "getpwuid", unknown)
    for name in ("HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    found = cache.cached("numbers", {"number": 5}, (), lambda: np.full(3, 5.0))
    assert np.array_equal(found, np.full(3, 5.0))
    assert not list(tmp_path.iterdir())  # no folder named ~
