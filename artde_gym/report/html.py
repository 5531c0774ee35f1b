"""HTML page around tables and charts: one self-contained file."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

from artde_gym.motion import page as replays
from artde_gym.palette import Style
from artde_gym.report.chart import SHAPES

ASSETS = Path(__file__).parent / "assets"
REPLAY = '<div class="replay"'


class Cell(NamedTuple):
    """A table cell: its text, and the number it is sorted by, if not the text."""

    text: str
    value: float | None = None
    kind: str = ""


def page(title: str, body: Iterable[str]) -> str:
    """Return the whole file, with the viewer of replays if it has any."""
    text = "\n".join(body)
    replayed = REPLAY in text
    look = (replays.style() if replayed else "") + _asset("chart.css") + _asset("style.css")
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)}</title>\n<style>\n{look}</style>\n</head>\n<body>\n<main>\n{text}\n</main>\n"
        f"<script>\n{_asset('sort.js')}</script>\n{replays.viewer() if replayed else ''}\n</body>\n</html>\n"
    )


def section(title: str, *parts: str) -> str:
    """Return parts under a heading; empty ones are left out."""
    return f"<section>\n<h2>{escape(title)}</h2>\n" + "\n".join(part for part in parts if part) + "\n</section>"


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph; `kind` is a class of the style sheet."""
    return f"<p{_kind(kind)}>{escape(text)}</p>"


def bullets(texts: Iterable[str]) -> str:
    """Return sentences as a list."""
    return "<ul>" + "".join(f"<li>{escape(text)}</li>" for text in texts) + "</ul>"


def details(summary: str, *parts: str) -> str:
    """Return parts that are folded away on the screen and open in print."""
    return f"<details><summary>{escape(summary)}</summary>\n" + "\n".join(parts) + "\n</details>"


def table(caption: str, columns: Sequence[str], rows: Iterable[Sequence[str | Cell]]) -> str:
    """Return a table that sorts by the column whose header is clicked; the first cell of a row is its header."""
    rows = list(rows)
    kinds = (
        [_kind("text" if isinstance(cell, Cell) and cell.kind == "text" else "") for cell in rows[0]] if rows else []
    )
    heads = zip(columns, kinds or [""] * len(columns), strict=True)
    head = "".join(
        f'<th scope="col"{kind}><button type="button">{escape(column)}</button></th>' for column, kind in heads
    )
    lines = []
    for first, *others in rows:
        cells = "".join(_cell(cell, "td") for cell in others)
        lines.append(f"<tr>{_cell(first, 'th')}{cells}</tr>")
    name = escape(caption, quote=True)
    return (
        f'<div class="scroll" role="region" aria-label="{name}" tabindex="0"><table>'
        f"<caption>{escape(caption)}</caption><thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table></div>"
    )


def figure(
    caption: str, charts: Mapping[str, str], legend: Mapping[str, Style] | None = None, *, kind: str = "charts"
) -> str:
    """Return charts by heading, side by side if there is room, under one legend; or "snapshots", or a "video"."""
    drawn = "".join(
        f'<div class="chart">{f"<h4>{escape(head)}</h4>" if head else ""}{svg}</div>' for head, svg in charts.items()
    )
    keys = "".join(_key(name, look) for name, look in (legend or {}).items())
    return (
        f"<figure><figcaption>{escape(caption)}</figcaption>{f'<p class=legend>{keys}</p>' if keys else ''}"
        f'<div class="{kind}">{drawn}</div></figure>'
    )


def _key(name: str, look: Style) -> str:
    style, shape = f'style="--c:{look.color}"', SHAPES.get(look.marker, SHAPES["o"])
    drawn = f'<path class="line" {style} d="M-14 0H14"/><path class="marker" {style} d="{shape}"/>'
    return f'<span class="key"><svg aria-hidden="true" viewBox="-14 -7 28 14">{drawn}</svg>{escape(name)}</span>'


def _cell(cell: str | Cell, tag: str) -> str:
    text, value, kind = cell if isinstance(cell, Cell) else Cell(cell)
    scope = ' scope="row"' if tag == "th" else ""
    order = "" if value is None else f' data-v="{value:.9g}"'
    return f"<{tag}{scope}{_kind(kind)}{order}>{escape(text)}</{tag}>"


def _kind(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


@functools.cache
def _asset(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")
