"""Signals of one episode over time: tracking errors, gains, and the Lyapunov function."""

from __future__ import annotations

import numpy as np

from artde_gym.arrays import Array
from artde_gym.evaluation.console import UNITS
from artde_gym.metrics_spec import MetricsSpec, TrackedSignal
from artde_gym.palette import styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import figure
from artde_gym.report.run import INSIDE, Episode, Signals, Strip

INNER: dict[str, tuple[str, str]] = {
    "beta_0": ("b0", "b0 (acceleration)"),
    "beta_1": ("b1", "b1 (acceleration per |xi|)"),
    "c": ("c", "c (acceleration)"),
    "phase": ("phase, support", "phase: 1 left, 0 both, -1 right"),
    "blend": ("b, blend of the support phases", "b (1)"),
    "sigma": ("|sigma|, error of time-delay estimation", "|sigma| (acceleration)"),
    "s": ("|s|, sliding variable", "|s| (SI)"),
}
"""Diagnostic of a law -> heading of its chart and label of its axis; "acceleration" stands for the loop's unit."""
LOOPS = {"": "rad/s^2", "_p": "m/s^2", "_q": "rad/s^2"}
RATES = (("qd_ref", "qd"), ("velocity_ref", "velocity"))
"""Fields of the main error's rate, by robot: reference and measured."""
SETTLED = 0.5  # share of a run after which its largest V is taken as the bound


def tracking_error(episode: Episode, tracking: MetricsSpec) -> list[str]:
    """Return one figure per tracked vector, with one chart per axis."""
    shown = styles(episode.signals)
    figures = []
    for tracked in tracking.errors:
        errors = {name: _error(signals, tracked) for name, signals in episode.signals.items()}
        text = UNITS[tracked.unit][0]
        charts = {}
        for axis, i in tracked.axes.items():
            columns = {name: error[:, i] for name, error in errors.items()}
            if not any(np.isfinite(column).any() for column in columns.values()):
                continue
            chart = over_time(episode, f"Tracking error of {axis}", f"error ({text})", list(columns.values()))
            for name, column in columns.items():
                add(chart, episode.signals[name], column, name)
            charts[axis] = chart.svg()
        caption = f"Tracking error, reference minus measured, episode {episode.number} (seed {episode.seed})."
        caption += " Vertical marks: pushes and drops." if episode.events else ""
        caption += " A cross marks a fall." if any(signals.fell for signals in episode.signals.values()) else ""
        caption += episode.strip.caption
        figures.append(figure(caption, charts, shown))
    return figures


def gains(episode: Episode) -> str:
    """Return charts of adaptive gains, time-delay estimation error and sliding variable."""
    charts = {}
    for suffix, acceleration in LOOPS.items():
        for key, (head, label) in INNER.items():
            sizes = {
                name: _size(inside)
                for name, signals in episode.signals.items()
                if (inside := signals.inside(key + suffix)) is not None
            }
            if not sizes:
                continue
            label = label.replace("acceleration", acceleration)
            loop = {"_p": ", position", "_q": ", attitude"}.get(suffix, "")
            chart = over_time(episode, f"{head}{loop}", label, list(sizes.values()), zero=True)
            for name, size in sizes.items():
                add(chart, episode.signals[name], size, name)
            charts[f"{head}{loop}"] = chart.svg()
    if not charts:
        return ""
    caption = f"Inside the laws, episode {episode.number}: adaptive gains, estimation error and sliding variable."
    caption += episode.strip.caption
    return figure(caption, charts, styles(episode.signals))


def lyapunov(episode: Episode, tracking: MetricsSpec, matrix: tuple[str, Array, Array, Array]) -> str:
    """Return a chart of V = 1/2 xi^T P xi over the run, with the largest value of its second half."""
    owner, p11, p12, p22 = matrix
    shown = styles(episode.signals)
    values = {}
    for name, signals in episode.signals.items():
        e, rate = tracking.errors[0].error(signals.fields), _rate(signals)
        if rate is not None:
            values[name] = 0.5 * (p11 * e * e + 2 * p12 * e * rate + p22 * rate * rate).sum(axis=-1)
    if not values:
        return ""
    positive = np.concatenate([value[value > 0] for value in values.values()])
    floor = float(np.quantile(positive, 0.01)) if len(positive) else 1e-6
    chart = over_time(
        episode, "Lyapunov function V", "V (SI)", [np.maximum(value, floor) for value in values.values()], log=True
    )
    bounds = []
    for name, value in values.items():
        signals = episode.signals[name]
        add(chart, signals, np.maximum(value, floor), name)
        if not signals.fell:
            bound = float(value[signals.time >= SETTLED * signals.time[-1]].max())
            bounds.append(f"{name} {bound:.3g}")
            chart.level(bound, "", shown[name])
    caption = (
        f"Lyapunov function V = 1/2 xi^T P xi with P of {owner}'s Kp and Kd (Q = I) for all. The dashed levels are the "
        "largest V of the second half of a run without a fall, the uniform ultimate bound that it suggests: "
        f"{', '.join(bounds) or 'none here'}.{episode.strip.caption}"
    )
    return figure(caption, {"": chart.svg()}, shown)


def over_time(
    episode: Episode,
    name: str,
    label: str,
    columns: list[Array],
    *,
    log: bool = False,
    zero: bool = False,
    span: tuple[float, float] | None = None,
) -> Chart:
    """Return a chart over an episode's time, or a part of it, with its events marked."""
    y = Axis.of(label, *columns, log=log, zero=zero)
    low, high = span or (0.0, episode.end)
    chart = Chart(f"{name} over time", Axis("time (s)", low, high), y)
    for event, (begin, end) in episode.events.items():
        chart.event(begin, end, event)
    add_strip(chart, episode.strip)
    return chart


def add_strip(chart: Chart, strip: Strip) -> None:
    """Draw the bands of a strip below the chart."""
    for band in strip.bands:
        chart.strip(band.spans, band.style, band.text)


def add(chart: Chart, signals: Signals, values: Array, name: str) -> None:
    """Draw one controller's signal, with a cross at its fall."""
    look = styles([name])[name]
    time = signals.time[: len(values)]
    chart.line(time, values, look, text=name)
    if signals.fell and len(values):
        chart.cross(float(time[-1]), float(values[-1]), look, f"{name} fell at {float(signals.time[-1]):.1f} s")


def _error(signals: Signals, tracked: TrackedSignal) -> Array:
    if tracked.diagnostic is not None and INSIDE + tracked.diagnostic in signals.fields:
        return tracked.scale * signals.fields[INSIDE + tracked.diagnostic]
    return tracked.scale * tracked.error(signals.fields)


def _rate(signals: Signals) -> Array | None:
    for reference, measured in RATES:
        if reference in signals.fields and measured in signals.fields:
            return signals.fields[reference] - signals.fields[measured]
    return None


def _size(values: Array) -> Array:
    return np.linalg.norm(values, axis=-1) if values.ndim > 1 else values
