"""Training tasks of the quadrotor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from artde_gym.kit import PAYLOAD
from artde_gym.robots.q450.infinity import LIFT, LIFTED_FAN
from artde_gym.robots.q450.kit import kick
from baselines.task import ANYWHERE, SAC, Task, uniform


def _flight(level: float) -> dict[str, Any]:
    """Wind up to two and a half times the default's, from a fan anywhere; any payload, dropped at any time."""
    return {
        "payload": {
            "mass": uniform(0.05, 0.5),
            "position": [uniform(-0.02, 0.02), uniform(-0.02, 0.02), uniform(-0.12, -0.08)],
            "detach_time": uniform(4.0, 30.0),
        },
        "wind": _wind(level),
        "ground_effect": uniform(0.0, 1.5),
        "mass_scale": uniform(0.9, 1.1),
    }


def _slung(level: float) -> dict[str, Any]:
    """Wind as in `_flight`, any load on a cable, kicked twice from anywhere, dropped at any time."""
    return {
        "payload": {
            "mass": uniform(0.1, 0.5),
            "cable": uniform(0.3, 1.0),
            "position": [uniform(-0.01, 0.01), uniform(-0.01, 0.01), uniform(-0.06, -0.04)],
            "detach_time": uniform(20.0, 45.0),
        },
        "push": [_nudge(2.0, 10.0), _nudge(10.0, 20.0)],
        "wind": _wind(level, LIFT),
        "mass_scale": uniform(0.9, 1.1),
    }


def _wind(level: float, lift: float = 0.0) -> dict[str, Any]:
    return {
        "scale": uniform(0.0, 1.0 + 1.5 * level),
        "fan_position": [uniform(-1.2, 1.2), uniform(-0.6, 0.6), uniform(0.4 + lift, 0.8 + lift)],
        "fan_direction": ANYWHERE,
    }


def _nudge(first: float, last: float) -> dict[str, Any]:
    """Push a load for 0.2 s, at any time between two (s)."""
    span = {"direction": ANYWHERE, "start": uniform(first, last), "duration": 0.2}
    return {"body": PAYLOAD, "magnitude": uniform(0.0, 1.0), **span}


def _load_accuracy(rows: pd.DataFrame) -> float:
    """Minus the RMS error of the load (m), plus a meter for a crash."""
    fell, error = np.asarray(rows["fell"], np.float64), np.asarray(rows["rms_load_error_m"], np.float64)
    return float(-(np.nan_to_num(error) + fell).mean())


def _accuracy(rows: pd.DataFrame) -> float:
    """Minus the RMS position error (m), plus a meter for a crash."""
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

TASKS: dict[str, Task] = {
    "QuadInfinity-Payload-v0": Task(
        robot="q450",
        kwargs={"duration": 35.0},
        training=_flight,
        test={"payload": {"mass": 0.35, "detach_time": 20.0}, "wind": 2.0, "ground_effect": 1.0},
        episodes=16,
        score=_accuracy,
        batch_engine=None,
        batch={"engine": "numpy", "dtype": "float32"},
        envs=512,
        ppo=_FLIGHT_PPO,
        sac={**SAC, "gamma": 0.98},
        rollouts=73,  # one episode: shorter intervals would never see its end
        level=1.0,
    ),
    "QuadSling-Payload-v0": Task(
        robot="q450",
        kwargs={"duration": 45.0},
        training=_slung,
        test={  # over any load, so that a policy for one of them is not the best
            "payload": {"mass": uniform(0.1, 0.5), "cable": uniform(0.3, 1.0), "detach_time": 35.0},
            "push": [kick(0.2)],
            "wind": {"scale": 1.0, "fan_position": LIFTED_FAN},
        },
        episodes=32,
        score=_load_accuracy,
        batch_engine=None,
        batch={"engine": "numpy", "dtype": "float32"},
        envs=512,
        ppo={**_FLIGHT_PPO, "n_steps": 64, "gamma": 0.975, "gae_lambda": 0.95},  # a load answers within a second
        sac={**SAC, "gamma": 0.98},
        rollouts=24,  # one episode of decisions of 30 ms
        level=1.0,
    ),
}
