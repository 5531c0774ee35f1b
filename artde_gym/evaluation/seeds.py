"""Seeds of episodes: 64 bits each, and the type of the columns that hold them."""

from __future__ import annotations

import numpy as np
import pandas as pd

SEED = np.uint64
"""Type of a column of seeds: one type whatever the values, so that tables can be joined without rounding them."""


def episode_seed(seed: int, episode: int) -> int:
    """Derive the seed of one episode: independent streams for all pairs of numbers."""
    return int(np.random.SeedSequence([seed, episode]).generate_state(1, SEED)[0])


def with_exact_seeds(episodes: pd.DataFrame) -> pd.DataFrame:
    """Give the column `seed` of a table of episodes its type; pandas takes the narrowest that its values fit."""
    return episodes.astype({"seed": SEED}) if "seed" in episodes else episodes
