"""Time of a reset."""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from typing import Any

from artde_gym.benchmark.environments import ENGINES, biped, fleet, quadrotor
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import in_turns

RESETS = 50
MANY = 1024
"""Number of vehicles that are reset together."""
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
    figures += _together(2 if quick else 10)
    text = "Medians over seeds, on one core. A reset of the biped restores the settled robot instead of loading it."
    return Section("Resets", text, tuple(figures))


def _together(rounds: int) -> list[Figure]:
    """Measure a reset of many quadrotors by computing time, and relative to a control period of all of them."""
    vehicles = fleet(MANY)
    vehicles.reset(seed=0)
    still = 0.0 * vehicles.action_space.low
    times = in_turns({"reset": lambda: vehicles.reset, "step": lambda: lambda: vehicles.step(still)}, rounds)
    vehicles.close()
    name = f"{MANY} quadrotors in NumPy"
    return [
        Figure(f"{name}: reset of all, for each", 1e6 * times["reset"] / MANY, "us"),
        Figure(f"{name}: a reset against a control period", times["reset"] / times["step"]),
    ]


def _median(count: int, job: Any) -> float:
    """Return the median time (s) of `job(number)`."""
    times = []
    for number in range(count):
        start = time.perf_counter()
        job(number)
        times.append(time.perf_counter() - start)
    return statistics.median(times)
