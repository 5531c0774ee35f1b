"""Rollouts of PPO of which decisions without an effect are mostly left out."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.extras import needs

with needs("rl"):
    import torch
    from stable_baselines3.common.buffers import RolloutBuffer

OPEN = 0.05  # of the gate; a shut one would be 0, were the normalizer not still moving
KEPT = 5  # one in so many of the others is learned from, for the values there


class OpenRollouts(RolloutBuffer):
    """Rollouts without the decisions under a shut gate, which did nothing: their advantage is noise.

    Args:
        gate: normalized features (n, n_features) -> the gate (n,).
    """

    def __init__(self, *args: Any, gate: Callable[[NDArray[Any]], NDArray[Any]], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._gate = gate

    def get(self, batch_size: int | None = None) -> Generator[Any, None, None]:
        """Minibatches, shuffled."""
        next(super().get(1))  # brings the arrays into their final shape
        counts = self._gate(self.observations) > OPEN
        counts[::KEPT] = True
        chosen = np.flatnonzero(counts)
        chosen = chosen[torch.randperm(len(chosen)).numpy()]
        size = batch_size or len(chosen)
        for start in range(0, len(chosen), size):
            yield self._get_samples(chosen[start : start + size])
