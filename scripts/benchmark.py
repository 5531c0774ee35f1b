"""Speed of the environments as ratios measured in one run, so that they hold on any machine.

make benchmark                              ratios, about two minutes
make benchmark ARGS="--steps 1000000"       memory over a million steps too, some minutes
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import json
import statistics
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pybullet as bullet

import artde_gym
import controllers

WALK = 5900  # steps: two seconds of standing, two steps, standing again
TURN = 50  # steps
FLIGHT = 2000  # control periods
RESETS = 200
MUJOCO = importlib.util.find_spec("mujoco") is not None  # an extra: its figures are left out without it


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=20_000, help="steps of the memory measurement")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    figures = {"version": artde_gym.__version__, **walking(), **resetting(), **memory(options.steps)}
    figures |= {**flying(), **fleets(), **fleet_memory()}
    for name, value in figures.items():
        print(f"{name:72} {value:.3f}" if isinstance(value, float) else f"{name:72} {value}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


Job = Callable[[], None]


def in_turns(variants: Mapping[str, Callable[[], Job]], rounds: int) -> dict[str, float]:
    """Seconds of computing that each variant takes for its job of a round, which it prepares untimed.

    All of them advance in turns, so that a machine whose speed drifts is as fast for each; a variant's time is the
    median of its turns, which a burst of other work on the machine does not move. Other processes' time is left out.
    """
    turns: dict[str, list[float]] = {name: [] for name in variants}
    for _ in range(rounds):
        for name, prepare in variants.items():
            job = prepare()
            start = time.process_time()
            job()
            turns[name].append(time.process_time() - start)
    return {name: statistics.median(durations) for name, durations in turns.items()}


class ClosedLoop:
    """A controller drives an environment; `actions` remembers how."""

    def __init__(self, name: str, env: Any) -> None:
        self.env = env
        self.policy = controllers.make(name, env)
        self.observation, _ = env.reset(seed=0)
        self.state = None
        self.actions: list[np.ndarray] = []

    def turn(self) -> Job:
        return self._advance

    def _advance(self) -> None:
        for _ in range(TURN):
            action, self.state = self.policy.predict(self.observation, self.state)
            self.observation, *_ = self.env.step(action)
            self.actions.append(action)


class Replay:
    """The last actions of a closed loop once more, in an environment alone."""

    def __init__(self, loop: ClosedLoop, env: Any) -> None:
        self.loop, self.env = loop, env
        env.reset(seed=0)

    def turn(self) -> Job:
        actions = [self.convert(action) for action in self.loop.actions[-TURN:]]

        def job() -> None:
            for action in actions:
                self.step(action)

        return job

    def convert(self, action: np.ndarray) -> Any:
        return action

    def step(self, action: Any) -> None:
        self.env.step(action)


class BareWalk(Replay):
    """What a script on PyBullet cannot do without: write torques, step, read the joints."""

    def __init__(self, loop: ClosedLoop, env: Any) -> None:
        super().__init__(loop, env)
        engine = env._engine
        self.client, self.robot, self.joints = engine._client, engine._robot, engine._joints

    def convert(self, action: np.ndarray) -> list[float]:
        return action.tolist()

    def step(self, action: list[float]) -> None:
        bullet.setJointMotorControlArray(
            self.robot, self.joints, bullet.TORQUE_CONTROL, forces=action, physicsClientId=self.client
        )
        bullet.stepSimulation(physicsClientId=self.client)
        bullet.getJointStates(self.robot, self.joints, physicsClientId=self.client)


class BareFlight(BareWalk):
    """The same for a vehicle: write force and torque, step, fifteen times; read the state once."""

    def step(self, action: list[float]) -> None:
        force, torque, origin = (0.0, 0.0, action[0]), action[1:], (0.0, 0.0, 0.0)
        for _ in range(15):
            bullet.applyExternalForce(self.robot, -1, force, origin, bullet.LINK_FRAME, physicsClientId=self.client)
            bullet.applyExternalTorque(self.robot, -1, torque, bullet.LINK_FRAME, physicsClientId=self.client)
            bullet.stepSimulation(physicsClientId=self.client)
        bullet.getBasePositionAndOrientation(self.robot, physicsClientId=self.client)
        bullet.getBaseVelocity(self.robot, physicsClientId=self.client)


def walking() -> dict[str, float]:
    """Rates of the same walk: closed loop, environment alone, bare engine; the same torques, so the same contacts."""
    tde, artde = (ClosedLoop(name, make()) for name in ("tde", "artde"))
    environment, bare = Replay(artde, make()), BareWalk(artde, make())
    variants = {"tde": tde.turn, "artde": artde.turn, "environment": environment.turn, "bare": bare.turn}
    if MUJOCO:
        variants["artde, mujoco"] = ClosedLoop("artde", make(engine="mujoco")).turn
    times = in_turns(variants, WALK // TURN)
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


def flying() -> dict[str, float]:
    """Rates of the same flight of the quadrotor, likewise, with the payload and the wind, and with nothing."""
    figures = {}
    for label, disturbances in (("", None), (", nothing else on board", {})):
        artde = ClosedLoop("artde", make_quadrotor(disturbances))
        environment = Replay(artde, make_quadrotor(disturbances))
        bare = BareFlight(artde, make_quadrotor(disturbances))
        times = in_turns({"artde": artde.turn, "environment": environment.turn, "bare": bare.turn}, FLIGHT // TURN)
        figures |= {
            f"quadrotor{label}: bare engine (us a period)": 1e6 * times["bare"] / TURN,
            f"quadrotor{label}: env.step / bare engine (rate, >= 0.5)": times["bare"] / times["environment"],
            f"quadrotor{label}: closed loop ARTDE / bare engine": times["bare"] / times["artde"],
        }
    return figures


def fleets() -> dict[str, float]:
    """Millions of control periods a second of many quadrotors in NumPy, on this core."""
    figures = {}
    for size, dtype in itertools.product((1024, 4096), ("float64", "float32")):
        artde = ClosedLoop("artde", make_fleet(size, dtype))
        environment = Replay(artde, make_fleet(size, dtype))
        times = in_turns({"artde": artde.turn, "environment": environment.turn}, 10)
        label = f"batch of {size}, {dtype}"
        target = {1024: ", >= 0.8", 4096: ", >= 1.5"}[size] if dtype == "float64" else ""
        figures[f"{label}: environment alone (M periods/s)"] = size * TURN / times["environment"] / 1e6
        figures[f"{label}: closed loop ARTDE (M periods/s{target})"] = size * TURN / times["artde"] / 1e6
    return figures


def fleet_memory() -> dict[str, float]:
    """Growth of the process' resident memory over steps and restarts of a batch, after a warm-up."""
    env = make_fleet(1024, "float64")
    env.reset(seed=0)
    still = np.zeros((1024, 4))  # they fall, and begin anew about every half second

    def run(steps: int) -> None:
        for _ in range(steps):
            env.step(still)

    run(100)
    before = resident()
    run(500)
    return {"batch of 1024: memory growth over 500 steps and 13 restarts each (MB, < 5)": (resident() - before) / 1e6}


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
    """The biped's environment without wrappers."""
    return gym.make("BipedWalk-Payload-v0", duration=6.0, disable_env_checker=True, **kwargs).unwrapped


def make_quadrotor(disturbances: dict[str, Any] | None) -> Any:
    """The quadrotor's environment without wrappers."""
    return gym.make("QuadInfinity-Payload-v0", disable_env_checker=True, disturbances=disturbances).unwrapped


def make_fleet(size: int, dtype: str) -> Any:
    """Many quadrotors."""
    return gym.make_vec("QuadInfinity-Payload-v0", size, "vector_entry_point", dtype=dtype)


def resident() -> int:
    """Resident memory of this process in bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096


if __name__ == "__main__":
    main()
