"""Tuned gains beside their presets, as tables for a terminal."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

from rich.console import Console
from rich.text import Text

from artde_gym.evaluation import statistics
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.studies.tune.tuning import TUNED, Tuning


def print_tuning(found: Tuning, console: Console) -> None:
    """Print each controller's error with its preset and with the tuned gains on held-out seeds, then the gains."""
    console.print()
    if found.held_out is None or found.held_out.episodes.empty:
        console.print("Interrupted before the comparison.")
    else:
        console.print(Text("Tuned gains beside the presets, on held-out seeds", style="bold"))
        trials = found.trials.groupby("controller").size().max()
        note = (
            f"the best of {trials} trials each; mean {found.metric} of the episodes without a fall, with 95 % intervals"
        )
        console.print(Text(note, style="dim"))
        console.print(_comparison(found, found.held_out.scenarios[0]))
        console.print(_gains(found))
    if not found.complete:
        console.print("Interrupted; finished trials are kept. Re-run the command to resume.")
    if found.folder is not None:
        console.print(f"Written to {found.folder}")


def _comparison(found: Tuning, scenario: str) -> FittingTable:
    result = found.held_out
    assert result is not None
    table = FittingTable(
        "controller", "preset", "falls (preset)", "tuned", "falls (tuned)", "change (%)", pad_edge=False
    )
    for name in found.best:
        cells: list[str] = []
        for label in (name, name + TUNED):
            falls, rate = result.falls(scenario, label)
            stood = result.values(scenario, label, "fell") == 0
            error = result.values(scenario, label, found.metric)[stood]
            cells += [_estimate(statistics.mean(error)), f"{falls}/{rate.n}"]
        tuned, preset = result.pairs(scenario, name + TUNED, name, found.metric)
        change = statistics.improvement(tuned, preset)
        span = f" ({0 - change.high:+.0f}..{0 - change.low:+.0f})" if math.isfinite(change.low) else ""
        table.add_row(name, *cells, f"{0 - change.value:+.0f}{span}" if change.n else "-")
    return table


def _estimate(value: statistics.Estimate) -> str:
    if not value.n:
        return "-"
    span = f" ({value.low:.3g}..{value.high:.3g})" if math.isfinite(value.low) else ""
    return f"{value.value:.3g}{span}"


def _gains(found: Tuning) -> FittingTable:
    table = FittingTable("controller", "tuned gains (preset)", pad_edge=False)
    first = {row["controller"]: row for row in found.trials.to_dict(orient="records") if row["trial"] == 0}
    for name, gains in found.best.items():
        preset: Mapping[str, float] = json.loads(first[name]["gains"])
        table.add_row(name, ", ".join(f"{gain} {value:g} ({preset[gain]:g})" for gain, value in gains.items()))
    return table
