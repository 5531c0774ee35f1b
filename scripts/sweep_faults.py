"""A sweep killed again and again, at any instant, beside one that was left alone: in the end both hold the same bits.

    python scripts/sweep_faults.py --episodes 200 --kills 50 --out runs/faults

SIGKILL goes to the sweep, to one of its workers or to all of them; while it starts, while its workers start, or while
it stores. After each death what is stored must be whole, must be a part of what the undisturbed sweep stored, and must
hold all that it held before.
Exit code 0 if all of this held, 1 at the first time that it did not.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.studies import read_sweep

SWEEP = """\
env_kwargs: {{duration: 1.0, engine: mujoco}}
episodes: {episodes}
grid:
  scenario: [S2, Q1]
  controller: [tde, artde]
"""
CELLS = 4
PHASES, SHARES = ("starting", "warming up", "storing"), (0.2, 0.2, 0.6)
TARGETS, WEIGHTS = ("sweep", "worker", "all"), (0.6, 0.25, 0.15)
KEY = ["cell", "episode"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/faults"))
    options = parser.parse_args()
    shutil.rmtree(options.out, ignore_errors=True)
    options.out.mkdir(parents=True)
    file = options.out / "sweep.yaml"
    file.write_text(SWEEP.format(episodes=-(-options.episodes // CELLS)), encoding="utf-8")
    campaign = Campaign(file, options.workers, random.Random(options.seed))
    times = ", ".join(f"{seconds:.1f} s {phase}" for phase, seconds in campaign.spans.items())
    print(f"undisturbed: {len(campaign.whole)} episodes, {times}", flush=True)
    campaign.kill(options.kills)
    campaign.complete()


class Campaign:
    """A sweep that has been run once without disturbance, and is run a second time with."""

    def __init__(self, file: Path, workers: int, rng: random.Random) -> None:
        self._command = [sys.executable, "-m", "artde_gym.cli", "sweep", str(file), "--workers", str(workers)]
        self._rng = rng
        self._folder = file.parent / "killed"
        folder = file.parent / "whole"
        process = self._begin(folder)
        spans = [_wait(process, folder, phase, (0, 0)) for phase in PHASES[1:]]
        begun = time.monotonic()
        _expect(process.wait() == 0, "the undisturbed sweep ends well")
        self.spans = dict(zip(PHASES, [*spans, time.monotonic() - begun], strict=True))
        self.whole = _by_key(read_sweep(folder))
        self._stored = self.whole.iloc[:0]

    def kill(self, kills: int) -> None:
        """Disturb it so many times."""
        counts = dict.fromkeys((*PHASES, *TARGETS), 0)
        process, phase = None, PHASES[0]
        for number in range(1, kills + 1):
            if process is None or process.poll() is not None:
                before, process = _state(self._folder), self._begin(self._folder)
                (phase,) = self._rng.choices(PHASES, SHARES)
                _wait(process, self._folder, phase, before)
            span = self.spans[phase] if phase != "storing" else 2.0 * self.spans[phase] / kills
            time.sleep(self._rng.uniform(0.0, span))
            (target,) = self._rng.choices(TARGETS, WEIGHTS)
            counts[phase] += 1
            counts[target] += 1
            children = _children(process.pid)
            if target == "worker" and children:
                _kill(self._rng.choice(children))
                continue
            for pid in [process.pid, *(children if target == "all" else [])]:
                _kill(pid)
            process.wait()
            process = None
            self._check(f"kill {number}")
        if process is not None:
            _kill(process.pid)
            process.wait()
            self._check("the last kill")
        told = ", ".join(f"{count} {what}" for what, count in counts.items())
        print(f"{kills} kills ({told}); then {len(self._stored)} of {len(self.whole)} episodes were stored", flush=True)

    def complete(self) -> None:
        """Let it end, and compare."""
        _expect(self._begin(self._folder).wait() == 0, "the same command completes the sweep")
        self._check("completion")
        pd.testing.assert_frame_equal(self._stored, self.whole, check_exact=True)
        left = [path.name for path in self._folder.iterdir()]
        _expect(sorted(left) == ["episodes", "sweep.json"], f"nothing is left behind: {left}")
        print(f"complete: all {len(self.whole)} episodes, each once, equal to the last bit")

    def _check(self, when: str) -> None:
        """Check that the stored parts are whole, true, and no fewer than before."""
        if not (self._folder / "sweep.json").exists():
            return
        stored = _by_key(read_sweep(self._folder))
        _expect(stored.index.is_unique, f"{when}: no episode is stored twice")
        _expect(stored.index.isin(self.whole.index).all(), f"{when}: no episode comes from nowhere")
        _expect(self._stored.index.isin(stored.index).all(), f"{when}: no episode is lost")
        known = self.whole.loc[stored.index]
        pd.testing.assert_frame_equal(stored, known[stored.columns], check_exact=True, check_dtype=False)
        self._stored = stored

    def _begin(self, folder: Path) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [*self._command, "--out", str(folder)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )


def _wait(process: subprocess.Popen[bytes], folder: Path, phase: str, before: tuple[int, int]) -> float:
    """Until the sweep has got to a phase since a state of its folder, or has ended; returns how long that took (s)."""
    begun = time.monotonic()
    if phase != PHASES[0]:
        which = PHASES[1:].index(phase)
        while _state(folder)[which] <= before[which] and process.poll() is None:
            time.sleep(0.01)
    return time.monotonic() - begun


def _state(folder: Path) -> tuple[int, int]:
    """Count a sweep's runs that reached their episodes, and the parts that it has stored."""
    record = folder / "sweep.json"
    runs = record.read_text(encoding="utf-8").count('"provenance"') if record.exists() else 0
    return runs, len(list((folder / "episodes").glob("*.parquet")))


def _by_key(episodes: pd.DataFrame) -> pd.DataFrame:
    return episodes.set_index(KEY).sort_index()


def _children(pid: int) -> list[int]:
    try:
        return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def _kill(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def _expect(held: Any, what: str) -> None:
    if not held:
        sys.exit(f"did not hold: {what}")


if __name__ == "__main__":
    main()
