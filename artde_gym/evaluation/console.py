"""Tables of a result for a terminal, beside the numbers of the thesis."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
from rich.console import Console, Group, RenderableType
from rich.padding import Padding
from rich.text import Text

from artde_gym.evaluation import statistics, thesis
from artde_gym.evaluation.environments import metrics_spec_of
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.evaluation.registered import METRICS, PEAK
from artde_gym.evaluation.result import Result
from artde_gym.metrics_spec import MetricsSpec
from artde_gym.scenarios import SCENARIOS

UNITS = {"deg": ("deg", 3), "m": ("m", 4), "mm": ("mm", 3), "nm": ("Nm", 3), "n": ("N", 3), "ns": ("Ns", 4)}
"""Unit in a column's name -> how it is printed, and its number of digits."""
DIGITS = 4  # of metrics with another unit
REFERENCE = "artde"
"""The controller that all others are compared with, if it was evaluated: the claims concern this one."""
ALL = "all"  # all axes together
TOGETHER = 3  # columns of controllers or comparisons that fit a terminal
ACROSS = 4  # columns of axes that fit
NARROW = 110  # characters; a narrower terminal shows claims as paragraphs instead of a table
WIDE = 6  # columns of controllers that still leave a space on either side
_VERDICTS = {"holds": "green", "does not hold": "red", "undecided": "yellow", "not measured": "dim"}


def print_result(result: Result, console: Console) -> None:
    """Print every scenario of a result."""
    if result.episodes.empty:
        console.print("No episode was finished.")
        return
    tables = _Tables(result)
    for scenario in result.scenarios:
        console.print()
        console.print(tables.of(scenario))
    if not result.complete:
        console.print("\nInterrupted: the tables hold the episodes that were finished.")
    if result.folder is not None:
        console.print(f"\nWritten to {result.folder}")


def print_claims(verdicts: pd.DataFrame, console: Console) -> None:
    """Print the table of `artde_gym.studies.reproduce.claims.judge`, or of `confirm`."""
    if console.width < NARROW:
        _print_paragraphs(verdicts, console)
        return
    table = _table(*verdicts.columns, title="Claims")
    for row in verdicts.itertuples(index=False, name=None):
        table.add_row(*(Text(word, style=_VERDICTS.get(word, "")) for word in row))
        table.add_section()
    console.print()
    console.print(table)


def _print_paragraphs(verdicts: pd.DataFrame, console: Console) -> None:
    """Print one claim a paragraph: scenario and claim, then the other columns by name."""
    console.print(Text("\nClaims", style="italic"))
    for row in verdicts.to_dict(orient="records"):
        words = {str(name): str(word) or "-" for name, word in row.items()}
        console.print()
        console.print(Text(f"{words.pop('scenario')}: {words.pop('claim')}", style="bold"))
        for name, word in words.items():
            line = Text.assemble((f"{name}: ", "dim"), (word, _VERDICTS.get(word, "")))
            console.print(Padding(line, (0, 0, 0, 2)))


class _Tables:
    """All tables of a result; each mean and comparison is computed once."""

    def __init__(self, result: Result) -> None:
        self._result = result
        self._controllers = result.controllers
        self._rivals = (
            [name for name in self._controllers if name != REFERENCE] if REFERENCE in self._controllers else []
        )
        self._means: dict[Any, float] = result.summary()["mean"].to_dict()
        self._comparisons = {rival: result.compare(REFERENCE, rival).to_dict(orient="index") for rival in self._rivals}

    def of(self, scenario: str) -> Group:
        entry = SCENARIOS.get(scenario)
        reference = entry.thesis if entry else None
        title = Text(scenario if entry is None else f"{scenario}: {entry.text}", style="bold")
        rows = [self._result.rows(scenario, controller) for controller in self._controllers]
        count = max(map(len, rows))
        note = f"{count} seeded episode{'s' if count > 1 else ''} per controller; mean, change with its 95 % interval"
        if table := thesis.reported(reference).table:
            note += f"; thesis: {table}"
        parts: list[RenderableType] = [title, Text(note, style="dim"), self._falls(scenario, reference)]
        episodes = pd.concat(rows)
        tracking = _measured_axes(metrics_spec_of(episodes["env"].iloc[0]), episodes)
        own = [name for name in METRICS if name in self._result.metrics]
        for metric, what, axes in measured(tracking, () if entry is None else entry.phases, own):
            parts += self._metric(scenario, reference, metric, what, axes)
        return Group(*parts, *self._events(scenario, tracking))

    def _falls(self, scenario: str, reference: str | None) -> FittingTable:
        table = _table("controller", "falls", "rate", "95 %", "time to fall (s)", "thesis (s)", title="Falls")
        for controller in self._controllers:
            count, rate = self._result.falls(scenario, controller)
            time = statistics.mean(self._result.values(scenario, controller, "time_to_fall_s"))
            table.add_row(
                controller,
                f"{count}/{rate.n}",
                _percent(rate.value),
                f"{_percent(rate.low)}..{_percent(rate.high)}",
                f"{time.value:.1f} {_span(time.low, time.high, digits=1)}" if time.n else "-",
                thesis.ending(reference, controller),
            )
        return table

    def _metric(
        self, scenario: str, reference: str | None, metric: str, title: str, axes: list[str]
    ) -> list[FittingTable]:
        """Build two rows per axis: ours, and the thesis'. Few controllers and their comparisons share one table."""
        digits = digits_of(metric)

        def column(axis: str) -> str:
            return metric if axis == ALL else f"{metric}_{axis}"

        def table(shown: list[str], compared: list[str]) -> FittingTable:
            part = _table("axis", "", title=title, keys=2)
            part.collapse_padding = len(shown) > WIDE
            for name in (*shown, *(f"{REFERENCE} vs {rival} (%)" for rival in compared)):
                part.add_column(name, justify="right")
            for axis in axes:
                ours = [f"{self._means[scenario, name, column(axis)]:.{digits}f}" for name in shown]
                ours += [_comparison(self._comparisons[rival][scenario, column(axis)]) for rival in compared]
                theirs = [_number(thesis.value(reference, name, metric, axis), digits) for name in shown]
                theirs += [_change(reference, metric, axis, rival) for rival in compared]
                _add_pair(part, axis, ours, theirs)
            return part

        def comparison() -> FittingTable:
            """Build a table with the axes as columns, for few axes."""
            part = _table(f"{REFERENCE} vs (%)", "", title=title, keys=2)
            for axis in axes:
                part.add_column(axis, justify="right")
            for rival in self._rivals:
                ours = [_comparison(self._comparisons[rival][scenario, column(axis)]) for axis in axes]
                _add_pair(part, rival, ours, [_change(reference, metric, axis, rival) for axis in axes])
            return part

        if len(self._controllers) <= TOGETHER:
            return [table(self._controllers, self._rivals)]
        if len(axes) <= ACROSS:
            return [table(self._controllers, []), *([comparison()] if self._rivals else [])]
        pairs = [self._rivals[i : i + TOGETHER] for i in range(0, len(self._rivals), TOGETHER)]
        return [table(self._controllers, []), *(table([], pair) for pair in pairs)]

    def _events(self, scenario: str, tracking: MetricsSpec) -> list[FittingTable]:
        """Build the table of peaks and recoveries after disturbances; a missing recovery counts as the longest."""
        unit, (text, digits) = tracking.errors[0].unit, UNITS[tracking.errors[0].unit]
        table = _table("after", "", title="after disturbances", keys=2)
        table.collapse_padding = len(self._controllers) > WIDE
        for controller in self._controllers:
            table.add_column(controller, justify="right")
        prefix = f"{PEAK}{unit}_"
        for event in (name.removeprefix(prefix) for name in self._result.metrics if name.startswith(prefix)):
            peaks = [self._means[scenario, name, prefix + event] for name in self._controllers]
            if not any(map(math.isfinite, peaks)):
                continue
            table.add_row(event, f"peak ({text})", *(f"{peak:.{digits}f}" for peak in peaks))
            back = [self._result.recovery(scenario, name, event) for name in self._controllers]
            table.add_row("", "recovered", *(share_text(one.share) for one in back))
            table.add_row("", "median (s)", *(time_text(one.median.value) for one in back))
        return [table] if table.row_count else []


def _measured_axes(spec: MetricsSpec, episodes: pd.DataFrame) -> MetricsSpec:
    """Return a spec with the axes that the episodes have: an arm from a file has other joints than the built-in one."""
    columns = [str(name) for name in episodes.columns[episodes.notna().any()] if name not in METRICS]

    def axes(prefix: str) -> dict[str, int]:
        names = [name.removeprefix(prefix) for name in columns if name.startswith(prefix)]
        return {name: number for number, name in enumerate(names) if not name.startswith("phase")}

    errors = [dataclasses.replace(one, axes=axes(f"rmse_{one.unit}_")) for one in spec.errors]
    efforts = [dataclasses.replace(one, axes=axes(f"rms_{one.name}_{one.unit}_")) for one in spec.efforts]
    return dataclasses.replace(
        spec,
        errors=tuple(one for one in errors if one.axes) or spec.errors,
        efforts=tuple(one for one in efforts if one.axes),
    )


def measured(
    tracking: MetricsSpec, phases: Sequence[tuple[float, float]], registered: Sequence[str] = ()
) -> list[tuple[str, str, list[str]]]:
    """Return the metrics to show with their titles and axes; each phase separately if the scenario has phases.

    `registered` are names of `artde_gym.evaluation.registered`; they come last and cover the whole episode.
    """
    own = [(name, name, [ALL]) for name in registered]
    metrics = [
        (f"{metric}_{tracked.unit}", f"{text} ({UNITS[tracked.unit][0]})", list(tracked.axes))
        for metric, text in (("rmse", "RMS error"), ("max_abs_error", "maximum absolute error"))
        for tracked in tracking.errors
    ]
    metrics += [
        (f"rms_{effort.name}_{effort.unit}", f"RMS {effort.name} ({UNITS[effort.unit][0]})", list(effort.axes))
        for effort in tracking.efforts
    ]
    if not phases:
        main, *others = metrics
        return [(*main[:2], [*main[2], ALL]), *others, *own]
    return [
        (f"{metric}_phase{number}", f"{title}, {_part(*phase)}", axes)
        for metric, title, axes in metrics
        for number, phase in enumerate(phases, start=1)
    ] + own


def digits_of(metric: str) -> int:
    """Return the number of digits for a metric, by the unit in its name."""
    return next((digits for unit, (_, digits) in UNITS.items() if unit in metric.split("_")), DIGITS)


def _part(start: float, end: float) -> str:
    return f"{start:g} to {end:g} s" if math.isfinite(end) else f"from {start:g} s"


def _table(*columns: str, title: str, keys: int = 1) -> FittingTable:
    return FittingTable(*columns, keys=keys, title=title, title_style="italic")


def _add_pair(table: FittingTable, name: str, ours: list[str], theirs: list[str]) -> None:
    table.add_row(name, "ours", *ours)
    if any(theirs):
        table.add_row("", "thesis", *theirs, style="dim")


def _comparison(row: Mapping[str, float]) -> str:
    """Format the relative difference of the means, with the interval of the paired difference on the same scale."""
    if row["pairs"] == 0:
        return "no pair without a fall"
    scale = row["percent"] / row["difference"] if row["difference"] else 0.0
    return f"{row['percent']:+z.1f} {_span(*sorted((scale * row['low'], scale * row['high'])), digits=1)}"


def _change(reference: str | None, metric: str, axis: str, rival: str) -> str:
    ours, theirs = (thesis.value(reference, name, metric, axis) for name in (REFERENCE, rival))
    return "" if ours is None or theirs is None else f"{100 * (ours / theirs - 1):+.1f}"


def _span(low: float, high: float, digits: int) -> str:
    return f"({low:z.{digits}f}..{high:z.{digits}f})" if math.isfinite(low) else ""


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def share_text(share: statistics.Estimate) -> str:
    """Format a share as a count with its interval: "18/20 (70..97 %)"."""
    if not share.n:
        return "unknown"
    return f"{round(share.value * share.n)}/{share.n} ({100 * share.low:.0f}..{100 * share.high:.0f} %)"


def time_text(time: float) -> str:
    """Format the time (s) until an event; infinite means never."""
    return "-" if math.isnan(time) else "never" if math.isinf(time) else f"{time:.2f}"


def _percent(value: float) -> str:
    return "-" if not math.isfinite(value) else f"{100 * value:.0f} %"
