"""Worker processes from outside: interrupted while a controller blocks, or started by an unguarded script."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from artde_gym.errors import OptionError
from artde_gym.evaluation import evaluate
from artde_gym.studies import frontier, sweep, tune

BLOCKING = """
import itertools, os, signal, sys, time
from artde_gym.evaluation import evaluate, workers

started = itertools.count()

class Blocking:
    name = "blocking"

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        if state is None and next(started) == 2:  # in the third episode of each process
            print("blocks", flush=True)
            while True:
                time.sleep(1)
        return [0.0] * 4, 0

class Pool(workers.ProcessPoolExecutor):
    def shutdown(self, *args, **kwargs):
        print("ends", flush=True)
        if sys.argv[3] == "interrupted shutdown":
            os.kill(os.getpid(), signal.SIGINT)
        super().shutdown(*args, **kwargs)

if __name__ == "__main__":
    workers.GRACE = float(sys.argv[2])
    workers.ProcessPoolExecutor = Pool
    result = evaluate(
        [Blocking()], "QuadInfinity-Payload-v0", episodes=100, workers=2, out=sys.argv[1],
        env_kwargs={"duration": 0.1}, disturbances={},
    )
    print(result.complete, len(result.episodes), flush=True)
"""


@pytest.mark.parametrize(
    ("grace", "interrupts", "moment"),
    [(0.5, 1, ""), (3600.0, 2, ""), (3600.0, 1, "interrupted shutdown")],
    ids=["after a while", "the second time", "the second time, before it waits"],
)
def test_ctrl_c_ends_workers_that_block_and_keeps_what_is_finished(
    tmp_path: Path, grace: float, interrupts: int, moment: str
):
    (tmp_path / "blocking.py").write_text(BLOCKING)
    with subprocess.Popen(
        [sys.executable, str(tmp_path / "blocking.py"), str(tmp_path / "run"), str(grace), moment],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # background jobs are born ignoring it
    ) as process:
        assert process.stdout
        try:
            assert [process.stdout.readline() for _ in range(2)] == ["blocks\n"] * 2
            while _rows(tmp_path / "run") < 4:
                time.sleep(0.05)
            os.killpg(process.pid, signal.SIGINT)
            assert process.stdout.readline() == "ends\n"  # two that come together would be one
            for _ in range(interrupts - 1):
                os.killpg(process.pid, signal.SIGINT)
            output, errors = process.communicate(timeout=100)
        finally:
            process.kill()
    assert (output, errors, process.returncode) == ("False 4\n", "", 0)
    assert _rows(tmp_path / "run") == 4


def _rows(folder: Path) -> int:
    table = folder / "episodes.csv"
    return table.read_text().count("\n") - 1 if table.exists() else 0


UNGUARDED = """
from artde_gym.evaluation import evaluate
evaluate(["tde"], "QuadInfinity-Payload-v0", episodes=2, workers=2, env_kwargs={"duration": 0.1}, out="run")
"""


def test_a_script_without_a_main_guard_is_told_so(tmp_path: Path) -> None:
    (tmp_path / "unguarded.py").write_text(UNGUARDED)
    command = [sys.executable, "unguarded.py"]
    outcome = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=100, check=False)
    assert outcome.returncode == 1
    assert "put the call below `if __name__ == '__main__':`" in outcome.stderr
    assert "memory" not in outcome.stderr
    assert outcome.stderr.count("Traceback") == 1  # the parent's, in which the call stands


@pytest.mark.parametrize(
    "call",
    [
        lambda out: evaluate(["tde"], workers=0, out=out),
        lambda out: sweep({"controller": "tde"}, out, workers=0),
        lambda out: tune(["tde"], workers=0, out=out),
        lambda out: frontier(
            ["tde"], "QuadInfinity-Payload-v0", "wind.scale", low=0, high=1, tolerance=1, workers=0, out=out
        ),
    ],
    ids=["evaluate", "sweep", "tune", "frontier"],
)
def test_no_number_of_workers_costs_a_folder(call: Any, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="workers is 0"):
        call(tmp_path / "run")
    assert not (tmp_path / "run").exists()
