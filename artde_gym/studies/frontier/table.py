"""The tables of a frontier, from its finished levels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from artde_gym.studies.frontier.axis import Axis
from artde_gym.studies.frontier.bisection import bracket
from artde_gym.studies.frontier.result import Frontier

LEVEL_COLUMNS = ["value", "controller", "episodes", "survived", "rate", "low", "high"]
TABLE_COLUMNS = ["controller", "relation", "frontier", "low", "high"]
TABLE_COLUMNS += [f"{end}_rate{part}" for end in ("low", "high") for part in ("", "_from", "_to")]


def frontier_of(
    varied: Axis, names: list[str], rows: list[dict[str, Any]], survival: float, folder: Path | None, complete: bool
) -> Frontier:
    """Build a frontier from the rows of finished levels."""
    order = {name: i for i, name in enumerate(names)}
    ordered = sorted(rows, key=lambda row: (row["value"], order[row["controller"]]))
    table = [_summary(varied, name, [row for row in rows if row["controller"] == name], survival) for name in names]
    return Frontier(
        pd.DataFrame(table, columns=TABLE_COLUMNS),
        pd.DataFrame(ordered, columns=LEVEL_COLUMNS),
        varied,
        survival,
        folder,
        complete,
    )


def _summary(varied: Axis, name: str, rows: list[dict[str, Any]], survival: float) -> tuple[Any, ...]:
    """Return one row of the table, from the levels of one controller."""
    grid = varied.levels
    by_level = {grid.index(row["value"]): row for row in rows}
    outcomes = {level: row["rate"] >= survival for level, row in by_level.items()}
    _, failed = bracket(outcomes)  # a grid may show survival again beyond it, which counts for nothing
    survived, _ = bracket({level: ok for level, ok in outcomes.items() if failed is None or level < failed})
    larger = varied.harder == "larger"
    relation, value = "", np.nan
    if survived is not None and failed is not None and failed - survived == 1:
        relation, value = "=", grid[survived]
    elif survived == len(grid) - 1:
        relation, value = ">=" if larger else "<=", grid[-1]
    elif failed == 0:
        relation, value = "<" if larger else ">", grid[0]
    below, above = (survived, failed) if larger else (failed, survived)
    ends = [np.nan if level is None else grid[level] for level in (below, above)]
    rates = [
        [np.nan] * 3 if level is None else [by_level[level][part] for part in ("rate", "low", "high")]
        for level in (below, above)
    ]
    return (name, relation, value, *ends, *rates[0], *rates[1])
