"""A result as tables for a terminal, the thesis' numbers beside ours."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import pandas as pd
from rich import box
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from artde_gym.evaluation import statistics, thesis
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.scenarios import SCENARIOS

METRICS = {
    "rmse_deg": "RMS error (deg)",
    "max_abs_error_deg": "maximum absolute error (deg)",
    "rms_torque_nm": "RMS torque (Nm)",
}
REFERENCE = "artde"
"""The controller that all others are compared with, if it was evaluated: the claims are about this one."""
TOGETHER = 3  # columns of controllers, or of comparisons, that fit a terminal


def print_result(result: Result, console: Console) -> None:
    """Print every scenario of a result."""
    if result.episodes.empty:
        console.print("No episode was finished.")
        return
    summary = result.summary()
    for scenario in result.scenarios:
        console.print()
        console.print(_scenario(result, summary, scenario))
    if not result.complete:
        console.print("\nInterrupted: the tables hold the episodes that were finished.")
    if result.folder is not None:
        console.print(f"\nWritten to {result.folder}")


def print_claims(verdicts: pd.DataFrame, console: Console) -> None:
    """Print the table of `artde_gym.evaluation.claims.judge`."""
    styles = {"holds": "green", "does not hold": "red", "undecided": "yellow", "not measured": "dim"}
    table = _table("scenario", "claim", "verdict", "measured", "thesis", title="Claims")
    for scenario, claim, verdict, measured, printed in verdicts.itertuples(index=False, name=None):
        table.add_row(scenario, claim, Text(verdict, style=styles[verdict]), measured, printed)
        table.add_section()
    console.print()
    console.print(table)


def _scenario(result: Result, summary: pd.DataFrame, scenario: str) -> Group:
    entry = SCENARIOS.get(scenario)
    reference = entry.thesis if entry else None
    title = Text(scenario if entry is None else f"{scenario}: {entry.text}", style="bold")
    count = max(len(result.rows(scenario, controller)) for controller in result.controllers)
    note = f"{count} seeded episode{'s' if count > 1 else ''} a controller; mean, change with its 95 % interval"
    if reference in thesis.TABLES:
        note += f"; thesis: {thesis.TABLES[reference]}"
    parts: list[RenderableType] = [title, Text(note, style="dim"), _falls(result, scenario, reference)]
    axes = [name.removeprefix("rmse_deg_") for name in result.metrics if re.fullmatch(r"rmse_deg_(?!phase)\w+", name)]
    for metric, title in _measured(scenario).items():
        parts += _metric(result, summary, scenario, reference, metric, title, axes)
    return Group(*parts)


def _measured(scenario: str) -> dict[str, str]:
    """Metrics to show and their titles: each phase by itself where the scenario has phases."""
    entry = SCENARIOS.get(scenario)
    if entry is None or not entry.phases:
        return METRICS
    shown = {}
    for metric, title in METRICS.items():
        for number, (start, end) in enumerate(entry.phases, start=1):
            part = f"{start:g} to {end:g} s" if math.isfinite(end) else f"from {start:g} s"
            shown[f"{metric}_phase{number}"] = f"{title}, {part}"
    return shown


def _falls(result: Result, scenario: str, reference: str | None) -> Table:
    table = _table("controller", "falls", "rate", "95 %", "time to fall (s)", "thesis (s)", title="Falls")
    for controller in result.controllers:
        count, rate = result.falls(scenario, controller)
        times = [row["time_to_fall_s"] for row in result.rows(scenario, controller).values()]
        time = statistics.mean(times)
        table.add_row(
            controller,
            f"{count}/{rate.n}",
            _percent(rate.value),
            f"{_percent(rate.low)}..{_percent(rate.high)}",
            f"{time.value:.1f} {_span(time.low, time.high, digits=1)}" if time.n else "-",
            _thesis_fall(reference, controller),
        )
    return table


def _thesis_fall(reference: str | None, controller: str) -> str:
    if controller not in ("tde", "atde", "artde") or reference not in thesis.TABLES:
        return ""
    time = thesis.TIME_TO_FALL.get(reference, {}).get(controller)
    return "walks" if time is None else f"falls at {time:g}"


def _metric(
    result: Result,
    summary: pd.DataFrame,
    scenario: str,
    reference: str | None,
    metric: str,
    title: str,
    axes: list[str],
) -> list[Table]:
    """Two rows an axis, ours and the thesis'. Few controllers and their comparisons share one table."""
    controllers = result.controllers
    rivals = [name for name in controllers if name != REFERENCE] if REFERENCE in controllers else []
    comparisons = {rival: result.compare(REFERENCE, rival).to_dict(orient="index") for rival in rivals}
    means: dict[Any, float] = summary["mean"].to_dict()

    def table(shown: list[str], compared: list[str]) -> Table:
        part = _table("axis", "", title=title)
        for name in (*shown, *(f"{REFERENCE} vs {rival} (%)" for rival in compared)):
            part.add_column(name, justify="right")
        for axis in axes:
            column = f"{metric}_{axis}"
            ours = [f"{means[scenario, name, column]:.3f}" for name in shown]
            ours += [_comparison(comparisons[rival][scenario, column]) for rival in compared]
            part.add_row(axis, "ours", *ours)
            theirs = [_number(thesis.value(reference, name, metric, axis)) for name in shown]
            theirs += [_change(reference, metric, axis, rival) for rival in compared]
            if any(theirs):
                part.add_row("", "thesis", *theirs, style="dim")
        return part

    if len(controllers) <= TOGETHER:
        return [table(controllers, rivals)]
    pairs = [rivals[i : i + TOGETHER] for i in range(0, len(rivals), TOGETHER)]
    return [table(controllers, []), *(table([], pair) for pair in pairs)]


def _table(*columns: str, title: str) -> Table:
    return Table(*columns, title=title, title_justify="left", title_style="italic", box=box.SIMPLE_HEAD, padding=(0, 1))


def _comparison(row: Mapping[str, float]) -> str:
    """Relative difference of the means, with the interval of the paired difference on the same scale."""
    if row["pairs"] == 0:
        return "no pair walked"
    scale = row["percent"] / row["difference"] if row["difference"] else 0.0
    return f"{row['percent']:+.1f} {_span(*sorted((scale * row['low'], scale * row['high'])), digits=0)}"


def _change(reference: str | None, metric: str, axis: str, rival: str) -> str:
    ours, theirs = (thesis.value(reference, name, metric, axis) for name in (REFERENCE, rival))
    return "" if ours is None or theirs is None else f"{100 * (ours / theirs - 1):+.1f}"


def _span(low: float, high: float, digits: int) -> str:
    return f"({low:.{digits}f}..{high:.{digits}f})" if math.isfinite(low) else ""


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _percent(value: float) -> str:
    return "-" if not math.isfinite(value) else f"{100 * value:.0f} %"
