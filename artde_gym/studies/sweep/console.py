"""What a sweep has found as a table for a terminal, one row a cell."""

from __future__ import annotations

import math
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from artde_gym.evaluation import statistics
from artde_gym.evaluation.environments import tracking_of
from artde_gym.studies.sweep.execution import Sweep

MOST = 50  # rows
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
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    for name in varied:
        table.add_column(_short(name), overflow="fold")
    for title in ("falls", "95 %", "RMS error", "95 %"):
        table.add_column(title, justify="right", no_wrap=True)
    cells = [frame for _, frame in episodes.groupby([*varied, "cell"], dropna=False)]
    for frame in cells[:MOST]:
        first, falls = frame.iloc[0], int(frame["fell"].sum())
        unit = tracking_of(first["env"]).errors[0].unit
        rate, error = statistics.rate(falls, len(frame)), statistics.mean(frame[f"rmse_{unit}"])
        spans = f"{100 * rate.low:.0f}..{100 * rate.high:.0f}", f"{error.low:.3g}..{error.high:.3g}"
        span = spans[1] if math.isfinite(error.low) else ""
        table.add_row(
            *(_text(first[name]) for name in varied),
            f"{falls}/{len(frame)}",
            spans[0],
            f"{error.value:.3g} {unit}",
            span,
        )
    console.print(table)
    if len(cells) > MOST:
        console.print(f"... and {len(cells) - MOST} more cells: artde_gym.evaluation.read_sweep({str(found.folder)!r})")
    if not found.complete:
        console.print("Interrupted: the same command continues; finished episodes are kept.")
    console.print(f"Written to {found.folder}")


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
