"""Comparison with other quadrotor environments, if they are installed; none of them is a dependency."""

from __future__ import annotations

import importlib
import importlib.util
import os
import time
import warnings
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

from artde_gym.benchmark.environments import fleet, quadrotor
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import TURN, Job, in_turns

MANY = 1024


def peers(quick: bool) -> Section:
    """Measure simulated seconds of flight per second of each environment, and our rate relative to theirs."""
    figures: list[Figure] = []
    left_out = []
    pairs: dict[str, tuple[str, Callable[[], _Flyer], Callable[[], _Flyer]]] = {
        "gym-pybullet-drones": ("gym_pybullet_drones", _aviary, lambda: _Flyer(quadrotor(disturbances={}), 0.015)),
        "crazyflow": ("crazyflow", _crazyflow, lambda: _Flyer(fleet(MANY, dtype="float32", disturbances={}), 0.015)),
    }
    for name, (module, make_theirs, make_ours) in pairs.items():
        if importlib.util.find_spec(module) is None:
            left_out.append(f"{name} is not installed")
            continue
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # theirs
                theirs, ours = make_theirs(), make_ours()
                times = in_turns({"theirs": theirs.turn, "ours": ours.turn}, 2 if quick else 20, time.perf_counter)
        except Exception as error:  # of a release other than the one this was written for
            left_out.append(f"{name} does not run here ({type(error).__name__}: {error})")
            continue
        rates = {who: flyer.seconds / times[who] for who, flyer in (("theirs", theirs), ("ours", ours))}
        figures += [
            Figure(f"{name}, {theirs.about}", rates["theirs"], "s of flight/s"),
            Figure(f"ours, {ours.about}", rates["ours"], "s of flight/s"),
            Figure(f"ours against {name}: rate", rates["ours"] / rates["theirs"]),
        ]
    text = (
        "Environments alone, calm air, on the processor, by wall-clock time. They are not the same task: physics "
        "steps, models of rotors and drag, and control periods differ, so the common measure is simulated time."
    )
    return Section("Beside other packages", text, tuple(figures), "; ".join(left_out))


class _Flyer:
    """An environment whose vehicles all repeat the same action."""

    def __init__(self, env: Any, period: float, action: Any = None) -> None:
        self._env = env
        env.reset(seed=0)
        count = getattr(env, "num_envs", 1)
        self._action = env.action_space.high * 0.4 + env.action_space.low * 0.6 if action is None else action
        self.seconds = count * period * TURN
        self.about = f"{count} vehicle{'s' if count > 1 else ''} at {1 / period:.0f} Hz"

    def turn(self) -> Job:
        self._env.reset(seed=0)
        return self._advance

    def _advance(self) -> None:
        rewards = None
        for _ in range(TURN):
            _, rewards, *_ = self._env.step(self._action)
        np.asarray(rewards)  # waits for asynchronous computations


def _aviary() -> _Flyer:
    module = importlib.import_module("gym_pybullet_drones.envs.CtrlAviary")
    env = module.CtrlAviary(pyb_freq=960, ctrl_freq=64, gui=False, user_debug_gui=False)
    return _Flyer(env, 1 / 64, np.full((1, 4), env.HOVER_RPM))


def _crazyflow() -> _Flyer:
    os.environ.setdefault("JAX_PLATFORMS", "cpu")
    importlib.import_module("crazyflow.envs")  # registers its environments
    env: Any = gym.make_vec("DroneReachPos-v0", num_envs=MANY)
    space = env.unwrapped.single_action_space
    action = np.repeat(((space.low + space.high) / 2)[None], MANY, axis=0)
    flyer = _Flyer(env, 1 / env.unwrapped.sim.freq, action)
    flyer._advance()  # compiles
    return flyer
