"""Speed of the environments as ratios measured in one run, so that they hold on any machine.

make benchmark                              ratios, about a minute
make benchmark ARGS="--steps 1000000"       memory over a million steps too, some minutes
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import statistics
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pybullet as bullet

import artde_gym
import controllers

WALK = 5900  # steps: two seconds of standing, two steps, standing again
TURN = 50  # steps
RESETS = 200
MUJOCO = importlib.util.find_spec("mujoco") is not None  # an extra: its figures are left out without it


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
    """Rates of the same walk: closed loop, environment alone, bare engine; the same torques, so the same contacts.

    All of them advance in turns of a few steps, so that a machine whose speed drifts is as fast for each; a variant's
    time is the median of its turns, which a burst of other work on the machine does not move.
    """
    loops = {"tde": ClosedLoop("tde"), "artde": ClosedLoop("artde")}
    if MUJOCO:
        loops |= {"artde, mujoco": ClosedLoop("artde", engine="mujoco")}
    replays = {"environment": EnvironmentAlone(), "bare": BareEngine()}
    turns: dict[str, list[float]] = {name: [] for name in (*loops, *replays)}
    for _ in range(WALK // TURN):
        for name, loop in loops.items():
            start = time.perf_counter()
            loop.advance(TURN)
            turns[name].append(time.perf_counter() - start)
        for name, replay in replays.items():
            torques = [replay.prepare(torque) for torque in loops["artde"].torques[-TURN:]]
            start = time.perf_counter()
            for torque in torques:
                replay.step(torque)
            turns[name].append(time.perf_counter() - start)
    times = {name: statistics.median(durations) for name, durations in turns.items()}
    figures = {
        "bare engine (us a step)": 1e6 * times["bare"] / TURN,
        "env.step / bare engine (rate, >= 0.85)": times["bare"] / times["environment"],
        "closed loop TDE / bare engine (rate)": times["bare"] / times["tde"],
        "closed loop ARTDE / bare engine (>= 0.75)": times["bare"] / times["artde"],
    }
    if MUJOCO:
        figures["closed loop ARTDE in MuJoCo (us a step)"] = 1e6 * times["artde, mujoco"] / TURN
        figures["the same / in Bullet (rate, >= 3)"] = times["artde"] / times["artde, mujoco"]
    return figures


class ClosedLoop:
    """A controller drives the environment; `torques` remembers how."""

    def __init__(self, name: str, **kwargs: Any) -> None:
        self.env = make(**kwargs)
        self.policy = controllers.make(name, self.env)
        self.observation, _ = self.env.reset(seed=0)
        self.state = None
        self.torques: list[np.ndarray] = []

    def advance(self, steps: int) -> None:
        for _ in range(steps):
            action, self.state = self.policy.predict(self.observation, self.state)
            self.observation, *_ = self.env.step(action)
            self.torques.append(action)


class EnvironmentAlone:
    """The environment under given torques."""

    def __init__(self) -> None:
        self.env = make()
        self.env.reset(seed=0)

    def prepare(self, torque: np.ndarray) -> np.ndarray:
        return torque

    def step(self, torque: np.ndarray) -> None:
        self.env.step(torque)


class BareEngine:
    """What a script on PyBullet cannot do without: write torques, step, read the joints."""

    def __init__(self) -> None:
        self.env = make()
        self.env.reset(seed=0)
        engine = self.env._engine
        self.client, self.robot, self.joints = engine._client, engine._robot, engine._joints

    def prepare(self, torque: np.ndarray) -> list[float]:
        return torque.tolist()

    def step(self, torque: list[float]) -> None:
        bullet.setJointMotorControlArray(
            self.robot, self.joints, bullet.TORQUE_CONTROL, forces=torque, physicsClientId=self.client
        )
        bullet.stepSimulation(physicsClientId=self.client)
        bullet.getJointStates(self.robot, self.joints, physicsClientId=self.client)


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
