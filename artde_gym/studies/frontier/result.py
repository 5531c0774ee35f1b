"""The result of a frontier: a row for each controller, and the levels that were tested."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.studies.frontier.axis import Axis

RECORD = "frontier.json"
HALF = 0.5


@dataclasses.dataclass(frozen=True)
class Frontier:
    """The result of a frontier.

    Attributes:
        table: one row per controller. Read `relation` and `frontier` together: "=" is the hardest value survived, ">="
            (or "<=" where smaller is harder) means the end of the range was survived too, "<" (">") that not even the
            easy end was survived, "" not found yet. `low`, `high`: the bracket, adjacent tested values around the
            crossing, NaN beyond the range; `low_rate`, `low_rate_from`, `low_rate_to`: survival at `low` with its 95 %
            interval; the same for `high`.
        levels: one row per tested value and controller; `rate` with its 95 % interval `low`, `high`.
        axis: the varied number.
        survival: share of episodes at which a level counts as survived.
        folder: the results folder, if they are stored.
        complete: False if the search was interrupted.
        half: of a grid, one row a controller: the value at which `half` of the episodes are survived with its 95 %
            interval `low`, `high`, over at least so many `episodes` a level; see `artde_gym.studies.frontier.half`.
        episodes: of a grid that has just been run, those of all levels, whose numbers are the scenarios.
    """

    table: pd.DataFrame
    levels: pd.DataFrame
    axis: Axis
    survival: float
    folder: Path | None = None
    complete: bool = True
    half: pd.DataFrame | None = None
    episodes: pd.DataFrame | None = None


def value_text(row: Mapping[Any, Any], unit: str) -> str:
    """Format a row's frontier with its relation and unit, e.g. ">= 60 N", or "open" if it was not found yet."""
    if not row["relation"]:
        return "open"
    relation = "" if row["relation"] == "=" else f"{row['relation']} "
    return f"{relation}{row['frontier']:g}{'' if unit == '1' else f' {unit}'}"


def direction_note(found: Frontier) -> str:
    """Say which controllers survive the hardest level more often than the easiest one; "" if none does."""
    rates = found.levels.set_index(["controller", "value"])["rate"].to_dict()
    easiest, hardest = found.axis.levels[0], found.axis.levels[-1]
    rising = [
        str(name)
        for name in found.table["controller"]
        if rates.get((name, hardest), math.nan) > rates.get((name, easiest), math.nan)
    ]
    if not rising:
        return ""
    other = "smaller" if found.axis.harder == "larger" else "larger"
    return (
        f"More survive the hardest level than the easiest one under {', '.join(rising)}: are {other} values the harder "
        f"ones (--harder {other})?"
    )


def rising_note(found: Frontier) -> str:
    """Say where survival rises from a level of a grid to the next harder one, across one half or beyond chance.

    Beyond chance means that the 95 % intervals of the two levels do not overlap. A half point, which is that of a
    monotone fit, and a frontier, which ends at the first level not survived, both hide such a rise.
    """
    if found.half is None:
        return ""
    unit = "" if found.axis.unit == "1" else f" {found.axis.unit}"
    levels = found.levels.set_index(["controller", "value"])
    rate, low, high = (levels[column].to_dict() for column in ("rate", "low", "high"))
    rises = [
        f"{name} from {easier:g} to {harder:g}{unit}"
        for name in found.half["controller"]
        for easier, harder in itertools.pairwise(found.axis.levels)
        if rate[name, easier] < HALF <= rate[name, harder] or high[name, easier] < low[name, harder]
    ]
    return f"Survival rises, which half points hide: {', '.join(rises)}." if rises else ""
