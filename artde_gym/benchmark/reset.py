"""Time of a reset."""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from typing import Any

from artde_gym.benchmark.environments import ENGINES, biped, quadrotor
from artde_gym.benchmark.figure import Figure, Section

RESETS = 50
STARTS: dict[str, tuple[Any, Mapping[str, Any], float | None]] = {
    "biped from the stored state": (biped, {}, 2.0),
    "biped with a payload that settles for 0.3 s": (biped, {"payload": 1.3}, None),
    "quadrotor": (quadrotor, {"payload": 0.35, "wind": 1.0}, 2.0),
}
"""Case -> (environment, disturbances, target in milliseconds)."""


def resetting(quick: bool) -> Section:
    """Measure resets in milliseconds, and relative to a step."""
    figures = []
    for engine, written in ENGINES.items():
        for name, (make, disturbances, most) in STARTS.items():
            env = make(engine=engine, disturbances=disturbances)
            env.reset(seed=0)
            resets = _median(RESETS // (10 if quick else 1), lambda seed, env=env: env.reset(seed=seed))
            still = env.action_space.low * 0.0
            env.reset(seed=0)
            steps = _median(20, lambda _, env=env, still=still: env.step(still))
            env.close()
            figures.append(Figure(f"{written}, {name}", 1e3 * resets, "ms", most=most))
            figures.append(Figure(f"{written}, {name}: a reset against a step", resets / steps))
    text = "Medians over seeds, on one core. A reset of the biped restores the settled robot instead of loading it."
    return Section("Resets", text, tuple(figures))


def _median(count: int, job: Any) -> float:
    """Return the median time (s) of `job(number)`."""
    times = []
    for number in range(count):
        start = time.perf_counter()
        job(number)
        times.append(time.perf_counter() - start)
    return statistics.median(times)
