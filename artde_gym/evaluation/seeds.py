"""Episode seeds: 64 bits each, and the dtype of their columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

SEED = np.uint64
"""Dtype of a column of seeds: the same for all values, so that joining tables does not round them."""


def episode_seed(seed: int, episode: int) -> int:
    """Derive the seed of one episode; all pairs of numbers give independent streams."""
    return int(np.random.SeedSequence([seed, episode]).generate_state(1, SEED)[0])


def with_exact_seeds(episodes: pd.DataFrame) -> pd.DataFrame:
    """Return a table of episodes with its column `seed` as `SEED`; pandas infers the narrowest type."""
    return episodes.astype({"seed": SEED}) if "seed" in episodes else episodes
