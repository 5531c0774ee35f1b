"""Small charts as SVG that inherit the page's colors, so that one file serves light and dark modes and print.

A chart is drawn at a fixed size in its own units and scales with the page. Lines are thinned to the smallest and the
largest value in each of `COLUMNS` columns: no peak is lost, and a minute of signals takes a few kilobytes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from artde_gym.arrays import Array
from artde_gym.palette import Style

_ASSETS = Path(__file__).parent / "assets"
COLUMNS = 220
LETTER = 7  # width of a letter of a legend, rather too wide than too narrow
LEFT, RIGHT, TOP, BOTTOM = 64, 12, 12, 40  # margins of the drawing, in its own units
TICKS = 5

SHAPES: dict[str, str] = {
    "o": "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z",
    "s": "M-3.6 -3.6h7.2v7.2h-7.2z",
    "D": "M0 -5L5 0L0 5L-5 0z",
    "P": "M-1.5 -4.5h3v3h3v3h-3v3h-3v-3h-3v-3h3z",
    "^": "M0 -4.6L4.6 3.6H-4.6z",
    "v": "M0 4.6L4.6 -3.6H-4.6z",
    "<": "M-4.6 0L3.6 -4.6V4.6z",
    ">": "M4.6 0L-3.6 -4.6V4.6z",
    "X": "M-4.4 -2.2L-2.2 -4.4L0 -2.2L2.2 -4.4L4.4 -2.2L2.2 0L4.4 2.2L2.2 4.4L0 2.2L-2.2 4.4L-4.4 2.2L-2.2 0z",
    "*": "M0 -5.4L1.4 -1.6H5.2L2.2 .7L3.3 4.4L0 2.2L-3.3 4.4L-2.2 .7L-5.2 -1.6H-1.4z",
}
"""Outline of a marker around the origin, by Matplotlib's letter; any other letter is a circle."""


class Axis(NamedTuple):
    """An axis: its label with the unit, and its range; logarithmic if `log` is true."""

    label: str
    low: float
    high: float
    log: bool = False

    @classmethod
    def of(cls, label: str, *values: ArrayLike, log: bool = False, zero: bool = False) -> Axis:
        """Return an axis over all finite values with some margin; from zero if `zero` is true."""
        flat = np.concatenate([np.asarray(value, dtype=np.float64).ravel() for value in values] or [np.zeros(0)])
        flat = flat[np.isfinite(flat) & (flat > 0 if log else True)]
        low, high = (float(flat.min()), float(flat.max())) if len(flat) else (0.1, 1.0)
        if log:
            low, high = 10 ** math.floor(math.log10(low) + 1e-9), 10 ** math.ceil(math.log10(high) - 1e-9)
            return cls(label, low, high if high > low else 10 * low, log=True)
        low = min(low, 0.0) if zero else low
        room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
        return cls(label, low if zero and low == 0 else low - room, high + room)

    def place(self, values: ArrayLike) -> Array:
        """Return values as fractions of the axis, 0 to 1; NaN for values that a logarithmic axis cannot show."""
        array = np.asarray(values, dtype=np.float64)
        if not self.log:
            return (array - self.low) / (self.high - self.low)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.log(array / self.low) / math.log(self.high / self.low)
        return np.where(array > 0, np.maximum(share, 0.0), np.nan)

    def ticks(self) -> list[float]:
        """Return round values within the range, about `TICKS` of them."""
        if self.log:
            first, last = round(math.log10(self.low)), round(math.log10(self.high))
            if last - first < TICKS / 2:
                steps = (factor * 10.0**power for power in range(first, last + 1) for factor in (1, 2, 5))
                return [step for step in steps if step <= self.high]
            stride = max(1, math.ceil((last - first) / TICKS))
            return [10.0**power for power in range(first, last + 1, stride)]
        rough = (self.high - self.low) / TICKS
        size = 10 ** math.floor(math.log10(rough))
        step = next(size * factor for factor in (1, 2, 5, 10) if size * factor >= rough)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [i * step for i in range(first, last + 1)]


class Chart:
    """One drawing with two axes.

    Args:
        name: alternative text for screen readers; the page's caption says more.
        x, y: axes.
        width, height: in its own units; a unit is about a pixel.
        names: positions on the x axis that are labeled with a name instead of a number.
        frame: whether axes are drawn.
    """

    def __init__(
        self,
        name: str,
        x: Axis,
        y: Axis,
        width: int = 400,
        height: int = 250,
        names: Mapping[str, float] | None = None,
        *,
        frame: bool = True,
    ) -> None:
        self.x, self.y, self._name = x, y, name
        self.width, self.height = width, height
        self._beside = 0  # width of a legend
        self._parts = [self._frame(names)] if frame else []

    def line(self, x: ArrayLike, y: ArrayLike, look: Style, *, text: str = "", kind: str = "line") -> None:
        """Draw a thinned line; values that are not finite leave gaps."""
        across, up = self._points(x, y)
        if len(across) > 2 * COLUMNS and kind != "path":
            across, up = _thinned(across, up)
        self._parts.append(
            f'<path class="{kind}" style="--c:{look.color}" d="{_path(across, up)}">{_title(text)}</path>'
        )

    def reference(self, x: ArrayLike, y: ArrayLike, text: str = "reference") -> None:
        """Draw a dashed line in the page's text color: the reference."""
        across, up = self._points(x, y)
        self._parts.append(f'<path class="reference" d="{_path(*_thinned(across, up))}">{_title(text)}</path>')

    def marker(self, x: float, y: float, look: Style, text: str = "") -> None:
        (across,), (up,) = self._points([x], [y])
        if math.isfinite(across + up):
            shape = SHAPES.get(look.marker, SHAPES["o"])
            place = f"translate({across:.1f} {up:.1f})"
            self._parts.append(
                f'<path class="marker" style="--c:{look.color}" transform="{place}" d="{shape}">{_title(text)}</path>'
            )

    def interval(self, x: float, low: float, high: float, look: Style) -> None:
        """Draw a vertical bar from low to high."""
        (across, _), ups = self._points([x, x], [low, high])
        if np.isfinite(ups).all():
            self._parts.append(
                f'<path class="interval" style="--c:{look.color}" d="M{across:.1f} {ups[0]:.1f}V{ups[1]:.1f}"/>'
            )

    def dash(self, x: float, y: float, text: str) -> None:
        """Draw a short horizontal mark: a published value."""
        (across,), (up,) = self._points([x], [y])
        if math.isfinite(up):
            self._parts.append(f'<path class="dash" d="M{across - 7:.1f} {up:.1f}h14">{_title(text)}</path>')

    def cross(self, x: float, y: float, look: Style, text: str) -> None:
        """Draw a cross that marks a fall."""
        (across,), (up,) = self._points([x], [y])
        if math.isfinite(across + up):
            place = f"translate({across:.1f} {up:.1f})"
            self._parts.append(
                f'<path class="cross" style="--c:{look.color}" transform="{place}" d="M-5 -5L5 5M-5 5L5 -5">'
                f"{_title(text)}</path>"
            )

    def event(self, begin: float, end: float, text: str) -> None:
        """Draw a vertical mark from `begin` to `end`, labeled at the top."""
        if not self.x.low <= begin <= self.x.high:
            return
        (first, last), _ = self._points([begin, min(end, self.x.high)], [self.y.low] * 2)
        size = self.height - TOP - BOTTOM
        late = first > 0.8 * self.width  # no room for the label on its right
        place = f'x="{first - 4:.1f}" text-anchor="end"' if late else f'x="{first + 4:.1f}"'
        self._parts.append(
            f'<g class="event"><rect x="{first:.1f}" y="{TOP}" width="{max(last - first, 1.5):.1f}" height="{size}"/>'
            f'<text {place} y="{TOP + 10}">{escape(text)}</text></g>'
        )

    def strip(self, spans: Sequence[tuple[float, float]], look: Style, text: str) -> None:
        """Mark parts of the x axis with a color, just below it."""
        floor, (low, high) = self.height - BOTTOM + 3, (self.x.low, self.x.high)
        shown = [(max(begin, low), min(end, high)) for begin, end in spans if begin < high and end > low]
        if shown:
            ends, _ = self._points(shown, np.full((len(shown), 2), self.y.low))
            drawn = "".join(f"M{first:.1f} {floor}H{last:.1f}" for first, last in ends)
            self._parts.append(f'<path class="strip" style="--c:{look.color}" d="{drawn}">{_title(text)}</path>')

    def level(self, y: float, text: str, look: Style | None = None) -> None:
        """Draw a horizontal line, labeled at its right end."""
        (_,), (up,) = self._points([self.x.low], [y])
        if TOP <= up <= self.height - BOTTOM:
            style = f' style="--c:{look.color}"' if look else ""
            self._parts.append(
                f'<g class="level"{style}><path d="M{LEFT} {up:.1f}H{self.width - RIGHT}"/>'
                f'<text x="{self.width - RIGHT - 2}" y="{up - 4:.1f}" text-anchor="end">{escape(text)}</text></g>'
            )

    def guide(self, x: ArrayLike, y: ArrayLike) -> None:
        """Draw a thin line in the grid's style."""
        self._parts.append(f'<path class="grid" d="{_path(*self._points(x, y))}"/>')

    def box(self, x: tuple[float, float], y: tuple[float, float], look: Style, text: str = "") -> None:
        """Fill a rectangle between two values of each axis."""
        (left, right), (bottom, top) = self._points(x, y)
        outline = f"M{left:.1f} {bottom:.1f}H{right:.1f}V{top:.1f}H{left:.1f}z"
        self._parts.append(f'<path class="box" style="--c:{look.color}" d="{outline}">{_title(text)}</path>')

    def label(self, x: float, y: float, text: str) -> None:
        """Write words that begin at a point."""
        (across,), (up,) = self._points([x], [y])
        self._parts.append(f'<text class="label" x="{across:.1f}" y="{up:.1f}">{escape(text)}</text>')

    def text(self, x: float, y: float, text: str) -> None:
        (across,), (up,) = self._points([x], [y])
        self._parts.append(f'<text x="{across:.1f}" y="{up:.1f}" text-anchor="middle">{escape(text)}</text>')

    def legend(self, shown: Mapping[str, Style]) -> None:
        """Name the styles beside the drawing, for a chart that stands alone."""
        for i, (name, look) in enumerate(shown.items()):
            down = 20 + 16 * i
            shape = SHAPES.get(look.marker, SHAPES["o"])
            self._parts.append(
                f'<path class="marker" style="--c:{look.color}" transform="translate({self.width + 6} {down})" '
                f'd="{shape}"/><text x="{self.width + 16}" y="{down + 4}">{escape(name)}</text>'
            )
        self._beside = 20 + LETTER * max(map(len, shown), default=0)

    def svg(self) -> str:
        name = escape(self._name, quote=True)
        box = f"0 0 {self.width + self._beside} {self.height}"
        return f'<svg role="img" aria-label="{name}" viewBox="{box}"><title>{name}</title>{"".join(self._parts)}</svg>'

    def file(self) -> str:
        """Return the chart as a standalone SVG file, in the colors of the reports."""
        style = "".join((_ASSETS / name).read_text(encoding="utf-8") for name in ("chart.css", "style.css"))
        size = (
            f'xmlns="http://www.w3.org/2000/svg" width="{2 * (self.width + self._beside)}" height="{2 * self.height}"'
        )
        whole = self.svg().replace("<svg ", f"<svg {size} ", 1)
        return whole.replace("</title>", f"</title><style><![CDATA[{style}]]></style>", 1)

    def _points(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        across = LEFT + self.x.place(x) * (self.width - LEFT - RIGHT)
        up = self.height - BOTTOM - self.y.place(y) * (self.height - TOP - BOTTOM)
        return across, up

    def _frame(self, names: Mapping[str, float] | None) -> str:
        floor, right = self.height - BOTTOM, self.width - RIGHT
        parts = []
        for text, value in [(_number(tick), tick) for tick in self.y.ticks()]:
            (_,), (up,) = self._points([self.x.low], [value])
            parts.append(f'<path class="grid" d="M{LEFT} {up:.1f}H{right}"/>')
            parts.append(f'<text x="{LEFT - 6}" y="{up + 4:.1f}" text-anchor="end">{text}</text>')
        for text, value in [(_number(tick), tick) for tick in self.x.ticks()] if names is None else names.items():
            (across,), (_,) = self._points([value], [self.y.low])
            parts.append(f'<path class="axis" d="M{across:.1f} {floor}v4"/>')
            parts.append(f'<text x="{across:.1f}" y="{floor + 17}" text-anchor="middle">{escape(text)}</text>')
        parts.append(f'<path class="axis" d="M{LEFT} {TOP}V{floor}H{right}"/>')
        middle = (TOP + floor) / 2
        parts.append(
            f'<text class="label" x="{(LEFT + right) / 2}" y="{self.height - 5}" text-anchor="middle">'
            f"{escape(self.x.label)}</text>"
            f'<text class="label" transform="translate(13 {middle}) rotate(-90)" text-anchor="middle">'
            f"{escape(self.y.label)}</text>"
        )
        return "".join(parts)


def height_of(x: Axis, y: Axis, width: int) -> int:
    """Return the height of a chart of this width with equal units on both axes."""
    return round((width - LEFT - RIGHT) * (y.high - y.low) / (x.high - x.low)) + TOP + BOTTOM


def _thinned(x: Array, y: Array) -> tuple[Array, Array]:
    """Return the smallest and the largest `y` of each column in order, and both ends."""
    if len(x) <= 2 * COLUMNS:
        return x, y
    edges = np.linspace(0, len(x), COLUMNS + 1).astype(int)
    kept = [0, len(x) - 1]
    for first, last in itertools.pairwise(edges.tolist()):
        part = y[first:last]
        if np.isfinite(part).any():
            kept += [first + int(np.nanargmin(part)), first + int(np.nanargmax(part))]
    order = sorted(set(kept))
    return x[order], y[order]


def _path(x: Sequence[float] | Array, y: Sequence[float] | Array) -> str:
    parts, pen = [], "M"
    for across, up in zip(x, y, strict=True):
        if math.isfinite(across + up):
            parts.append(f"{pen}{across:.1f} {up:.1f}")
            pen = "L"
        else:
            pen = "M"
    return "".join(parts)


def _title(text: str) -> str:
    return f"<title>{escape(text)}</title>" if text else ""


def _number(value: float) -> str:
    return f"{0.0 if abs(value) < 1e-12 else value:.6g}"
