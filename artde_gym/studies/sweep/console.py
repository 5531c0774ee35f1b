"""What a sweep has found as a table for a terminal, one row a cell."""

from __future__ import annotations

import math
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from artde_gym.evaluation import statistics
from artde_gym.evaluation.environments import metrics_spec_of
from artde_gym.studies.sweep.execution import Sweep

MOST = 50  # rows
WIDEST = 10_000  # characters, of a table that is measured
_PREFIXES = ("gains.", "env_kwargs.", "disturbance.")


def print_sweep(found: Sweep, console: Console) -> None:
    """Print what differs between the cells, their falls and their errors."""
    for name in found.set_aside:
        console.print(f"Not as it had been written, set aside and run again: {name}")
    episodes: Any = found.episodes
    if episodes.empty:
        console.print("No episode was finished.")
        return
    varied = _varied(episodes)
    cells = [frame for _, frame in episodes.groupby([*varied, "cell"], dropna=False)]
    table = _table(cells[:MOST], varied)
    console.print(
        table
        if console.measure(table, options=console.options.update(max_width=WIDEST)).maximum <= console.width
        else _narrow(cells[:MOST], varied)
    )
    if len(cells) > MOST:
        console.print(f"... and {len(cells) - MOST} more cells: artde_gym.evaluation.read_sweep({str(found.folder)!r})")
    if not found.complete:
        console.print("Interrupted: the same command continues; finished episodes are kept.")
    console.print(f"Written to {found.folder}")


def _table(cells: list[Any], varied: list[str]) -> Table:
    """One column for each label."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    for name in varied:
        table.add_column(Text(_short(name)), no_wrap=True)
    for title in ("falls", "95 %", "RMS error", "95 %"):
        table.add_column(title, justify="right", no_wrap=True)
    for frame in cells:
        table.add_row(*(Text(_text(frame.iloc[0][name])) for name in varied), *_figures(frame))
    return table


def _narrow(cells: list[Any], varied: list[str]) -> Table:
    """All labels of a cell in one column, each on a line, and intervals under what they belong to."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    table.add_column("cell", overflow="fold")
    for title in ("falls (95 %)", "RMS error (95 %)"):
        table.add_column(title, justify="right", no_wrap=True)
    for frame in cells:
        shown = [(name, _text(frame.iloc[0][name])) for name in varied]
        falls, rate, error, span = _figures(frame)
        label = "\n".join(f"{_short(name)} {text}" for name, text in shown if text)
        table.add_row(Text(label), f"{falls}\n({rate})", f"{error}\n({span})" if span else error)
        table.add_section()
    return table


def _figures(frame: Any) -> tuple[str, str, str, str]:
    """Falls, their rate's interval, mean error and its interval."""
    falls, unit = int(frame["fell"].sum()), metrics_spec_of(frame.iloc[0]["env"]).errors[0].unit
    rate, error = statistics.rate(falls, len(frame)), statistics.mean(frame[f"rmse_{unit}"])
    span = f"{error.low:.3g}..{error.high:.3g}" if math.isfinite(error.low) else ""
    return f"{falls}/{len(frame)}", f"{100 * rate.low:.0f}..{100 * rate.high:.0f}", f"{error.value:.3g} {unit}", span


def _varied(episodes: Any) -> list[str]:
    """Columns that tell the cells apart: names, then what varies beside them and is one value in each cell."""
    names = [name for name in ("env", "scenario", "controller") if episodes[name].nunique() > 1]
    if "scenario" in names and (episodes.groupby("scenario")["env"].nunique() == 1).all():
        names = [name for name in names if name != "env"]
    columns = [name for name in episodes if name.startswith(_PREFIXES)]
    by_name = episodes.groupby(["env", "scenario", "controller"])[columns].nunique(dropna=False)
    by_cell = episodes.groupby("cell")[columns].nunique(dropna=False)
    return [*names, *(name for name in columns if (by_name[name] > 1).any() and (by_cell[name] == 1).all())]


def _short(name: str) -> str:
    for prefix in _PREFIXES:
        name = name.removeprefix(prefix)
    return name


def _text(value: Any) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.4g}"
    return "" if value is None else str(value)
