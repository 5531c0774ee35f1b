"""The part of a report that shows a training: its tests on held-out episodes, and which policy it kept."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from artde_gym.deprecation import current_configuration
from artde_gym.errors import StoreError
from artde_gym.evaluation.store import parse_table
from artde_gym.palette import styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import Cell, figure, paragraph, table

RECORD, CURVE = "run.json", "learning_curve.csv"
MILLION = 1e6

SHOWN: dict[str, tuple[str, str, float]] = {
    "score": ("Score (what is kept is chosen by it)", "score (1)", 1.0),
    "fell": ("Share of episodes with a fall", "falls (%)", 100.0),
    "rmse_m": ("RMS error in space", "RMS error (mm)", 1000.0),
    "duration_s": ("Time until the end or a fall", "time (s)", 1.0),
    "reward": ("Reward of an episode", "reward (1)", 1.0),
    "level": ("Difficulty of the training episodes", "level, 0 to 1 (1)", 1.0),
}
"""Column of the tests -> head of its chart, label of its axis, and factor to that unit; any other is shown as it is."""
SHARES = ("fell", "level")  # drawn from zero on


class Trained(NamedTuple):
    """A run of `train`: its record, its held-out tests in order, and how it names its policy."""

    record: Mapping[str, Any]
    tests: pd.DataFrame
    name: str

    @property
    def best(self) -> int:
        """Number of the test whose policy was kept."""
        return int(self.tests["score"].to_numpy().argmax())


def read_training(folder: Path) -> Trained:
    """A training's folder, finished or not.

    Raises:
        StoreError: if it cannot be read, or no test was finished.
    """
    try:
        record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
        wanted = record["configuration"] = current_configuration(record["configuration"])
        tests = parse_table((folder / CURVE).read_text(encoding="utf-8"), ())
        name = f"{wanted['config']['base']}+{wanted['algo']}"
        tests = tests.astype(float)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoreError(
            "training", str(folder), "a folder of `train` in which a held-out test was finished"
        ) from error
    if tests.empty:
        raise StoreError("training", str(folder), "a folder of `train` in which a held-out test was finished")
    return Trained(record, tests, name)


def answer(run: Trained) -> tuple[str, list[str]]:
    """What came of it."""
    tests, best = run.tests, run.best
    rows: list[dict[Any, Any]] = tests.to_dict(orient="records")
    first, kept, last = rows[0], rows[best], rows[-1]
    head = f"Best of {len(rows)} held-out tests: score {kept['score']:.4g} after {_millions(kept['steps'])} decisions."
    lines = [f"In the first test, after {_millions(first['steps'])}, the score was {first['score']:.4g}."]
    for column in ("fell", "rmse_m"):
        if column in tests:
            what, label, factor = SHOWN[column]
            unit = label[label.rindex("(") + 1 : -1]
            values = (f"{factor * row[column]:.3g} {unit}" for row in (first, kept))
            lines.append(f"{what}: {' in the first test, '.join(values)} in the best.")
    if best < len(rows) - 1:
        lines.append(
            f"Tests since that were no better: {len(rows) - 1 - best}, the last one {last['score']:.4g}; "
            "the policy of the best one is kept."
        )
    lines.append(
        "Scores are means over the same held-out episodes each time, and the best of several is a little flattered: "
        "compare the policy with its base by `evaluate`, on other seeds."
    )
    return head, lines


def parts(run: Trained) -> list[str]:
    """Charts of every number that the tests have, and all of them as a table."""
    tests, shown = run.tests, styles([run.name])
    look = shown[run.name]
    steps = tests["steps"].to_numpy(dtype=float) / MILLION
    across = Axis("decisions (millions)", 0.0, float(steps.max()) * 1.02)
    charts = {}
    for column in (name for name in tests if name != "steps"):
        head, label, factor = SHOWN.get(str(column), (str(column), f"{column} (1)", 1.0))
        values = factor * tests[column].to_numpy(dtype=float)
        chart = Chart(f"{head}, over the training", across, Axis.of(label, values, zero=column in SHARES))
        chart.line(steps, values, look, text=run.name, kind="path")
        for number, (step, value) in enumerate(zip(steps, values, strict=True)):
            if number == run.best:
                chart.event(step, step, "kept")
            chart.marker(float(step), float(value), look, f"{value:.4g} after {step:.3g} million decisions")
        charts[head] = chart.svg()
    columns = [str(column) for column in tests]
    rows = [
        [_cell(column, value) for column, value in zip(columns, row, strict=True)]
        for row in tests.itertuples(index=False, name=None)
    ]
    wanted = run.record["configuration"]
    mode = wanted["config"]["action_mode"]
    said = f"{run.name} in {wanted['env_id']}: action mode {mode}, seed {wanted['seed']}, at most "
    return [
        paragraph(f"{said}{_millions(wanted['steps'])} decisions."),
        figure("Held-out tests during the training; the vertical mark is the policy that was kept.", charts, shown),
        table("Every held-out test (SI units; shares from 0 to 1)", columns, rows),
    ]


def _cell(column: str, value: float) -> Cell:
    return Cell(f"{value:.0f}" if column == "steps" else f"{value:.4g}", float(value))


def _millions(steps: float) -> str:
    return f"{steps / MILLION:.3g} million"
