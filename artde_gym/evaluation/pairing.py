"""Pairs of episodes: the same seed and the same disturbances, whatever their numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

_PLACE = ("env", "seed")
DRAWN = "disturbance."
"""Prefix of the columns of what was drawn."""


def paired(mine: pd.DataFrame, theirs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Pick the rows of the same seed in which all that was drawn is the same, row by row beside each other.

    Both are parts of one table, so that they have the same columns.
    """
    return _side_by_side(mine, theirs, episode_key(mine))


def paired_across(mine: pd.DataFrame, theirs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Pick the rows of two scenarios with the same seed in which all that both of them draw is the same."""
    known = set(mine.dropna(axis="columns", how="all")) & set(theirs.dropna(axis="columns", how="all"))
    return _side_by_side(mine, theirs, ["seed", *sorted(name for name in known if name.startswith(DRAWN))])


def episode_key(rows: pd.DataFrame) -> list[str]:
    """Columns that tell the episodes of a controller in a scenario apart."""
    return [name for name in rows if name in _PLACE or name.startswith(DRAWN)]


def _side_by_side(mine: pd.DataFrame, theirs: pd.DataFrame, key: Sequence[str]) -> tuple[pd.DataFrame, pd.DataFrame]:
    first, second = (rows[list(key)].assign(place=np.arange(len(rows))) for rows in (mine, theirs))
    places = first.merge(second, on=list(key), suffixes=("_mine", "_theirs"))  # NaN is equal to NaN here
    return mine.iloc[places["place_mine"].to_numpy()], theirs.iloc[places["place_theirs"].to_numpy()]
