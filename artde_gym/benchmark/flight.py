"""How fast quadrotors fly: one in an engine, thousands in NumPy."""

from __future__ import annotations

from typing import Any

from artde_gym.arrays import Array
from artde_gym.benchmark.environments import ENGINES, fleet, quadrotor
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import TURN, ClosedLoop, Replay, in_turns
from artde_gym.sim.engine_loops import body_loop

PERIODS = 2000  # of 15 ms: half a minute of flight
PHYSICS_STEPS = 15  # a period
LOADS: dict[str, dict[str, Any] | None] = {"payload and wind": None, "nothing else": {}}
SIZES = {1: ("float64",), 16: ("float64",), 256: ("float64",), 1024: ("float64", "float32"),
         4096: ("float64", "float32")}  # fmt: skip
LEAST = {1024: 0.8, 4096: 1.5}
"""Millions of control periods a second in closed loop that the project wants of float64, by number of vehicles."""


class _BareFlight(Replay):
    """The same wrenches in the engine alone."""

    def __init__(self, loop: ClosedLoop, **kwargs: Any) -> None:
        super().__init__(loop, quadrotor(**kwargs))
        self._advance = body_loop(self.env._engine, PHYSICS_STEPS)

    def step(self, action: Array) -> None:
        self._advance(action)


def flying(quick: bool) -> Section:
    """Rates of the same flight in closed loop, in the environment alone and in the bare engine."""
    variants = {}
    for engine in ENGINES:
        for load, disturbances in LOADS.items():
            kwargs = {"engine": engine, "disturbances": disturbances}
            artde = ClosedLoop("artde", quadrotor(**kwargs))
            variants |= {
                (engine, load, "artde"): artde.turn,
                (engine, load, "environment"): Replay(artde, quadrotor(**kwargs)).turn,
                (engine, load, "bare"): _BareFlight(artde, **kwargs).turn,
            }
    times = in_turns(variants, PERIODS // TURN // (10 if quick else 1))
    figures = []
    for engine, written in ENGINES.items():
        for load in LOADS:
            bare = times[engine, load, "bare"]
            name = f"{written}, {load}"
            if load == "nothing else":
                figures.append(Figure(f"{written}, bare: {PHYSICS_STEPS} times write the wrench and step, read once",
                                      1e6 * bare / TURN, "us a period"))  # fmt: skip
            least = 0.5 if engine == "bullet" else None
            figures.append(Figure(f"{name}, env.step: rate against bare", bare / times[engine, load, "environment"],
                                  least=least))  # fmt: skip
            figures.append(Figure(f"{name}, closed loop ARTDE: rate against bare", bare / times[engine, load, "artde"]))
    text = (
        f"A flight of {PERIODS} control periods of 15 ms, {PHYSICS_STEPS} physics steps each, on one core, in the "
        "default disturbances and in none. The environment alone and the bare engine repeat the wrenches of ARTDE's "
        "closed loop; the bare engine knows neither rotors nor air."
    )
    return Section("The quadrotor in an engine", text, tuple(figures))


def fleets(quick: bool) -> Section:
    """Rates of many quadrotors in NumPy, against how many there are."""
    figures = []
    alone = None
    for size, types in SIZES.items():
        for dtype in types:
            artde = ClosedLoop("artde", fleet(size, dtype=dtype))
            environment = Replay(artde, fleet(size, dtype=dtype))
            times = in_turns({"artde": artde.turn, "environment": environment.turn}, 2 if quick else 10)
            rates = {variant: size * TURN / seconds / 1e6 for variant, seconds in times.items()}
            alone = alone or rates["artde"]
            name, least = f"{size} vehicles, {dtype}", LEAST.get(size) if dtype == "float64" else None
            figures += [
                Figure(f"{name}, environment alone", rates["environment"], "M periods/s"),
                Figure(f"{name}, closed loop ARTDE", rates["artde"], "M periods/s", least=least),
                Figure(f"{name}, closed loop ARTDE: rate against 1 vehicle", rates["artde"] / alone),
            ]
    text = (
        f"Control periods of 15 ms in the default disturbances, all vehicles together, on one core; {TURN} periods at "
        "a time in turns, ARTDE driving all of them with one call a period."
    )
    return Section("Many quadrotors in NumPy", text, tuple(figures))
