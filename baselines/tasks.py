"""What is trained where: disturbances by difficulty, held-out tests, sizes of networks and batches."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from artde_gym.errors import UnknownNameError, among

HELD_OUT = 202_407
"""Seed of the tests during a training; no training episode has it, nor any of the results in the model cards."""


@dataclasses.dataclass(frozen=True)
class Task:
    """A training task.

    Attributes:
        robot: by the environment's `robot_name`.
        kwargs: arguments of the environment.
        training: difficulty from 0 to 1 -> disturbances of the training episodes, drawn anew for each.
        test: disturbances of the held-out episodes.
        episodes: of one held-out test.
        score: the better, the larger, from the rows of a test.
        batch_engine: the engine of the environments of which a batch takes the place; None for any.
        batch: arguments of the batch.
        envs: number of environments in a batch.
        ppo, sac: arguments of the algorithms.
        rollouts: of PPO between two checkpoints.
        level: difficulty at the start.
    """

    robot: str
    kwargs: Mapping[str, Any]
    training: Callable[[float], dict[str, Any]]
    test: Mapping[str, Any]
    episodes: int
    score: Callable[[pd.DataFrame], float]
    batch_engine: str | None
    batch: Mapping[str, Any]
    envs: int
    ppo: Mapping[str, Any]
    sac: Mapping[str, Any]
    rollouts: int
    level: float


def _uniform(low: float, high: float) -> dict[str, list[float]]:
    return {"uniform": [low, high]}


_ANYWHERE = [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0]
_AXES = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]


def _flight(level: float) -> dict[str, Any]:
    """Wind up to two and a half times the default's, from a fan anywhere; any payload, dropped at any time."""
    return {
        "payload": {
            "mass": _uniform(0.05, 0.5),
            "position": [_uniform(-0.02, 0.02), _uniform(-0.02, 0.02), _uniform(-0.12, -0.08)],
            "drop": _uniform(4.0, 30.0),
        },
        "wind": {
            "scale": _uniform(0.0, 1.0 + 1.5 * level),
            "fan_place": [_uniform(-1.2, 1.2), _uniform(-0.6, 0.6), _uniform(0.4, 0.8)],
            "fan_direction": _ANYWHERE,
        },
        "ground_effect": _uniform(0.0, 1.5),
        "mass_error": _uniform(0.9, 1.1),
    }


def push(magnitude: Any, direction: Any = None, start: Any = None, duration: Any = 0.2) -> dict[str, Any]:
    """A push on the chest, from any side and during any step without further ado."""
    return {
        "body": "chest",
        "magnitude": magnitude,
        "direction": direction or _ANYWHERE,
        "start": start or _uniform(2.5, 5.5),
        "duration": duration,
    }


def _pushed(level: float, payload: float, unpushed: int) -> dict[str, Any]:
    """Two pushes of up to 20 N at first and 35 N in the end; `unpushed` of ten of each are none at all."""
    sizes = {"choice": [0.0] * unpushed + np.linspace(14.0, 20.0 + 15.0 * level, 10 - unpushed).round(2).tolist()}
    return {
        "push": [
            push(sizes, start=_uniform(2.1, 4.1), duration=_uniform(0.15, 0.25)),
            push(sizes, start=_uniform(4.6, 5.6), duration=_uniform(0.15, 0.25)),
        ],
        "payload": {
            "mass": _uniform(0.001, payload),
            "position": [_uniform(-0.02, 0.02), _uniform(-0.02, 0.02), _uniform(0.14, 0.18)],
        },
        "friction": _uniform(0.6, 0.9),
        "mass_error": _uniform(0.97, 1.03),
    }


def _survival(rows: pd.DataFrame) -> float:
    """Share of episodes without a fall, and a little for a long time before one."""
    fell, duration = np.asarray(rows["fell"], np.float64), np.asarray(rows["duration_s"], np.float64)
    return float(1.0 - fell.mean() + 0.1 * duration.mean() / duration.max())


def _accuracy(rows: pd.DataFrame) -> float:
    """Minus the RMS position error (m), plus a metre for a crash."""
    fell, error = np.asarray(rows["fell"], np.float64), np.asarray(rows["rmse_m"], np.float64)
    return float(-(error + fell).mean())


_FLIGHT_PPO = {
    "n_steps": 32,
    "batch_size": 4096,
    "n_epochs": 4,
    "learning_rate": 3e-4,
    "gamma": 0.9,
    "gae_lambda": 0.9,
    "log_std_init": -2.3,  # of white noise on a loop that the thesis' gains damp little
}
_WALK_PPO = {
    "n_steps": 128,
    "batch_size": 512,
    "n_epochs": 6,
    "learning_rate": 3e-4,
    "gamma": 0.99,
    "log_std_init": -1.3,
}
_SAC = {"batch_size": 256, "buffer_size": 200_000, "learning_rate": 3e-4, "learning_starts": 2000}

_BIPED: dict[str, Any] = {
    "robot": "ojas",
    "kwargs": {"duration": 8.0, "self_collision": True},
    "episodes": 48,
    "score": _survival,
    "batch_engine": "mujoco",
    "batch": {"engine": "mujoco", "autoreset_mode": "Disabled"},
    "envs": 64,
    "ppo": _WALK_PPO,
    "sac": {**_SAC, "gamma": 0.99},
    "rollouts": 8,
    "level": 0.3,
}

TASKS: dict[str, Task] = {
    "QuadInfinity-Payload-v0": Task(
        robot="q450",
        kwargs={"duration": 35.0},
        training=_flight,
        test={"payload": {"mass": 0.35, "drop": 20.0}, "wind": 2.0, "ground_effect": 1.0},
        episodes=16,
        score=_accuracy,
        batch_engine=None,
        batch={"engine": "numpy", "dtype": "float32"},
        envs=512,
        ppo=_FLIGHT_PPO,
        sac={**_SAC, "gamma": 0.98},
        rollouts=73,  # one episode: shorter intervals would never see its end
        level=1.0,
    ),
    "BipedPush-v0": Task(
        training=lambda level: _pushed(level, 0.2, 3),
        test={"push": [push({"choice": [15.0, 20.0, 25.0]}, {"choice": _AXES}, _uniform(3.0, 5.0))]},
        **_BIPED,
    ),
    "BipedWalk-Payload-v0": Task(
        training=lambda level: _pushed(level, 2.0, 5),
        test={"payload": 1.3, "push": [push({"choice": [10.0, 15.0, 20.0]}, {"choice": _AXES}, _uniform(3.0, 5.0))]},
        **_BIPED,
    ),
}


def task(env_id: str) -> Task:
    """The task of an environment.

    Raises:
        UnknownNameError: if there is none.
    """
    if env_id not in TASKS:
        raise UnknownNameError("environment to train in", env_id, among(env_id, TASKS))
    return TASKS[env_id]
