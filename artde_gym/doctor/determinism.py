"""Check of bitwise determinism."""

from __future__ import annotations

import hashlib
import multiprocessing
from typing import Any

import gymnasium as gym

from artde_gym.doctor.check_result import CheckResult
from artde_gym.registration import make_controller
from artde_gym.sim.factory import installed_engines

STEPS = 150
WALK, FLIGHT = "BipedWalk-Payload-v0", "QuadInfinity-Payload-v0"
REMEDY = "see docs/determinism.md; results of this machine are not bitwise reproducible"


def determinism() -> list[CheckResult]:
    """Run the same closed loop twice here and once in another process, in every engine."""
    names = runs()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.map_async(digest, names)
        here = [(digest(name), digest(name)) for name in names]
        elsewhere = there.get()
    outcomes = []
    for name, (first, second), other in zip(names, here, elsewhere, strict=True):
        if first == second == other:
            outcomes.append(CheckResult(name, "ok", "bitwise equal in two runs and in another process"))
        else:
            where = "in one process" if first != second else "between processes"
            outcomes.append(CheckResult(name, "failed", f"results differ {where}", REMEDY))
    return outcomes


def runs() -> list[str]:
    """Return the names of the runs."""
    return [
        *(f"{robot} in {engine}" for engine in installed_engines() for robot in ("biped", "quadrotor")),
        "quadrotors in batch",
    ]


def digest(name: str) -> str:
    """Return a hash of all observations of a seeded closed loop."""
    robot, engine = name.split(" in ")
    env: Any
    if engine == "batch":
        env = gym.make_vec(FLIGHT, 4, "vector_entry_point", duration=5.0, engine="numpy")
    else:
        env = gym.make(WALK if robot == "biped" else FLIGHT, disable_env_checker=True, duration=3.0, engine=engine)
    policy = make_controller("artde", env)
    observation, _ = env.reset(seed=0)
    seen, state = hashlib.sha256(observation.tobytes()), None
    for _ in range(STEPS):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        seen.update(observation.tobytes())
    env.close()
    return seen.hexdigest()
