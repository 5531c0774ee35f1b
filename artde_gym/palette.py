"""One look a controller in every figure: colours that colour-blind readers can tell apart, and markers for print."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from typing import NamedTuple


class Look(NamedTuple):
    """How a figure draws a controller; both as Matplotlib reads them."""

    colour: str
    marker: str


LOOKS: dict[str, Look] = {
    "tde": Look("#0072B2", "o"),
    "atde": Look("#E69F00", "s"),
    "artde": Look("#009E73", "D"),
    "artde-robust": Look("#CC79A7", "P"),
    "tde+c": Look("#56B4E9", "v"),
    "tde+kd": Look("#D55E00", "^"),
    "pid": Look("#7F7F7F", "X"),
    "computed-torque": Look("#000000", "*"),
}
"""Controller -> look. The colours are those of Okabe and Ito, with a grey in place of their yellow."""

OTHERS: tuple[Look, ...] = (
    Look("#332288", "<"),
    Look("#882255", ">"),
    Look("#999933", "p"),
    Look("#44AA99", "h"),
    Look("#CC6677", "d"),
    Look("#117733", "H"),
    Look("#AA4499", "8"),
)
"""For all other names; colours from Tol's "muted" scheme."""


def looks(names: Iterable[str]) -> dict[str, Look]:
    """A look for each name: its own in `LOOKS`, else one of `OTHERS` that depends on the name.

    Two other names that would get the same look get different ones, as long as there are any left.
    """
    chosen: dict[str, Look] = {}
    for name in names:
        first = zlib.crc32(name.encode()) % len(OTHERS)  # `hash` differs from process to process
        turns = [OTHERS[(first + i) % len(OTHERS)] for i in range(len(OTHERS))]
        free = (look for look in turns if look not in chosen.values())
        chosen[name] = LOOKS[name] if name in LOOKS else next(free, turns[0])
    return chosen
