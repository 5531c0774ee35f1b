"""A frontier as a picture: survival against the varied value, and how far each controller gets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, BinaryIO

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from artde_gym.palette import Style, styles
from artde_gym.studies.frontier.result import Frontier, value_text

WIDTH = 8.0  # inch
CURVES, ROW = 3.9, 0.3  # inch, height of the upper part and of each controller's row in the lower one
DPI = 150
APART = 0.008  # of the range, between two controllers at one level
GREY = "#555555"


def draw(found: Frontier, file: BinaryIO) -> None:
    """Write a PNG. Above: survival with Wilson's 95 % bars. Below: what each controller survives, its bracket pale."""
    rows: list[dict[Any, Any]] = found.table.to_dict(orient="records")
    levels: list[dict[Any, Any]] = found.levels.to_dict(orient="records")
    shown = styles(str(row["controller"]) for row in rows)
    heights = (CURVES, ROW * (len(rows) + 1))
    figure = Figure(figsize=(WIDTH, sum(heights) + 0.3), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=heights)
    for i, row in enumerate(rows):
        name = str(row["controller"])
        shift = (i - (len(rows) - 1) / 2) * APART * (found.axis.high - found.axis.low)
        _curve(upper, [level for level in levels if level["controller"] == name], shown[name], shift)
        _bar(lower, i, row, shown[name], found)
    _finish_upper(upper, found, max(int(level["episodes"]) for level in levels))
    _finish_lower(lower, found, shown)
    figure.savefig(file, format="png")


def _curve(axes: Any, levels: list[dict[Any, Any]], look: Style, shift: float) -> None:
    if not levels:
        return
    x = [level["value"] + shift for level in levels]
    rate = [level["rate"] for level in levels]
    # Wilson's bounds of 0 and 1 miss the rate by a rounding error, and a bar must not be negative
    bars = [[max(0.0, level["rate"] - level["low"]) for level in levels]]
    bars.append([max(0.0, level["high"] - level["rate"]) for level in levels])
    axes.errorbar(x, rate, bars, fmt="none", ecolor=look.color, elinewidth=1, capsize=2, alpha=0.5, zorder=2)
    axes.plot(x, rate, color=look.color, marker=look.marker, markersize=6, linewidth=1.6, zorder=3)


def _bar(axes: Any, place: int, row: dict[Any, Any], look: Style, found: Frontier) -> None:
    axis = found.axis
    easy = axis.low if axis.harder == "larger" else axis.high
    relation, text = row["relation"], value_text(row, axis.unit)
    end = easy if relation in ("", "<", ">") else row["frontier"]
    axes.barh(place, end - easy, left=easy, height=0.5, color=look.color)
    if relation == "=":
        axes.barh(place, row["high"] - row["low"], left=row["low"], height=0.5, color=look.color, alpha=0.25)
        axes.plot(end, place, color=look.color, marker=look.marker, markersize=8, markeredgecolor="white", zorder=4)
    axes.annotate(
        text, (1.01, place), xycoords=("axes fraction", "data"), va="center", color=look.color, annotation_clip=False
    )


def _finish_upper(axes: Any, found: Frontier, count: int) -> None:
    axes.axhline(found.survival, color=GREY, linewidth=1, linestyle=(0, (5, 3)), zorder=1)
    axes.annotate(
        f"{100 * found.survival:g} %",
        (1.01, found.survival),
        xycoords=("axes fraction", "data"),
        va="center",
        color=GREY,
        annotation_clip=False,
    )
    axes.set_ylim(-0.03, 1.03)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.set_ylabel("episodes without a fall")
    axes.grid(axis="y", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    episodes = "1 seeded episode" if count == 1 else f"{count} seeded episodes"
    note = f"{episodes} a level and controller; bars: 95 % interval; markers side by side are one level"
    axes.set_title(note, fontsize=8.5, color=GREY, loc="left")


def _finish_lower(axes: Any, found: Frontier, shown: Mapping[str, Style]) -> None:
    axis = found.axis
    margin = 0.03 * (axis.high - axis.low)
    axes.set_xlim(axis.low - margin, axis.high + margin)
    axes.set_xlabel(axis.path if axis.unit == "1" else f"{axis.path} ({axis.unit})")
    axes.set_ylim(len(shown) - 0.4, -0.6)  # the first controller on top
    axes.set_yticks(range(len(shown)), list(shown), fontweight="bold")
    for tick, look in zip(axes.get_yticklabels(), shown.values(), strict=True):
        tick.set_color(look.color)
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right"]].set_visible(False)
    title = (
        f"survived in at least {100 * found.survival:g} %; pale: between the last level survived and the first failed"
    )
    axes.set_title(title, fontsize=8.5, color=GREY, loc="left")
