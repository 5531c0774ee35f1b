"""Growth of memory over steps and resets."""

from __future__ import annotations

import platform
from typing import Any

import numpy as np

from artde_gym.benchmark.environments import ENGINES, biped, fleet
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import MEMORY, resident

MOST = 5.0  # MB
STEPS, RESETS = 20_000, 200


def growing(quick: bool) -> Section:
    """Measure the growth of resident memory over resets and steps, after a warm-up."""
    if not MEMORY.exists():
        return Section("Memory", "", skipped=f"{platform.system()} does not tell a process its memory in /proc")
    share = 10 if quick else 1
    figures = []
    for engine, written in ENGINES.items():
        env = biped(engine=engine)
        _use(env, 5, 2000)
        before = resident()
        _use(env, RESETS // share, STEPS // share)
        figures.append(_figure(f"{written}, the biped: {RESETS // share} resets, {STEPS // share} steps", before))
        env.close()
    vehicles = fleet(1024)
    vehicles.reset(seed=0)
    still = np.zeros((1024, 4))  # they fall, and restart about every half second
    for _ in range(100):
        vehicles.step(still)
    before = resident()
    for _ in range(500 // share):
        vehicles.step(still)
    figures.append(_figure(f"1024 quadrotors in NumPy: {500 // share} steps, {13 // share} restarts each", before))
    return Section("Memory", "Growth of this process after a warm-up; `make soak` runs for hours.", tuple(figures))


def _use(env: Any, resets: int, steps: int) -> None:
    for seed in range(resets):
        env.reset(seed=seed)
    torque = np.zeros(12)
    for _ in range(steps):
        _, _, terminated, truncated, _ = env.step(torque)
        if terminated or truncated:
            env.reset()


def _figure(what: str, before: int) -> Figure:
    return Figure(what, (resident() - before) / 1e6, "MB", most=MOST)
