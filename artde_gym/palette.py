"""One look a controller in every figure: colors that color-blind readers can tell apart, and markers for print."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from typing import NamedTuple


class Style(NamedTuple):
    """How a figure draws a controller; both as Matplotlib reads them."""

    color: str
    marker: str


STYLES: dict[str, Style] = {
    "tde": Style("#0072B2", "o"),
    "atde": Style("#E69F00", "s"),
    "artde": Style("#009E73", "D"),
    "artde-robust": Style("#CC79A7", "P"),
    "tde+c": Style("#56B4E9", "v"),
    "tde+kd": Style("#D55E00", "^"),
    "pid": Style("#7F7F7F", "X"),
    "computed-torque": Style("#000000", "*"),
}
"""Controller -> look. The colors are those of Okabe and Ito, with a gray in place of their yellow."""

OTHERS: tuple[Style, ...] = (
    Style("#332288", "<"),
    Style("#882255", ">"),
    Style("#999933", "p"),
    Style("#44AA99", "h"),
    Style("#CC6677", "d"),
    Style("#117733", "H"),
    Style("#AA4499", "8"),
)
"""For all other names; colors from Tol's "muted" scheme."""


def styles(names: Iterable[str]) -> dict[str, Style]:
    """A look for each name: its own in `STYLES`, else one of `OTHERS` that depends on the name.

    Two other names that would get the same look get different ones, as long as there are any left.
    """
    chosen: dict[str, Style] = {}
    for name in names:
        first = zlib.crc32(name.encode()) % len(OTHERS)  # `hash` differs from process to process
        turns = [OTHERS[(first + i) % len(OTHERS)] for i in range(len(OTHERS))]
        free = (look for look in turns if look not in chosen.values())
        chosen[name] = STYLES[name] if name in STYLES else next(free, turns[0])
    return chosen
