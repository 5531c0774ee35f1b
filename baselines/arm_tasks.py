"""Training task of the arm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from artde_gym.scenarios import SCENARIOS
from baselines.task import ANYWHERE, SAC, Task, uniform

FALL = 10.0  # mm, the error of an episode that ends early, in the score


def _pushed(level: float) -> dict[str, Any]:
    """Any payload, grasped and released at any time; three pushes of the tool of up to 60 N, in the end 150 N."""
    return {
        "joint_friction": uniform(0.7, 1.3),
        "payload": {
            "mass": uniform(0.001, 2.5),
            "attach_time": uniform(0.5, 4.0),
            "detach_time": uniform(7.0, 10.0),
        },
        "push": [_push(level, start) for start in (1.0, 4.5, 8.0)],
    }


def _push(level: float, start: float) -> dict[str, Any]:
    return {
        "body": "tool",
        "magnitude": uniform(0.0, 60.0 + 90.0 * level),
        "direction": ANYWHERE,
        "start": uniform(start, start + 2.5),
        "duration": 0.2,
    }


def _accuracy(rows: pd.DataFrame) -> float:
    """Minus the tool's RMS error (mm), and `FALL` for an episode that ends early."""
    fell, error = np.asarray(rows["fell"], np.bool_), np.asarray(rows["rmse_mm"], np.float64)
    return float(-np.where(fell, FALL, error).mean())


TASKS: dict[str, Task] = {
    "ArmTrack-Payload-v0": Task(
        robot="arm",
        kwargs={"duration": 12.0},
        training=_pushed,
        test=SCENARIOS["A3"].disturbances,
        episodes=32,
        score=_accuracy,
        batch_engine="mujoco",
        batch={"engine": "mujoco", "autoreset_mode": "Disabled"},
        envs=64,
        ppo={
            "n_steps": 128,
            "batch_size": 512,
            "n_epochs": 6,
            "learning_rate": 3e-4,
            "gamma": 0.98,
            "log_std_init": -2.0,
        },
        sac={**SAC, "gamma": 0.98},
        rollouts=5,  # one episode
        level=0.3,
    )
}
