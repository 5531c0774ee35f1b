"""One writer a folder: everything that writes one refuses while another process does, and says which."""

from __future__ import annotations

import os
import platform
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from artde_gym.cli.arguments import folder_of
from artde_gym.errors import StoreError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.lock import HOLDER, LOCK, locked
from artde_gym.studies import frontier, reproduce, sweep, tune

HOLD = """
import sys, time
from pathlib import Path
from artde_gym.evaluation.lock import locked

with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(600)
"""


@pytest.fixture
def holder(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process, which holds `run`."""
    arguments = [sys.executable, "-c", HOLD, str(tmp_path / "run")]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def trained(folder: Path) -> Any:
    pytest.importorskip("stable_baselines3")
    from baselines.residual_config import ResidualConfig
    from baselines.run import Training
    from baselines.train import train

    return train(Training("QuadInfinity-Payload-v0", ResidualConfig("q450")), folder)


def tuned_balance(folder: Path) -> Any:
    pytest.importorskip("cmaes")
    from baselines.residual_config import ResidualConfig
    from baselines.run import Training
    from baselines.tune_balance import tune as tune_balance

    return tune_balance(Training("BipedPush-v0", ResidualConfig("ojas"), algo="cma-es"), folder)


WRITERS: dict[str, Callable[[Path], Any]] = {
    "evaluate": lambda folder: evaluate(["tde"], scenario="Q1", out=folder),
    "frontier": lambda folder: frontier(["tde"], out=folder),
    "tune": lambda folder: tune(["tde"], scenario="Q1", out=folder),
    "reproduce": lambda folder: reproduce("quadrotor", folder),
    "sweep": lambda folder: sweep({"scenario": "Q1", "controller": "tde"}, folder),
    "train": trained,
    "train, cma-es": tuned_balance,
}


def test_whoever_writes_a_folder_is_named_and_when_it_is_killed_the_folder_is_free(holder, tmp_path):
    for name, write in WRITERS.items():
        with pytest.raises(StoreError) as caught:
            write(tmp_path / "run")
        for word in (f"process {holder.pid} on {platform.node()}", "'-c ", str(tmp_path / "run")):
            assert word in str(caught.value), name
    assert {path.name for path in (tmp_path / "run").iterdir()} == {LOCK, HOLDER}
    os.kill(holder.pid, signal.SIGKILL)
    holder.wait()
    with locked(tmp_path / "run"):  # what the killed one left behind holds nobody up
        pass
    assert not any((tmp_path / "run").iterdir())


def test_a_function_that_holds_a_folder_may_call_one_that_writes_it_and_no_other_thread_may(tmp_path):
    refused: list[StoreError] = []

    def other() -> None:
        try:
            with locked(tmp_path / "run"):
                pass
        except StoreError as error:
            refused.append(error)

    with locked(tmp_path / "run"):
        with locked(tmp_path / "run" / ".." / "run"):
            pass
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
    assert len(refused) == 1
    assert not (tmp_path / "run").exists()  # nothing was written


def test_of_many_that_come_and_go_one_alone_holds_the_folder(tmp_path):
    """The file of the lock is removed each time: whoever has opened it before must not take it for the lock."""
    inside, most, turns = [0], [0], 40

    def come_and_go() -> None:
        done = 0
        while done < turns:
            try:
                with locked(tmp_path / "a" / "run"):
                    inside[0] += 1
                    most[0] = max(most[0], inside[0])
                    done += 1
                    inside[0] -= 1
            except StoreError:
                continue

    threads = [threading.Thread(target=come_and_go) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads)
    assert most == [1]


@pytest.mark.parametrize(
    ("where", "words"),
    [("file", "is a file, or lies in one"), ("file/inside", "is a file, or lies in one"), ("x" * 300, "name too long")],
)
def test_a_folder_that_cannot_be_one_is_refused_in_words(tmp_path, where, words):
    (tmp_path / "file").write_text("dear")
    with pytest.raises(StoreError, match=words):
        evaluate(["tde"], scenario="Q1", out=tmp_path / where)


def test_default_names_differ_also_within_a_second(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders = [folder_of(None) for _ in range(5)]
    assert len(set(folders)) == 5
    assert all(folder.parts[0] == "runs" and folder.is_dir() for folder in folders)
    assert folder_of(Path("mine")) == Path("mine")


def test_a_folder_that_stays_empty_goes_although_its_holder_could_not_sign(tmp_path: Path) -> None:
    with locked(tmp_path / "run"):
        (tmp_path / "run" / HOLDER).unlink()  # as on a full disk
    assert not (tmp_path / "run").exists()


def test_a_lock_on_a_file_that_its_last_holder_has_just_removed_holds_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fcntl = pytest.importorskip("fcntl")
    flock: Callable[[int, int], None] = fcntl.flock

    def late(file: int, operation: int) -> None:
        """Lock a file that goes in between: once, as the holder before ends once."""
        monkeypatch.setattr(fcntl, "flock", flock)
        (tmp_path / LOCK).unlink()
        flock(file, operation)

    monkeypatch.setattr(fcntl, "flock", late)
    with pytest.raises(StoreError, match="without another writer"), locked(tmp_path):
        pass
    with locked(tmp_path):
        assert (tmp_path / LOCK).exists()
