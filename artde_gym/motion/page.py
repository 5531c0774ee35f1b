"""The page around replays: one file that needs no network, a part of a report, or a frame in a notebook."""

from __future__ import annotations

import base64
import functools
import json
import zlib
from collections.abc import Iterable, Mapping
from html import escape
from pathlib import Path
from typing import Any

ASSETS = Path(__file__).parent / "assets"
VIEWER, STYLE = ASSETS / "replay.js", ASSETS / "replay.css"
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
CREDIT = "<!-- The viewer contains three.js, copyright 2010-2026 three.js authors, MIT license. -->"
NEEDED = "To turn the robot, open this page with JavaScript."


def element(data: Mapping[str, Any]) -> str:
    """Return one replay, for any page that has `style` and ends in `viewer`."""
    title = escape(str(data["title"]), quote=True)
    return (
        f'<div class="replay" role="group" aria-label="{title}"><noscript><p class="failed">{NEEDED}</p></noscript>'
        f'<script type="application/json">{json_text(data)}</script></div>'
    )


def json_text(data: Any) -> str:
    """Write JSON that cannot end the script it stands in; NaN, which JSON does not know, as null."""
    return json.dumps(_plain(data), separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


@functools.cache
def style() -> str:
    """Return the look of replays as a style sheet."""
    return STYLE.read_text(encoding="utf-8")


@functools.cache
def viewer() -> str:
    """Return the script that makes replays of a page's elements; it stands at the end of the page, once."""
    code = base64.b64encode(zlib.compress(VIEWER.read_bytes(), 9)).decode()
    return (
        f'{CREDIT}\n<script>(async()=>{{const b=Uint8Array.from(atob("{code}"),c=>c.charCodeAt(0));'
        'const s=document.createElement("script");'
        'const t=new Blob([b]).stream().pipeThrough(new DecompressionStream("deflate"));'
        "s.textContent=await new Response(t).text();"
        "document.body.append(s)})()</script>"
    )


def page(title: str, figures: Iterable[Mapping[str, Any]], viewer_at: str | None = None) -> str:
    """Return a whole page of replays; `viewer_at` is the address of a viewer that it shares, in place of its own."""
    body = "\n".join(f"<h2>{escape(str(data['title']))}</h2>\n{element(data)}" for data in figures)
    alone = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">\n' if viewer_at is None else ""
    last = viewer() if viewer_at is None else f'<script src="{escape(viewer_at, quote=True)}"></script>'
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n<link rel="icon" href="data:,">\n'
        f"{alone}<title>{escape(title)}</title>\n<style>\n{style()}</style>\n</head>\n"
        f'<body class="replay-page">\n<main>\n{body}\n</main>\n{last}\n</body>\n</html>\n'
    )


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and value - value != 0 else value
