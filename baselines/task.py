"""A training task: disturbances by difficulty, a held-out test, sizes of networks and batches."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import pandas as pd


@dataclasses.dataclass(frozen=True)
class Task:
    """A training task.

    Attributes:
        robot: by the environment's `robot_name`.
        kwargs: arguments of the environment.
        training: difficulty from 0 to 1 -> disturbances of the training episodes, drawn anew for each; None for the
            environment's own.
        test: disturbances of the held-out episodes; None for the environment's own.
        episodes: of one held-out test.
        score: the better, the larger, from the rows of a test.
        batch_engine: the engine of the environments of which a batch takes the place; None for any.
        batch: arguments of the batch; None for no batch.
        envs: number of environments in a batch.
        ppo, sac: arguments of the algorithms.
        rollouts: of PPO between two checkpoints.
        level: difficulty at the start.
    """

    robot: str
    kwargs: Mapping[str, Any]
    training: Callable[[float], dict[str, Any] | None]
    test: Mapping[str, Any] | None
    episodes: int
    score: Callable[[pd.DataFrame], float]
    batch_engine: str | None
    batch: Mapping[str, Any] | None
    envs: int
    ppo: Mapping[str, Any]
    sac: Mapping[str, Any]
    rollouts: int
    level: float


SAC = {"batch_size": 256, "buffer_size": 200_000, "learning_rate": 3e-4, "learning_starts": 2000}
"""Arguments of SAC that all tasks share."""
ANYWHERE = [{"normal": [0.0, 1.0]}, {"normal": [0.0, 1.0]}, 0.0]
"""A random direction in the ground plane."""


def uniform(low: float, high: float) -> dict[str, list[float]]:
    """Write a distribution."""
    return {"uniform": [low, high]}
