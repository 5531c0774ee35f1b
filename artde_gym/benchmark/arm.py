"""Speed of the arm."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np

from artde_gym.arrays import Array
from artde_gym.benchmark.environments import ENGINES, arm
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import TURN, ClosedLoop, Replay, in_turns
from artde_gym.multibody.manipulator import TOOL
from artde_gym.sim.engine_loops import joint_loop, joint_loops

STEPS = 6000
SIZES = (64, 256, 1024)
MANY = 300_000  # steps of all arms of a batch together
LEAST = 0.8  # of a batch's rate against as many bare arms


class BareArm(Replay):
    """The same torques in the engine alone, without friction."""

    def __init__(self, loop: ClosedLoop, engine: str) -> None:
        super().__init__(loop, arm(engine=engine))
        self._advance = joint_loop(self.env._engine)

    def step(self, action: Array) -> None:
        self._advance(action)


class EmptyStep(BareArm):
    """A bare arm behind an environment's step that returns an empty observation and an empty `info`."""

    def step(self, action: Array) -> None:
        self._advance(action)
        self.empty = np.empty(self.env.observation_layout.size), 0.0, False, False, {}


class PlainArm(BareArm):
    """A step with the environment's physics, observation, reward and end, written down without anything else.

    It checks nothing, and knows neither disturbances nor `info`: about the least that this task takes in Python.
    """

    def __init__(self, loop: ClosedLoop, engine: str) -> None:
        super().__init__(loop, engine)
        self._tau = np.zeros(self.env.action_layout.size)
        self._k = 0

    def step(self, action: Array) -> None:
        env, task = self.env, self.env._task
        tau = np.minimum(np.maximum(action, env._low), env._high)
        self._advance(tau + task.friction(1.0, env._engine.state().qd))
        self._k = min(self._k + 1, env._last)
        q, qd, *_ = env._engine.state()
        plan = task.plan[self._k]
        self.observation = np.concatenate([q, qd, plan, tau, env._engine.site(TOOL), task.tool[self._k]])
        error, effort, change = plan[: len(q)] - q, tau / env._effort, (tau - self._tau) / env._effort
        terms = math.exp(-error.dot(error) / 0.002), effort.dot(effort) / len(q), change.dot(change) / len(q)
        self.reward = env.control_period * (1.0 + 2.0 * terms[0] - 0.05 * terms[1] - 0.05 * terms[2])
        self.falls = env._limits.falls(q, qd)
        self._tau = tau


class BareArms(Replay):
    """The same torques of many arms in a bare loop over them, without friction."""

    def __init__(self, loop: ClosedLoop, size: int) -> None:
        super().__init__(loop, arm(engine="mujoco"))
        self._advance = joint_loops(self.env._engine, size)

    def step(self, action: Array) -> None:
        self._advance(action)


def tracking(quick: bool) -> Section:
    """Measure the same motion in closed loop, in the environment alone and in the bare engine; then many arms."""
    skipped = "" if len(ENGINES) > 1 else "the PyBullet part: PyBullet is not installed; see `artde-gym doctor`"
    text = (
        f"{STEPS} steps of pick and place with the built-in arm at a control period of 1 ms (a physics step each), on "
        "one core. The environment alone and the bare engine repeat the torques of ARTDE's closed loop. Beyond the "
        "engine's step the environment computes friction of seven joints, the tool's position, reward and `info`. The "
        "plain step has the same physics, observation, reward and end, but no checks, disturbances and `info`: about "
        "the least for one arm in Python. Many arms are one vector environment in MuJoCo, against a bare "
        f"loop over as many in Python, each in memory of its own; {MANY} steps of all arms together."
    )
    return Section("The arm", text, (*_single(quick), *_many(quick)), skipped)


def _single(quick: bool) -> list[Figure]:
    variants = {}
    for engine in ENGINES:
        tde, artde = (ClosedLoop(name, arm(engine=engine)) for name in ("tde", "artde"))
        variants |= {
            (engine, "tde"): tde.turn,
            (engine, "artde"): artde.turn,
            (engine, "environment"): Replay(artde, arm(engine=engine)).turn,
            (engine, "plain"): PlainArm(artde, engine).turn,
            (engine, "empty"): EmptyStep(artde, engine).turn,
            (engine, "bare"): BareArm(artde, engine).turn,
        }
    times = in_turns(variants, STEPS // TURN // (10 if quick else 1))
    figures = []
    for engine, written in ENGINES.items():
        bare = times[engine, "bare"]
        figures.append(Figure(f"{written}, bare: write torques, step, read joints", 1e6 * bare / TURN, "us per step"))
        for variant, words in (
            ("empty", "an empty step around it"),
            ("plain", "plain step"),
            ("environment", "env.step"),
            ("tde", "closed loop TDE"),
            ("artde", "closed loop ARTDE"),
        ):
            took = times[engine, variant]
            figures.append(Figure(f"{written}, {words}", 1e6 * took / TURN, "us per step"))
            figures.append(Figure(f"{written}, {words}: rate against bare", bare / took))
    return figures


def _many(quick: bool) -> list[Figure]:
    figures = []
    for size in SIZES:
        artde = ClosedLoop("artde", arms(size))
        variants = {
            "artde": artde.turn,
            "environment": Replay(artde, arms(size)).turn,
            "bare": BareArms(artde, size).turn,
        }
        times = in_turns(variants, max(1, MANY // size // TURN // (10 if quick else 1)))
        bare, name, share = times["bare"], f"MuJoCo, {size} arms", 1e6 / TURN / size
        figures.append(Figure(f"{name}, bare loop", share * bare, "us per step and arm"))
        for variant, words, least in (("environment", "env.step", LEAST), ("artde", "closed loop ARTDE", None)):
            figures.append(Figure(f"{name}, {words}", share * times[variant], "us per step and arm"))
            figures.append(Figure(f"{name}, {words}: rate against bare", bare / times[variant], least=least))
    return figures


def arms(size: int) -> Any:
    """Return a vector of arms at pick and place."""
    return gym.make_vec("ArmTrack-Payload-v0", size, "vector_entry_point", engine="mujoco")
