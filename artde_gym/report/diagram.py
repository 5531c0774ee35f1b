"""Block diagrams of control loops."""

from __future__ import annotations

from html import escape
from typing import TypeAlias

Block: TypeAlias = tuple[float, float, float, tuple[str, ...]]
"""Left, top, width and lines of text."""
Wire: TypeAlias = tuple[str, str, float, float]
"""SVG path, text, and the place of the text."""
HEIGHT = 46


def diagram(name: str, height: int, blocks: tuple[Block, ...], wires: tuple[Wire, ...]) -> str:
    """Return an SVG of blocks and wires, 420 wide."""
    drawn = [
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path class="head" d="M0 0L8 4L0 8z"/></marker></defs>'
    ]
    for path, text, x, y in wires:
        drawn.append(f'<path class="wire" d="{path}" marker-end="url(#head)"/>')
        drawn.append(f'<text x="{x}" y="{y}" text-anchor="middle" class="wire-text">{escape(text)}</text>')
    for left, top, width, lines in blocks:
        drawn.append(f'<rect class="block" x="{left}" y="{top}" width="{width}" height="{HEIGHT}" rx="4"/>')
        for i, line in enumerate(lines):
            x, y = left + width / 2, top + HEIGHT / 2 + 4 + 15 * (i - (len(lines) - 1) / 2)
            size = f' textLength="{width - 8}" lengthAdjust="spacingAndGlyphs"' if 5.6 * len(line) > width - 8 else ""
            drawn.append(f'<text class="block-text" x="{x}" y="{y}" text-anchor="middle"{size}>{escape(line)}</text>')
    label = escape(name, quote=True)
    return (
        f'<div class="chart diagram"><svg role="img" aria-label="{label}" viewBox="0 0 420 {height}">'
        f"<title>{escape(name)}</title>{''.join(drawn)}</svg></div>"
    )
