"""Tables of a scenario with intervals, the thesis' values beside ours, and charts of the same numbers."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from artde_gym.evaluation import statistics, thesis
from artde_gym.evaluation.console import ALL, DIGITS, REFERENCE, UNITS, digits_of, measured, share_text, time_text
from artde_gym.evaluation.registered import PEAK, RECOVERY
from artde_gym.evaluation.statistics import Estimate
from artde_gym.palette import styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import Cell, details, figure, table
from artde_gym.report.run import Run
from artde_gym.scenarios import SCENARIOS

VERDICTS = {"holds": "holds", "does not hold": "fails", "undecided": "open", "not measured": "soft"}
WIDE = 460


def claims(judged: pd.DataFrame) -> str:
    """Return the thesis' claims, each with its verdict."""
    rows = [
        [scenario, Cell(claim, kind="text"), Cell(verdict, kind=VERDICTS.get(verdict, "")), Cell(ours, kind="text"),
         Cell(printed, kind="text")]
        for scenario, claim, verdict, ours, printed in judged.itertuples(index=False, name=None)
    ]  # fmt: skip
    columns = ["scenario", "claim", "verdict", "measured", "thesis"]
    return table("Claims of the thesis, judged by the episodes at 95 %", columns, rows)


def falls(run: Run, scenario: str) -> str:
    """Return falls with Wilson's interval, the time until them, and the ending of the thesis' run."""
    result, reference = run.result, _reference(scenario)
    rows = []
    for name in result.controllers:
        count, rate = result.falls(scenario, name)
        time = statistics.mean(result.values(scenario, name, "time_to_fall_s"))
        rows.append([
            name,
            Cell(f"{count} of {rate.n}", rate.value),
            Cell(_percent(rate), rate.value),
            Cell(_text(time, 1), time.value if time.n else None),
            thesis.ending(reference, name),
        ])  # fmt: skip
    columns = ["controller", "falls", "rate (95 % interval)", "time to fall (s)", "thesis"]
    return table(f"{scenario}: episodes that ended in a fall", *_without_empty(columns, rows))


def survival(run: Run, scenario: str) -> str:
    """Return a chart of the share of episodes without a fall so far, over time."""
    result = run.result
    shown = styles(result.controllers)
    end = float(result.episodes.loc[result.episodes["scenario"] == scenario, "duration_s"].max())
    chart = Chart(
        f"{scenario}: share of episodes without a fall, over time",
        Axis("time (s)", 0.0, end),
        Axis("not fallen yet (%)", 0.0, 104.0),
        WIDE,
        240,
    )
    for name in result.controllers:
        rows = result.rows(scenario, name)
        if rows.empty:
            continue
        times = np.sort(rows["time_to_fall_s"].dropna().to_numpy(dtype=np.float64))
        x = np.concatenate([[0.0], np.repeat(times, 2), [end]])
        y = 100.0 * (1.0 - np.repeat(np.arange(len(times) + 1), 2) / len(rows))
        chart.line(x, y, shown[name], text=name, kind="path")
        chart.marker(end, float(y[-1]), shown[name], f"{name}: {y[-1]:.0f} %")
    caption = "Survival: the share of episodes without a fall so far."
    printed = thesis.reported(_reference(scenario)).time_to_fall
    for name, time in printed.items():
        if name in shown and time <= end:
            chart.cross(time, 50.0, shown[name], f"{name} fell at {time:g} s in the thesis")
            caption += f" Cross at half height: {name} fell at {time:g} s in the thesis."
    return figure(caption, {"": chart.svg()}, shown)


def metrics(run: Run, scenario: str) -> list[str]:
    """Return every metric by axis and controller; the main one open with a chart, the others folded away."""
    entry = SCENARIOS.get(scenario)
    parts = []
    shown = measured(run.tracking(scenario), entry.phases if entry else (), run.registered)
    for number, (metric, title, axes) in enumerate(shown):
        lines = _table(run, scenario, metric, title, axes)
        parts.append(_dots(run, scenario, metric, title, axes) + lines if number == 0 else details(title, lines))
    return parts


def events(run: Run, scenario: str) -> str:
    """Return peak error and recovery time after each push and drop."""
    result, main = run.result, run.tracking(scenario).errors[0]
    text, digits = UNITS[main.unit]
    peak = f"{PEAK}{main.unit}_"
    rows = []
    for event in (name.removeprefix(peak) for name in result.metrics if name.startswith(peak)):
        for name in result.controllers:
            peaks = result.values(scenario, name, peak + event)
            reached = int(np.isfinite(peaks).sum())
            if not reached:
                continue
            height, back = statistics.mean(peaks), result.recovery(scenario, name, event)
            unknown = reached - back.share.n
            rows.append([
                event,
                name,
                Cell(f"{reached} of {len(peaks)}", reached),
                Cell(_text(height, digits), height.value),
                Cell(share_text(back.share), back.share.value if back.share.n else None),
                Cell(time_text(back.median.value), back.median.value if math.isfinite(back.median.value) else None),
                Cell(str(unknown), unknown),
            ])  # fmt: skip
    if not rows:
        return ""
    columns = [
        "event",
        "controller",
        "episodes that reached it",
        f"peak error ({text})",
        "recovered",
        "median recovery (s)",
        "unknown (ended too early)",
    ]
    return table(f"{scenario}: after pushes and drops (95 % intervals)", columns, rows)


def watched(run: Run, scenario: str) -> str:
    """Return RMS and largest value of each watched signal, such as a swing, and how it settles after each push."""
    result, rows = run.result, []
    for signal in run.tracking(scenario).watched:
        text, digits = UNITS.get(signal.unit, (signal.unit, DIGITS))
        end = f"_{signal.name}"
        pushes = [
            column.removeprefix(RECOVERY).removesuffix(end)
            for column in result.metrics
            if column.startswith(RECOVERY) and column.endswith(end)
        ]
        for name in result.controllers:
            means = [
                statistics.mean(result.values(scenario, name, f"{kind}_{signal.name}_{signal.unit}"))
                for kind in ("rms", "max")
            ]
            back = [(push, result.recovery(scenario, name, push + end)) for push in pushes]
            rows.append([
                f"{signal.name.replace('_', ' ')} ({text})",
                name,
                *(Cell(_text(mean, digits), mean.value if mean.n else None) for mean in means),
                "; ".join(f"{push}: {share_text(one.share)}, {time_text(one.median.value)}" for push, one in back),
            ])  # fmt: skip
    if not rows:
        return ""
    columns = ["signal", "controller", "RMS", "largest", "settled after, median time (s)"]
    return table(f"{scenario}: signals beside the errors, means with 95 % intervals", *_without_empty(columns, rows))


def _table(run: Run, scenario: str, metric: str, title: str, axes: list[str]) -> str:
    result, reference = run.result, _reference(scenario)
    rivals = REFERENCE in result.controllers and len(result.controllers) > 1
    digits = digits_of(metric)
    rows = []
    for axis in axes:
        column = metric if axis == ALL else f"{metric}_{axis}"
        for name in result.controllers:
            mean = statistics.mean(result.values(scenario, name, column))
            printed = thesis.value(reference, name, metric, axis)
            row = [
                axis,
                name,
                Cell(_text(mean, digits), mean.value if mean.n else None),
                Cell("" if printed is None else f"{printed:.{digits}f}", printed),
            ]
            if rivals:
                row += _against(run, scenario, column, name)
                row.append(_printed_change(reference, metric, axis, name))
            rows.append(row)
    columns = ["axis", "controller", "mean (95 % interval)", "thesis"]
    if rivals:
        columns += [f"{REFERENCE} against it (%)", f"{REFERENCE} smaller (% of seeds)", "same in the thesis (%)"]
    return table(f"{scenario}: {title}", *_without_empty(columns, rows))


def _without_empty(columns: list[str], rows: list[list[str | Cell]]) -> tuple[list[str], list[list[str | Cell]]]:
    """Leave out columns without any value, such as those of the thesis where it has published none."""
    kept = [i for i in range(len(columns)) if not rows or any(_written(row[i]) for row in rows)]
    return [columns[i] for i in kept], [[row[i] for i in kept] for row in rows]


def _written(cell: str | Cell) -> str:
    return cell.text if isinstance(cell, Cell) else cell


def _against(run: Run, scenario: str, column: str, rival: str) -> list[str | Cell]:
    if rival == REFERENCE:
        return ["", ""]
    ours, theirs = run.result.pairs(scenario, REFERENCE, rival, column)
    gain = statistics.improvement(ours, theirs)
    if not gain.n:
        return ["", ""]
    wins = 100 * statistics.win_probability(ours, theirs)
    change = Estimate(-gain.value, -gain.high, -gain.low, gain.n)
    return [Cell(_text(change, 1, sign="+"), change.value), Cell(f"{wins:.0f}", wins)]


def _printed_change(reference: str | None, metric: str, axis: str, rival: str) -> str | Cell:
    ours, theirs = (thesis.value(reference, name, metric, axis) for name in (REFERENCE, rival))
    if ours is None or theirs is None or rival == REFERENCE:
        return ""
    change = 100 * (ours / theirs - 1)
    return Cell(f"{change:+.1f}", change)


def _dots(run: Run, scenario: str, metric: str, title: str, axes: list[str]) -> str:
    """Return a chart of the means with their intervals side by side, and the thesis' values as short marks."""
    result, reference = run.result, _reference(scenario)
    shown, count = styles(result.controllers), len(result.controllers)
    points: list[tuple[float, str, Estimate, float | None]] = []
    for place, axis in enumerate(axes):
        column = metric if axis == ALL else f"{metric}_{axis}"
        for i, name in enumerate(result.controllers):
            x = place + 0.7 * ((i + 0.5) / count - 0.5)
            mean = statistics.mean(result.values(scenario, name, column))
            points.append((x, name, mean, thesis.value(reference, name, metric, axis)))
    numbers = [value for _, _, mean, printed in points for value in (*mean[:3], printed) if value is not None]
    chart = Chart(
        f"{scenario}: {title} of each axis and controller with 95 % intervals",
        Axis("axis", -0.5, len(axes) - 0.5),
        Axis.of(title, numbers, log=True),
        WIDE,
        300,
        names={axis: float(place) for place, axis in enumerate(axes)},
    )
    for x, name, mean, printed in points:
        if printed is not None:
            chart.dash(x, printed, f"{name} in the thesis: {printed:g}")
        if math.isfinite(mean.low):
            chart.interval(x, mean.low, mean.high, shown[name])
        chart.marker(x, mean.value, shown[name], f"{name}: {_text(mean, digits_of(metric))}")
    caption = f"{title}, mean with its 95 % interval"
    if any(printed is not None for *_, printed in points):
        caption += "; a short bar is the thesis' value for the controller in its column"
    return figure(f"{caption}.", {"": chart.svg()}, shown)


def _reference(scenario: str) -> str | None:
    entry = SCENARIOS.get(scenario)
    return entry.thesis if entry else None


def _text(estimate: Estimate, digits: int, sign: str = "") -> str:
    if not estimate.n:
        return ""
    span = (
        f" ({estimate.low:{sign}.{digits}f}..{estimate.high:{sign}.{digits}f})" if math.isfinite(estimate.low) else ""
    )
    return f"{estimate.value:{sign}.{digits}f}{span}"


def _percent(rate: Estimate) -> str:
    return "" if not rate.n else f"{100 * rate.value:.0f} % ({100 * rate.low:.0f}..{100 * rate.high:.0f})"
