"""Whether the machine is fast enough, and our part of the time small."""

from __future__ import annotations

import os

from artde_gym.benchmark.environments import ENGINES, biped
from artde_gym.benchmark.timing import TURN, ClosedLoop, Replay, in_turns
from artde_gym.benchmark.walk import LEAST, BareWalk
from artde_gym.doctor.check_result import CheckResult

ROUNDS = 10
SHARE = 0.75
"""Of a rate that the benchmark wants: a look of a second is not exact."""
REAL_TIME = 1000  # steps of 1 ms a second


def speed() -> list[CheckResult]:
    """Steps a second of the biped, alone and against the bare engine."""
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""  # not on Windows
    outcomes = [CheckResult("processors", "ok", f"{os.cpu_count()}{load}")]
    for engine, written in ENGINES.items():
        loop = ClosedLoop("artde", biped(engine=engine))
        variants = {"loop": loop.turn, "alone": Replay(loop, biped(engine=engine)).turn,
                    "bare": BareWalk(loop, engine).turn}  # fmt: skip
        times = in_turns(variants, ROUNDS)
        rate, ratio = TURN / times["loop"], times["bare"] / times["alone"]
        found = f"{rate:.0f} steps a second under ARTDE, {rate / REAL_TIME:.1f} x real time"
        slow = "end other programs; check that this is no emulated or throttled processor"
        outcomes.append(_judged(written, found, rate > REAL_TIME, slow))
        wanted = SHARE * LEAST.get((engine, "environment"), 0.0)
        found = f"env.step at {ratio:.2f} of the bare engine's rate"
        heavy = f"expected {wanted:.2f} or more: set OMP_NUM_THREADS=1, end other programs, see `artde-gym benchmark`"
        outcomes.append(_judged(written, found, ratio > wanted, heavy))
    return outcomes


def _judged(what: str, found: str, fast: bool, remedy: str) -> CheckResult:
    return CheckResult(what, "ok", found) if fast else CheckResult(what, "missing", found, remedy)
