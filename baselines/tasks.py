"""What is trained where: the task of each environment."""

from __future__ import annotations

import numpy as np
import pandas as pd

from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.evaluation.environments import metrics_spec_of, ours, robot_of
from baselines.agent import agent_of
from baselines.task import SAC, Task

HELD_OUT = 202_407
"""Seed of the tests during a training; no training episode has it, nor any of the results in the model cards."""
FALL = 1000.0
"""Cost of a fall in the score of an environment's own task, in the unit of the error."""
_PPO = {"n_steps": 128, "batch_size": 64, "n_epochs": 6, "learning_rate": 3e-4, "gamma": 0.99, "log_std_init": -1.3}


def task(env_id: str) -> Task:
    """The task of an environment.

    Raises:
        UnknownNameError: if no robot has this environment.
    """
    if env_id not in ours():
        raise UnknownNameError("environment to train in", env_id, suggest_names(env_id, ours()))
    return agent_of(robot_of(env_id)).tasks.get(env_id) or own_task(env_id)


def own_task(env_id: str) -> Task:
    """The task of an environment without one: its own disturbances, and as little tracking error as possible."""
    metric = f"rmse_{metrics_spec_of(env_id).errors[0].unit}"

    def score(rows: pd.DataFrame) -> float:
        fell, error = np.asarray(rows["fell"], np.bool_), np.asarray(rows[metric], np.float64)
        return float(-np.where(fell, FALL, error).mean())

    return Task(
        robot=robot_of(env_id),
        kwargs={},
        training=lambda _level: None,
        test=None,
        episodes=16,
        score=score,
        batch_engine=None,
        batch=None,
        envs=1,
        ppo=_PPO,
        sac={**SAC, "gamma": 0.99},
        rollouts=8,
        level=0.0,
    )
