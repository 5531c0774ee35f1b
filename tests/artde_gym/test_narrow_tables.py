"""Tables cut nothing in a narrow terminal: every word of the widest form is there, unbroken."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from typer.testing import CliRunner

import artde_gym
from artde_gym.benchmark import Section
from artde_gym.benchmark.figure import Figure
from artde_gym.cli import app
from artde_gym.cli.benchmark import _print as print_section
from artde_gym.cli.catalog import TOPICS
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.console import print_result
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.studies import frontier, tune
from artde_gym.studies.frontier.console import print_frontier
from artde_gym.studies.tune.console import print_tuning

NARROW = (60, 80)
RULES = re.compile("[─…]")
FLYER: dict[str, Any] = {"disturbances": {}, "env_kwargs": {"duration": 0.2}, "vectorized": True}
ENV = "QuadInfinity-Payload-v0"


def check(show: Callable[[Console], None]) -> None:
    """Compare the words at narrow widths with those at a width that has room for everything."""
    shown = {}
    for width in (*NARROW, 1000):
        console = Console(width=width, markup=False, emoji=False, color_system=None)
        with console.capture() as printed:
            show(console)
        shown[width] = printed.get()
        assert max(map(len, shown[width].splitlines())) <= width
    for width in NARROW:
        assert "…" not in shown[width]
        assert set(RULES.sub(" ", shown[1000]).split()) <= set(RULES.sub(" ", shown[width]).split())


def test_tuned_gains_and_their_intervals() -> None:
    found = tune(["pid", "artde-robust"], ENV, trials=2, episodes=2, held_out=3, **FLYER)
    check(lambda console: print_tuning(found, console))


def test_a_frontier_with_its_half_points() -> None:
    names = ["pid", "tde", "artde", "artde-robust"]
    found = frontier(names, ENV, vary="payload.mass", low=0.1, high=0.3, tolerance=0.1, episodes=2, grid=True, **FLYER)
    check(lambda console: print_frontier(found, console))


@pytest.mark.parametrize("controllers", [["artde", "tde", "pid"], ["artde", "tde", "pid", "atde", "asmc", "geometric"]])
def test_metrics_of_few_and_of_many_controllers(controllers: list[str]) -> None:
    found = evaluate(controllers, ENV, episodes=2, **FLYER)
    check(lambda console: print_result(found, console))


def test_figures_of_a_benchmark() -> None:
    figures = [Figure("A very long name of something that was measured: decisions", 12345.678, "1/s", most=0.2)]
    check(lambda console: print_section(Section("Speed of everything", "all of it", tuple(figures)), console))


@pytest.mark.parametrize(
    "line", [*(["list", topic] for topic in TOPICS), ["design"], ["design", "--law", "artde-switched"]]
)
def test_commands_that_compute_nothing(line: list[str]) -> None:
    def show(console: Console) -> None:
        answer = CliRunner().invoke(app, line, env={"COLUMNS": str(console.width)})
        assert answer.exit_code == 0, answer.output
        console.print(answer.output, soft_wrap=True)

    check(show)


def test_parts_of_a_table_repeat_its_keys_and_a_table_with_room_is_whole() -> None:
    table = FittingTable("key", "", *(f"column{i}" for i in range(20)), keys=2)
    table.add_row("a", "ours", *map(str, range(20)))
    check(lambda console: console.print(table))
    console = Console(width=60)
    with console.capture() as printed:
        console.print(table)
    lines = printed.get().splitlines()
    heads = [line for line in lines if "column" in line]
    assert len(heads) > 1
    assert all(line.split()[0] == "key" for line in heads)
    assert sum("ours" in line for line in lines) == len(heads)


def test_no_other_table_is_printed() -> None:
    own = {"evaluation/fitting_table.py", "studies/sweep/console.py", "cli/doctor.py"}
    root = Path(artde_gym.__file__).parent
    found = {str(file.relative_to(root)) for file in root.rglob("*.py") if "rich.table import" in file.read_text()}
    assert found == own
