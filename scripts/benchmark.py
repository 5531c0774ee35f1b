"""Speed of the environments as ratios measured in one run, so that they hold on any machine.

make benchmark                              ratios, about a minute
make benchmark ARGS="--steps 1000000"       memory over a million steps too, some minutes
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pybullet as bullet

import artde_gym
import controllers

WALK = 3000  # steps of one measurement: a second on two feet, one on the way to the first step, one step
ROUNDS = 5
RESETS = 200


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=20_000, help="steps of the memory measurement")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    figures = {"version": artde_gym.__version__, **walking(), **resetting(), **memory(options.steps)}
    for name, value in figures.items():
        print(f"{name:42} {value:.3f}" if isinstance(value, float) else f"{name:42} {value}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


def walking() -> dict[str, float]:
    """Rates of the same walk: closed loop, environment alone, bare engine; the same torques, so the same contacts."""
    env = make()
    policies = {name: controllers.make(name, env) for name in ("tde", "artde")}
    rounds: list[dict[str, float]] = []
    for _ in range(ROUNDS):
        times: dict[str, float] = {}
        torques: list[np.ndarray] = []
        for name, policy in policies.items():
            torques, times[name] = closed_loop(env, policy)
        times["environment"] = open_loop(env, torques)
        times["bare"] = bare_loop(env, torques)
        rounds.append(times)
    env.close()

    def ratio(first: str, second: str) -> float:
        return statistics.median(times[first] / times[second] for times in rounds)

    return {
        "bare engine (us a step)": 1e6 * statistics.median(times["bare"] for times in rounds) / WALK,
        "env.step / bare engine (rate, >= 0.85)": ratio("bare", "environment"),
        "closed loop TDE / bare engine (rate)": ratio("bare", "tde"),
        "closed loop ARTDE / bare engine (>= 0.75)": ratio("bare", "artde"),
    }


def closed_loop(env: Any, policy: Any) -> tuple[list[np.ndarray], float]:
    observation, _ = env.reset(seed=0)
    torques, state = [], None
    start = time.perf_counter()
    for _ in range(WALK):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
        torques.append(action)
    return torques, time.perf_counter() - start


def open_loop(env: Any, torques: list[np.ndarray]) -> float:
    env.reset(seed=0)
    return timed(lambda torque: env.step(torque), torques)


def bare_loop(env: Any, torques: list[np.ndarray]) -> float:
    """What a script on PyBullet cannot do without: write torques, step, read the joints."""
    env.reset(seed=0)
    engine = env._engine
    client, robot, joints = engine._client, engine._robot, engine._joints

    def step(torque: list[float]) -> None:
        bullet.setJointMotorControlArray(robot, joints, bullet.TORQUE_CONTROL, forces=torque, physicsClientId=client)
        bullet.stepSimulation(physicsClientId=client)
        bullet.getJointStates(robot, joints, physicsClientId=client)

    return timed(step, [torque.tolist() for torque in torques])


def timed(step: Callable[[Any], object], torques: list[Any]) -> float:
    start = time.perf_counter()
    for torque in torques:
        step(torque)
    return time.perf_counter() - start


def resetting() -> dict[str, float]:
    """Milliseconds of a reset from the stored state, and of one that lets a payload settle for 0.3 s."""
    env = make()

    def milliseconds(disturbances: dict[str, Any]) -> float:
        env.reset(seed=0, options={"disturbances": disturbances})
        times = []
        for seed in range(50):
            start = time.perf_counter()
            env.reset(seed=seed)
            times.append(time.perf_counter() - start)
        return 1e3 * statistics.median(times)

    stored, settled = milliseconds({}), milliseconds({"payload": 1.3})
    env.close()
    return {"reset from the stored state (ms, < 2)": stored, "reset with a payload that settles (ms)": settled}


def memory(steps: int) -> dict[str, float | int]:
    """Growth of the process' resident memory over resets and steps, after a warm-up."""
    env = make(control_period=0.001)
    torque = np.zeros(12)

    def run(resets: int, count: int) -> None:
        for seed in range(resets):
            env.reset(seed=seed)
        for _ in range(count):
            _, _, terminated, truncated, _ = env.step(torque)
            if terminated or truncated:
                env.reset()

    env.reset(seed=0)
    run(5, 2000)
    before = resident()
    run(RESETS, steps)
    after = resident()
    env.close()
    return {
        "memory steps": steps,
        f"memory growth over {RESETS} resets and the steps (MB, < 5)": (after - before) / 1e6,
    }


def make(**kwargs: Any) -> Any:
    """The environment without wrappers."""
    return gym.make("BipedWalk-Payload-v0", duration=6.0, disable_env_checker=True, **kwargs).unwrapped


def resident() -> int:
    """Resident memory of this process in bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096


if __name__ == "__main__":
    main()
