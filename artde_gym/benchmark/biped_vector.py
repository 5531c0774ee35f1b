"""How fast many bipeds walk at once."""

from __future__ import annotations

import time
from typing import Any

import gymnasium as gym

from artde_gym.benchmark.environments import ENGINES, biped
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import TURN, ClosedLoop, in_turns

LAWS = ("tde", "artde")
SIZES = (8, 32, 64, 256)
THREADED = (64, 256)
STEPS = 3000  # two seconds of standing, a step


def biped_vector(quick: bool) -> Section:
    """Times of a control period in closed loop: of one robot in each engine, and of many in MuJoCo."""
    title = "Many bipeds at once"
    rounds = STEPS // TURN // (10 if quick else 1)
    figures = []
    for law in LAWS:
        alone = {engine: ClosedLoop(law, biped(engine=engine)).turn for engine in ENGINES}
        together = {size: ClosedLoop(law, make_vector(size)).turn for size in SIZES}
        times = in_turns({**alone, **together}, rounds)
        for engine, written in ENGINES.items():
            figures.append(Figure(f"{law.upper()}, one robot in {written}", 1e6 * times[engine] / TURN, "us a period"))
        for size in SIZES:
            share = times[size] / size
            figures.append(Figure(f"{law.upper()}, {size} robots", 1e6 * share / TURN, "us a period and robot"))
            figures.append(Figure(f"{law.upper()}, {size} robots: rate against one in MuJoCo", times["mujoco"] / share))
    for size in THREADED:
        threads = {count: ClosedLoop("artde", make_vector(size, threads=count)).turn for count in (1, 2)}
        walls = in_turns(threads, max(1, rounds // 3), time.perf_counter)
        figures.append(Figure(f"ARTDE, {size} robots, two threads: rate against one", walls[1] / walls[2]))
    text = (
        f"Closed loops in MuJoCo over {STEPS} control periods of 1 ms (two seconds of standing and a step) with a "
        "payload, in one process on one core, by computing time; two threads by the clock on the wall, which means "
        "something only on a machine that has nothing else to do."
    )
    return Section(title, text, tuple(figures))


def make_vector(size: int, **kwargs: Any) -> Any:
    """So many bipeds on a short walk."""
    return gym.make_vec("BipedWalk-Payload-v0", size, "vector_entry_point", duration=6.0, engine="mujoco", **kwargs)
