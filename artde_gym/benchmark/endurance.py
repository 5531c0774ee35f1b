"""Drift over hours in one process: memory, speed, and physics clients left open."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym

from artde_gym.benchmark.environments import ENGINES, biped
from artde_gym.benchmark.figure import Figure
from artde_gym.benchmark.timing import resident
from artde_gym.evaluation.rollout import run_episode
from artde_gym.registration import make_controller
from artde_gym.scenarios import SCENARIOS
from artde_gym.sim.engine_loops import open_clients

GROWTH = 10.0  # MB, at most
DRIFT = 0.9
"""Lowest ratio of the last quarter's speed to the first's."""
WALK = 58.0  # s
WARM = 3
"""Episodes before memory is measured: caches fill."""
_SHORT: dict[str, dict[str, Any]] = {
    "BipedWalk-Payload-v0": {"duration": 0.1, "control_period": 0.004, "actuator_inertia": "lumped"},
    "BipedPush-v0": {"duration": 0.1, "control_period": 0.004, "actuator_inertia": "lumped"},
    "QuadInfinity-Payload-v0": {"duration": 0.3},
    "QuadSling-Payload-v0": {"duration": 0.3},
}

Progress = Callable[[str], None]


def walking(engine: str, seconds: float, told: Progress = lambda _: None) -> tuple[Figure, ...]:
    """Run `seconds` simulated seconds of scenario S2 under ARTDE, walk after walk in one environment."""
    env = biped(engine=engine, duration=min(WALK, seconds), disturbances=SCENARIOS["S2"].disturbances)
    policy = make_controller("artde", env)
    walked, rates, memory, number = 0.0, [], [], 0
    while walked < seconds:
        start = time.process_time()
        row = run_episode(env, policy, number).row
        walked += row["duration_s"]
        rates.append(row["duration_s"] / (time.process_time() - start))
        memory.append(resident())
        number += 1
        told(f"{ENGINES[engine]}: {walked:.0f} of {seconds:.0f} s walked, {rates[-1]:.1f} x real time")
    env.close()
    what = f"{ENGINES[engine]}, {walked:.0f} s of walking in {number} walks"
    return _figures(what, rates, memory)


def starting(episodes: int, told: Progress = lambda _: None) -> tuple[Figure, ...]:
    """Run `episodes` short episodes in turns over all environments and engines, which stay open."""
    envs = [_made(name, engine) for name in _SHORT for engine in ENGINES]
    policies = [make_controller("artde", env) for env in envs]
    rates, memory = [], []
    for number in range(max(1, episodes // len(envs))):
        start = time.process_time()
        for env, policy in zip(envs, policies, strict=True):
            run_episode(env, policy, number)
        rates.append(len(envs) / (time.process_time() - start))
        memory.append(resident())
        if number % 100 == 99:
            told(f"{(number + 1) * len(envs)} of {episodes} episodes")
    for env in envs:
        env.close()
    return _figures(f"{len(rates) * len(envs)} short episodes", rates, memory)


def making(count: int, told: Progress = lambda _: None) -> tuple[Figure, ...]:
    """Make `count` environments one after another, each for an episode; every other one is dropped without closing."""
    places = [(name, engine) for engine in ENGINES for name in _SHORT]
    clients = open_clients()
    figures: list[Figure] = []
    for name, engine in places:
        rates, memory = [], []
        for number in range(max(2, count // len(places))):
            start = time.process_time()
            env = _made(name, engine)
            run_episode(env, make_controller("artde", env), number)
            if number % 2:
                env.close()
            del env
            rates.append(1.0 / (time.process_time() - start))
            memory.append(resident())
        figures += _figures(f"{ENGINES[engine]}, {name}: {len(rates)} environments", rates, memory)
        told(f"{name} in {ENGINES[engine]}: {len(rates)} environments made")
    return (*figures, _left_open(clients))


def replacing(count: int, told: Progress = lambda _: None) -> tuple[Figure, ...]:
    """Replace `count` environments, each for an episode, while others of both engines stay open.

    Memory that engines free then lies between blocks in use, and the C library can reuse it only if it fits.
    """
    places = [(name, engine) for name in _SHORT for engine in ENGINES]
    clients = open_clients()
    envs = [_made(name, engine) for name, engine in places]
    rates, memory = [], []
    for number in range(max(2, count // len(places))):
        start = time.process_time()
        for place, (name, engine) in enumerate(places):
            envs[place].close()
            envs[place] = env = _made(name, engine)
            run_episode(env, make_controller("artde", env), number)
        rates.append(len(places) / (time.process_time() - start))
        memory.append(resident())
        if number % 10 == 9:
            told(f"{(number + 1) * len(places)} of {count} environments replaced")
    for env in envs:
        env.close()
    figures = _figures(f"{len(rates) * len(places)} environments replaced", rates, memory)
    return (*figures, _left_open(clients))


def _made(name: str, engine: str) -> Any:
    return gym.make(name, disable_env_checker=True, engine=engine, **_SHORT[name]).unwrapped


def _left_open(before: int) -> Figure:
    gc.collect()
    return Figure("physics clients left open", float(open_clients() - before), "clients", most=0.0)


def _figures(what: str, rates: list[float], memory: list[int]) -> tuple[Figure, ...]:
    quarter = max(1, len(rates) // 4)
    first, last = statistics.median(rates[:quarter]), statistics.median(rates[-quarter:])
    growth = (memory[-1] - memory[min(max(WARM, len(memory) // 20), len(memory) - 1)]) / 1e6
    return (
        Figure(f"{what}: growth of memory", growth, "MB", most=GROWTH),
        Figure(f"{what}: speed of the last quarter over the first's", last / first, least=DRIFT),
    )
