"""Tables for terminals of any width."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rich import box
from rich.console import Console, ConsoleOptions, RenderResult
from rich.measure import Measurement
from rich.table import Column, Table

WRAPPED = 24  # characters; a longer cell may be wrapped between two words
WIDEST = 10_000  # characters at which a table is measured


class FittingTable(Table):
    """A table that cuts nothing: columns for which a terminal has no room follow below, as a further table.

    Args:
        headers: titles of the first columns.
        keys: number of the first columns that every part of a divided table repeats.
        options: other arguments of `rich.table.Table`.
    """

    def __init__(self, *headers: str, keys: int = 1, **options: Any) -> None:
        self._keys, self._options = keys, {"box": box.SIMPLE_HEAD, "title_justify": "left", **options}
        super().__init__(*headers, **self._options)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        wide = options.update(max_width=WIDEST)
        for number, columns in enumerate(self._blocks(console, options.max_width)):
            least, most = zip(*(_widths(column, console) for column in columns), strict=True)
            room = options.max_width - Measurement.get(console, wide, self._part(columns, least)).maximum
            part = self._part(columns, _grown(list(least), most, room) if room >= 0 else [None] * len(columns))
            part.title = self.title if number == 0 else None
            yield part

    def _blocks(self, console: Console, width: int) -> Iterator[Sequence[Column]]:
        """Divide the columns: each block has the key columns, and as many others as there is room for."""
        keys, wide = self.columns[: self._keys], console.options.update(max_width=WIDEST)
        block: list[Column] = []
        for column in self.columns[self._keys :]:
            tried = [*keys, *block, column]
            part = self._part(tried, [_widths(one, console)[0] for one in tried])
            if block and Measurement.get(console, wide, part).maximum > width:
                yield [*keys, *block]
                block = []
            block.append(column)
        yield [*keys, *block]

    def _part(self, columns: Sequence[Column], widths: Sequence[int | None]) -> Table:
        """Return a table of some columns of given widths; None for whatever there is room for."""
        part = Table(**self._options, collapse_padding=self.collapse_padding)
        for column, width in zip(columns, widths, strict=True):
            part.add_column(column.header, justify=column.justify, overflow="fold", width=width)
        for row, cells in zip(self.rows, zip(*(column.cells for column in columns), strict=True), strict=True):
            part.add_row(*cells, style=row.style, end_section=row.end_section)
        return part


def _widths(column: Column, console: Console) -> tuple[int, int]:
    """Return the smallest width (characters) of a column in which no word is cut, and the one without wrapped lines."""
    options = console.options.update(max_width=WIDEST)
    measured = [Measurement.get(console, options, cell) for cell in (column.header, *column.cells)]
    word, line = max(one.minimum for one in measured), max(one.maximum for one in measured)
    return max(word, min(line, WRAPPED)), line


def _grown(widths: list[int], most: Sequence[int], room: int) -> list[int]:
    """Widen columns by up to `room` characters in all, the narrowest of those that lack any first."""
    for _ in range(room):
        short = [i for i, width in enumerate(widths) if width < most[i]]
        if not short:
            break
        widths[min(short, key=widths.__getitem__)] += 1
    return widths
