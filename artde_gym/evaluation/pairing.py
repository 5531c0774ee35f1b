"""Pairs of episodes with the same seed and the same disturbances, whatever their numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

_PLACE = ("env", "seed")
DRAWN = "disturbance."
"""Prefix of the columns of sampled values."""


def paired(mine: pd.DataFrame, theirs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the rows with the same seed and the same sampled disturbances, in matching order.

    Both are parts of one table and have the same columns.
    """
    return _side_by_side(mine, theirs, episode_key(mine))


def paired_across(mine: pd.DataFrame, theirs: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the rows of two scenarios with the same seed that agree in all sampled columns common to both."""
    known = set(mine.dropna(axis="columns", how="all")) & set(theirs.dropna(axis="columns", how="all"))
    return _side_by_side(mine, theirs, ["seed", *sorted(name for name in known if name.startswith(DRAWN))])


def episode_key(rows: pd.DataFrame) -> list[str]:
    """Return the columns that identify an episode of a controller in a scenario."""
    return [name for name in rows if name in _PLACE or name.startswith(DRAWN)]


def _side_by_side(mine: pd.DataFrame, theirs: pd.DataFrame, key: Sequence[str]) -> tuple[pd.DataFrame, pd.DataFrame]:
    first, second = (rows[list(key)].assign(place=np.arange(len(rows))) for rows in (mine, theirs))
    places = first.merge(second, on=list(key), suffixes=("_mine", "_theirs"))  # merge treats NaN as equal to NaN
    return mine.iloc[places["place_mine"].to_numpy()], theirs.iloc[places["place_theirs"].to_numpy()]
