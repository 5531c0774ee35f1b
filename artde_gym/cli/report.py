"""`artde-gym report`: a results folder to look at."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console


def report(
    folder: Annotated[Path, typer.Argument(help="Results folder of `evaluate`, `reproduce` or `frontier`.")],
) -> None:
    """Write report.html into a results folder, finished or not: one file that needs no network."""
    show_report(folder, Console())


def show_report(folder: Path, console: Console) -> None:
    """Write the report of a folder and say where it is."""
    from artde_gym.evaluation.report import write_report  # only when asked for

    console.print(f"Report: {write_report(folder)}", soft_wrap=True)
