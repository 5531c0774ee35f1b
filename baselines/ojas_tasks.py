"""What is trained on the biped."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from baselines.task import ANYWHERE, SAC, Task, uniform

_AXES = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]


def push(magnitude: Any, direction: Any = None, start: Any = None, duration: Any = 0.2) -> dict[str, Any]:
    """A push on the chest, from any side and during any step without further ado."""
    return {
        "body": "chest",
        "magnitude": magnitude,
        "direction": direction or ANYWHERE,
        "start": start or uniform(2.5, 5.5),
        "duration": duration,
    }


def _pushed(level: float, payload: float, unpushed: int) -> dict[str, Any]:
    """Two pushes of up to 20 N at first and 35 N in the end; `unpushed` of ten of each are none at all."""
    sizes = {"choice": [0.0] * unpushed + np.linspace(14.0, 20.0 + 15.0 * level, 10 - unpushed).round(2).tolist()}
    return {
        "push": [
            push(sizes, start=uniform(2.1, 4.1), duration=uniform(0.15, 0.25)),
            push(sizes, start=uniform(4.6, 5.6), duration=uniform(0.15, 0.25)),
        ],
        "payload": {
            "mass": uniform(0.001, payload),
            "position": [uniform(-0.02, 0.02), uniform(-0.02, 0.02), uniform(0.14, 0.18)],
        },
        "friction": uniform(0.6, 0.9),
        "mass_scale": uniform(0.97, 1.03),
    }


def _survival(rows: pd.DataFrame) -> float:
    """Share of episodes without a fall, and a little for a long time before one."""
    fell, duration = np.asarray(rows["fell"], np.float64), np.asarray(rows["duration_s"], np.float64)
    return float(1.0 - fell.mean() + 0.1 * duration.mean() / duration.max())


_WALK_PPO = {
    "n_steps": 128,
    "batch_size": 512,
    "n_epochs": 6,
    "learning_rate": 3e-4,
    "gamma": 0.99,
    "log_std_init": -1.3,
}

_BIPED: dict[str, Any] = {
    "robot": "ojas",
    "kwargs": {"duration": 8.0, "self_collision": True},
    "episodes": 48,
    "score": _survival,
    "batch_engine": "mujoco",
    "batch": {"engine": "mujoco", "autoreset_mode": "Disabled"},
    "envs": 64,
    "ppo": _WALK_PPO,
    "sac": {**SAC, "gamma": 0.99},
    "rollouts": 8,
    "level": 0.3,
}

TASKS: dict[str, Task] = {
    "BipedPush-v0": Task(
        training=lambda level: _pushed(level, 0.2, 3),
        test={"push": [push({"choice": [15.0, 20.0, 25.0]}, {"choice": _AXES}, uniform(3.0, 5.0))]},
        **_BIPED,
    ),
    "BipedWalk-Payload-v0": Task(
        training=lambda level: _pushed(level, 2.0, 5),
        test={"payload": 1.3, "push": [push({"choice": [10.0, 15.0, 20.0]}, {"choice": _AXES}, uniform(3.0, 5.0))]},
        **_BIPED,
    ),
}
