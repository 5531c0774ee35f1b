"""`artde-gym benchmark`: speed and memory, as ratios measured in one run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from artde_gym.benchmark import SECTIONS, Section, measure
from artde_gym.cli.arguments import names
from artde_gym.cli.display import terminal
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.files import check_replaceable, write_atomically


def benchmark(
    sections: Annotated[
        str | None, typer.Option(help=f"Comma-separated names: {', '.join(SECTIONS)}. Default: all.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Do a tenth of the work, for a first impression.")] = False,
    json_file: Annotated[Path | None, typer.Option("--json", help="Also write all results to this file.")] = None,
    page_file: Annotated[
        Path | None, typer.Option("--page", help="Write a page like docs/benchmark.md to this file.")
    ] = None,
) -> None:
    """Measure speed and memory, as ratios; takes some minutes."""
    from artde_gym.benchmark.page import page, record  # heavy: only when the command runs

    for file in filter(None, (json_file, page_file)):
        check_replaceable(file)
    console = terminal()
    with console.status("") as status:
        found = measure(
            None if sections is None else names("--sections", sections),
            quick=quick,
            on_section=lambda name: status.update(Text(f"measuring: {name}")),
        )
    for section in found.values():
        _print(section, console)
    if json_file is not None:
        _write(json_file, json.dumps(record(found), indent=2) + "\n", console)
    if page_file is not None:
        _write(page_file, page(found), console)


def _print(section: Section, console: Console) -> None:
    from artde_gym.benchmark.page import written

    table = FittingTable("what", title=section.title, title_style="bold")
    table.add_column("value", justify="right")
    table.add_column("unit")
    table.add_column("target")
    for figure in section.figures:
        style = {True: "green", False: "red", None: ""}[figure.met]
        target = figure.target + (" missed" if figure.met is False else "")
        unit = "" if figure.unit == "1" else figure.unit
        table.add_row(figure.what, written(figure.value), unit, Text(target, style=style))
    if section.figures:
        console.print(table)
    if section.skipped:
        console.print(f"{section.title}: skipped: {section.skipped}\n")


def _write(file: Path, text: str, console: Console) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(file, lambda stream: stream.write(text.encode()))
    console.print(f"Written to {file}", soft_wrap=True)
