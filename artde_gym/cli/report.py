"""`artde-gym report`: HTML report of a results folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from artde_gym.cli.arguments import Pictures, Videos
from artde_gym.cli.display import terminal


def report(
    folder: Annotated[
        Path, typer.Argument(help="Results folder of `evaluate`, `reproduce`, `frontier`, `multiverse`, `train`.")
    ],
    pictures: Pictures = False,
    videos: Videos = False,
) -> None:
    """Write report.html into a results folder.

    The run may be unfinished; the file works offline.
    """
    show_report(folder, terminal(), pictures=pictures, videos=videos)


def show_report(folder: Path, console: Console, *, pictures: bool = False, videos: bool = False) -> None:
    """Write the report of a folder and print its path."""
    from artde_gym.report import write_report  # only when asked for

    with console.status("Report") as status:
        file = write_report(
            folder, pictures=pictures, videos=videos, on_progress=lambda text: status.update(Text(text))
        )
    console.print(f"Report: {file}", soft_wrap=True)
