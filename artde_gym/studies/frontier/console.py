"""A frontier as a table for a terminal."""

from __future__ import annotations

import math
from typing import Any

from rich.console import Console
from rich.text import Text

from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.studies.frontier.half import half_text
from artde_gym.studies.frontier.result import Frontier, direction_note, rising_note, value_text


def print_frontier(found: Frontier, console: Console) -> None:
    """Print each controller's frontier, with survival and its interval at both ends of the bracket."""
    axis = found.axis
    console.print()
    if found.levels.empty:
        console.print("No level was finished.")
    else:
        console.print(Text(f"Frontier of {axis.path}", style="bold"))
        wanted = f"{100 * found.survival:g} %"
        most = "largest" if axis.harder == "larger" else "smallest"
        counts = found.levels["episodes"].tolist()
        count = " to ".join(map(str, sorted({min(counts), max(counts)})))
        note = (
            f"{most} value at which at least {wanted} of {count} seeded episodes end without a fall, on a grid of "
            f"{_value(axis.tolerance, axis.unit)} from {axis.low:g} to {_value(axis.high, axis.unit)}; the intervals "
            "cover the uncertainty of the true rates"
        )
        console.print(Text(note, style="dim"))
        console.print(_table(found))
        if note := direction_note(found):
            console.print(note)
        if found.half is not None:
            _print_grid(found, console)
    if not found.complete:
        console.print("Interrupted; finished episodes are kept. Re-run the command to resume.")
    if found.folder is not None:
        console.print(f"Written to {found.folder}")


def _table(found: Frontier) -> FittingTable:
    unit = "" if found.axis.unit == "1" else f" ({found.axis.unit})"
    columns = ("controller", f"frontier{unit}", "survival (95 %)", f"fails at{unit}", "survival there")
    table = FittingTable(*columns, pad_edge=False)
    easy, hard = ("low", "high") if found.axis.harder == "larger" else ("high", "low")
    for row in found.table.to_dict(orient="records"):
        fails = f"{row[hard]:g}" if math.isfinite(row[hard]) else "-"
        table.add_row(str(row["controller"]), value_text(row, "1"), _share(row, easy), fails, _share(row, hard))
    return table


def _print_grid(found: Frontier, console: Console) -> None:
    """Print all falls of a grid, and where half of the episodes end in one."""
    assert found.half is not None
    unit = "" if found.axis.unit == "1" else f" ({found.axis.unit})"
    names = found.table["controller"].tolist()
    falls = FittingTable(f"falls at{unit}", *names, pad_edge=False)
    for value, level in found.levels.groupby("value"):
        rows = {row["controller"]: row for row in level.to_dict(orient="records")}
        falls.add_row(f"{value:g}", *(_falls(rows.get(name)) for name in names))
    console.print(falls)
    if found.half.empty:
        return
    console.print(
        "Half of the episodes end without a fall at (95 % interval: bootstrap over seeds, no narrower than the grid):"
    )
    for row in found.half.to_dict(orient="records"):
        console.print(f"  {row['controller']}: {half_text(row, found.axis, unit=True)}")
    if note := rising_note(found):
        console.print(note)


def _falls(row: dict[Any, Any] | None) -> str:
    return "" if row is None else f"{row['episodes'] - row['survived']}/{row['episodes']}"


def _share(row: dict[Any, Any], end: str) -> str:
    if not math.isfinite(row[end]):
        return "-"
    share, low, high = (f"{100 * row[f'{end}_rate{part}']:.0f}" for part in ("", "_from", "_to"))
    return f"{share} % ({low}..{high})"


def _value(value: float, unit: str) -> str:
    return f"{value:g}" if unit == "1" else f"{value:g} {unit}"
