"""Report of a frontier."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.deprecation import current_configuration
from artde_gym.errors import StoreError
from artde_gym.evaluation.store import parse_table
from artde_gym.palette import styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import Cell, figure, table
from artde_gym.studies.frontier.axis import Axis as Varied
from artde_gym.studies.frontier.half import half_text
from artde_gym.studies.frontier.result import RECORD, Frontier, direction_note, rising_note, value_text

Rows = list[dict[Any, Any]]


def read_frontier(folder: Path) -> tuple[Frontier, dict[str, Any]]:
    """Read a frontier's folder, finished or not, and its record.

    Raises:
        StoreError: if it is not readable.
    """
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        wanted = record["configuration"] = current_configuration(record["configuration"])
        texts = [(folder / name).read_text(encoding="utf-8") for name in ("frontier.csv", "levels.csv")]
        table, levels = (parse_table(text, ("controller", "relation")) for text in texts)
        halves = folder / "half.csv"
        half = parse_table(halves.read_text(encoding="utf-8"), ("controller",)) if halves.exists() else None
        varied, survival = Varied(**wanted["axis"]), wanted["survival"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoreError("frontier", str(folder), "continue the frontier first", "has no finished level") from error
    return Frontier(table, levels, varied, survival, folder, bool(record.get("complete")), half), record


def answer(found: Frontier) -> tuple[str, list[str]]:
    """Return a headline, and a sentence on each controller."""
    axis, rows = found.axis, _records(found.table)
    known = [row for row in rows if math.isfinite(row["frontier"]) and row["relation"] in ("=", ">=", "<=")]
    lines = [_sentence(row, found) for row in rows]
    lines += [note for note in (direction_note(found), rising_note(found)) if note]
    is_open = any(not row["relation"] for row in rows)
    if not known and is_open:
        return f"No frontier of {axis.path} is found yet.", lines
    if not known:
        easiest = value_text({"relation": "=", "frontier": axis.levels[0]}, axis.unit)
        wanted = f"{100 * found.survival:g} % of the episodes"
        return f"No controller survives the easiest level of {axis.path}, {easiest}, in {wanted}.", lines
    sign = 1 if axis.harder == "larger" else -1
    best = max(sign * row["frontier"] for row in known)
    first = [row["controller"] for row in known if sign * row["frontier"] == best]
    reach = value_text(next(row for row in known if row["controller"] == first[0]), axis.unit)
    goes = f"{'go' if len(first) > 1 else 'goes'} farthest{' so far' if is_open else ''}"
    head = f"{' and '.join(first)} {goes} in {axis.path}: {reach}"
    others = [f"{row['controller']} {value_text(row, axis.unit)}" for row in rows if row["controller"] not in first]
    return head + (f" ({'; '.join(others)})." if others else "."), lines


def parts(found: Frontier) -> list[str]:
    """Return chart and tables."""
    axis = found.axis
    shown = styles(str(row["controller"]) for row in _records(found.table))
    caption = "Survival with 95 % intervals (Wilson); markers side by side are one level."
    lines = [
        [Cell(f"{row['value']:g}", row["value"]), row["controller"], Cell(f"{row['survived']} of {row['episodes']}",
         row["rate"]), Cell(f"{100 * row['low']:.0f}..{100 * row['high']:.0f}", row["low"])]
        for row in _records(found.levels)
    ]  # fmt: skip
    unit = "" if axis.unit == "1" else f" ({axis.unit})"
    return [
        figure(caption, {"": survival_chart(found).svg()}, shown),
        *_half(found),
        table("Every level that was run", [f"{axis.path}{unit}", "controller", "no fall", "95 % interval (%)"], lines),
    ]


def survival_chart(found: Frontier, *, legend: bool = False) -> Chart:
    """Draw the share of episodes without a fall over what is varied.

    A legend names each controller's margin: its half point in a grid, where the wanted share is then left out.
    """
    axis = found.axis
    drawn = set(found.levels["controller"])
    shown = styles(name for row in _records(found.table) if (name := str(row["controller"])) in drawn)
    x = Axis.of(f"{axis.path} ({axis.unit})" if axis.unit != "1" else axis.path, [axis.low, axis.high])
    chart = Chart("Share of episodes without a fall against what was varied", x, Axis("no fall (%)", 0, 104), 460, 280)
    if found.half is None or not legend:
        chart.level(100 * found.survival, f"wanted: {100 * found.survival:g} %")
    if found.half is not None:
        chart.level(50, "half")
    apart = min(0.012 * (axis.high - axis.low), 0.5 * axis.tolerance / len(shown))
    for i, (name, look) in enumerate(shown.items()):
        rows = [row for row in _records(found.levels) if row["controller"] == name]
        shift = (i - (len(shown) - 1) / 2) * apart
        places = [row["value"] + shift for row in rows]
        chart.line(places, [100 * row["rate"] for row in rows], look, text=name, kind="path")
        for place, row in zip(places, rows, strict=True):
            chart.interval(place, 100 * row["low"], 100 * row["high"], look)
            chart.marker(
                place, 100 * row["rate"], look, f"{name} at {row['value']:g}: {row['survived']}/{row['episodes']}"
            )
    if legend:
        margins = _margins(found)
        chart.legend({f"{name}: {margins.get(name, 'open')}": look for name, look in shown.items()})
    return chart


def _margins(found: Frontier) -> dict[str, str]:
    """Tell of each controller that was run where half survive, in a grid, or its frontier."""
    if found.half is None:
        return {row["controller"]: value_text(row, found.axis.unit) for row in _records(found.table)}
    return {row["controller"]: f"half at {half_text(row, found.axis, unit=True)}" for row in _records(found.half)}


def _half(found: Frontier) -> list[str]:
    if found.half is None or found.half.empty:
        return []
    unit = "" if found.axis.unit == "1" else f" ({found.axis.unit})"
    heads = ["controller", f"half survive at{unit}"]
    rows = [[row["controller"], Cell(half_text(row, found.axis), row["half"])] for row in _records(found.half)]
    return [table("Half points with 95 % intervals (bootstrap over seeds, no narrower than the grid)", heads, rows)]


def _sentence(row: dict[Any, Any], found: Frontier) -> str:
    axis = found.axis
    text = value_text(row, axis.unit)
    if not row["relation"]:
        return f"{row['controller']}: not found yet."
    easy, hard = ("low", "high") if axis.harder == "larger" else ("high", "low")
    said = [f"{row['controller']}: {text}"]
    for end, what in ((easy, "survives"), (hard, "no more at")):
        if math.isfinite(row[end]):
            share, low, high = (100 * row[f"{end}_rate{part}"] for part in ("", "_from", "_to"))
            said.append(f"{what} {row[end]:g} in {share:.0f} % of the episodes ({low:.0f}..{high:.0f} %)")
    return "; ".join(said) + "."


def _records(frame: pd.DataFrame) -> Rows:
    return frame.to_dict(orient="records")
