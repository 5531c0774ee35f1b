"""The picture of rooms and imports, drawn from the import contract `Rooms import downwards` of pyproject.toml."""

from __future__ import annotations

import ast
import re
import tomllib
from html import escape

from documentation.pages import ROOT

CONTRACT = "Rooms import downwards"
WIDTH, ROW, GAP = 680, 44, 12  # pixels
ABOVE = (("controllers", "baselines"),)
"""Packages beside `artde_gym`, drawn between its command line and its rooms."""


def rooms() -> str:
    """Draw one row a layer, which imports nothing above it; a room's first line of documentation beside its name."""
    layers = [tuple(layer.split(" | ")) for layer in _layers()]
    layers = [layers[0], *ABOVE, *layers[1:]]
    height = len(layers) * (ROW + GAP)
    drawn = [_row(names, place * (ROW + GAP)) for place, names in enumerate(layers)]
    label = "Rooms of the project, each above those that it may import"
    return (
        f'<div class="chart diagram"><svg role="img" aria-label="{label}" viewBox="0 0 {WIDTH} {height}">'
        f"<title>{label}</title>{''.join(drawn)}</svg></div>"
    )


def _layers() -> list[str]:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    return next(contract["layers"] for contract in contracts if contract["name"] == CONTRACT)


def _row(names: tuple[str, ...], top: int) -> str:
    width = (WIDTH - GAP * (len(names) - 1)) / len(names)
    return "".join(_room(name, place * (width + GAP), top, width) for place, name in enumerate(names))


def _room(name: str, left: float, top: int, width: float) -> str:
    text = escape(_summary(name))
    most = width - 16
    fitted = f' textLength="{most:.0f}" lengthAdjust="spacingAndGlyphs"' if 6.1 * len(text) > most else ""
    return (
        f'<rect class="block" x="{left:.0f}" y="{top}" width="{width:.0f}" height="{ROW}" rx="4"/>'
        f'<text class="block-text" x="{left + 8:.0f}" y="{top + 18}"><tspan font-weight="bold">{name}</tspan></text>'
        f'<text class="block-text" x="{left + 8:.0f}" y="{top + 35}"{fitted}>{text}</text>'
    )


def _summary(name: str) -> str:
    """Return what the first line of a module's documentation says before its details."""
    path = ROOT / name.replace(".", "/")
    source = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(encoding="utf-8")
    line = (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0]
    return re.split(r"[;:]|, in which|, one module", line)[0].strip(".").replace("`", "")
