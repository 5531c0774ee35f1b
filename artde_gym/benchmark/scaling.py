"""Speedup by several processes."""

from __future__ import annotations

import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from artde_gym.benchmark.environments import biped, quadrotor
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import ClosedLoop

STEPS = {"biped": 8000, "quadrotor": 3500}
MAKERS = {"biped": biped, "quadrotor": quadrotor}

_started: dict[str, Any] = {}
"""State of a worker: the barrier at which all of them wait for each other."""


def scaling(quick: bool) -> Section:
    """Measure control periods per second of one closed loop per process, relative to one process."""
    cores = os.cpu_count() or 1
    counts = sorted({1, *(count for count in (2, 4, 8, 16, 32, 64) if count < cores), cores})
    figures = []
    for robot, steps in STEPS.items():
        alone = None
        for count in counts:
            rate = _rate(robot, count, steps // (10 if quick else 1))
            alone = alone or rate
            if count == 1:
                figures.append(Figure(f"{robot}, 1 process", rate, "periods/s"))
            else:
                least = 1.8 if count == 2 else None
                figures.append(Figure(f"{robot}, {count} processes: rate against 1", rate / alone, least=least))
    text = (
        f"Closed loops with ARTDE in PyBullet, one per process, on a machine with {cores} cores, by wall-clock time "
        "from the first one's start to the last one's end; building environments is left out."
    )
    return Section("Several processes", text, tuple(figures))


def _rate(robot: str, count: int, steps: int) -> float:
    """Return control periods per second of `count` processes together."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, context, _start, (context.Barrier(count),)) as pool:
        spans = [future.result() for future in [pool.submit(_run, robot, steps) for _ in range(count)]]
    return count * steps / (max(end for _, end in spans) - min(start for start, _ in spans))


def _start(barrier: Any) -> None:
    _started["barrier"] = barrier


def _run(robot: str, steps: int) -> tuple[float, float]:
    """Run `steps` of a closed loop; return begin and end (s, on a clock that all processes share)."""
    loop = ClosedLoop("artde", MAKERS[robot](duration=58.0), turn=1)
    advance = loop.turn()
    advance()
    _started["barrier"].wait()
    start = time.monotonic()
    for _ in range(steps):
        advance()
    return start, time.monotonic()
