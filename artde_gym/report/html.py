"""The page around tables and charts: one file that needs nothing else."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

from artde_gym.palette import Style
from artde_gym.report.chart import SHAPES

ASSETS = Path(__file__).parent / "assets"


class Cell(NamedTuple):
    """Text of a table, and the number that it is sorted by, if not by the text."""

    text: str
    value: float | None = None
    kind: str = ""


def page(title: str, body: Iterable[str]) -> str:
    """The whole file."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)}</title>\n<style>\n{_asset('chart.css')}{_asset('style.css')}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(body)
        + f"\n</main>\n<script>\n{_asset('sort.js')}</script>\n</body>\n</html>\n"
    )


def section(title: str, *parts: str) -> str:
    """Parts under a head; empty ones are left out."""
    return f"<section>\n<h2>{escape(title)}</h2>\n" + "\n".join(part for part in parts if part) + "\n</section>"


def paragraph(text: str, kind: str = "") -> str:
    """Words; the kind is a class of the style sheet."""
    return f"<p{_kind(kind)}>{escape(text)}</p>"


def bullets(texts: Iterable[str]) -> str:
    """Sentences one below the other."""
    return "<ul>" + "".join(f"<li>{escape(text)}</li>" for text in texts) + "</ul>"


def details(summary: str, *parts: str) -> str:
    """What is folded away until asked for; on paper it is open."""
    return f"<details><summary>{escape(summary)}</summary>\n" + "\n".join(parts) + "\n</details>"


def table(caption: str, columns: Sequence[str], rows: Iterable[Sequence[str | Cell]]) -> str:
    """A table that sorts by the column whose head is pressed; the first cell of a row is its head."""
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
    """Charts by their heads, side by side where there is room, under one legend; or "snapshots", or a "video"."""
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
