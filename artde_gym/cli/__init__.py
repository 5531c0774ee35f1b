"""The `artde-gym` command, one module per subcommand; only this package may import controllers and baselines."""

from __future__ import annotations

import io
import os
import sys
import warnings
from typing import Annotated

import gymnasium as gym
import typer

from artde_gym import __version__
from artde_gym.cli import (
    benchmark,
    design,
    doctor,
    evaluate,
    frontier,
    listing,
    multiverse,
    play,
    replay,
    report,
    reproduce,
    sweep,
    train,
    tune,
    video,
)
from artde_gym.errors import ArtdeGymError, StoreError
from controllers import GainError

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Simulate and evaluate time-delay control.",
)
app.command()(evaluate.evaluate)
app.command()(frontier.frontier)
app.command()(tune.tune)
app.command()(sweep.sweep)
app.command()(multiverse.multiverse)
app.command()(reproduce.reproduce)
app.command()(train.train)
app.command()(report.report)
app.command()(replay.replay)
app.command()(video.video)
app.command()(play.play)
app.command("list")(listing.list_everything)
app.command()(benchmark.benchmark)
app.command()(doctor.doctor)
app.command()(design.design)


def main() -> None:
    """Run the command; user errors are reported in one line on standard error with exit code 2."""
    _print_any_text()
    _tell_warnings()
    try:
        _check_current_folder()
        app()
    except (ArtdeGymError, GainError, gym.error.Error, OSError) as error:  # OSError: a full disk, for example
        typer.echo(f"artde-gym: {error}", err=True)
        sys.exit(2)


def _print_any_text() -> None:
    """Let characters that the terminal, or a pipe, cannot encode appear as escapes: names of files may have any."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


def _check_current_folder() -> None:
    """See that the current folder exists: workers, which begin there, would fail in many ways.

    Raises:
        StoreError: if it does not.
    """
    try:
        os.getcwd()
    except OSError as error:
        folder = os.environ.get("PWD", os.curdir)
        raise StoreError("current folder", folder, "change to another one", "does not exist anymore") from error


def _tell_warnings() -> None:
    """Print each warning once, as a line in words.

    Workers build what this process has built before, and print none of those that this tells.
    """
    os.environ.setdefault("PYTHONWARNINGS", "ignore::UserWarning")
    told: set[str] = set()

    def show(message: Warning | str, *_: object, **_others: object) -> None:
        text = " ".join(str(message).split())
        if text not in told:
            told.add(text)
            typer.echo(f"artde-gym: warning: {text}", err=True)

    warnings.showwarning = show


@app.callback(invoke_without_command=True)
def version(
    show: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Simulate and evaluate time-delay control."""
    if show:
        print(f"artde-gym {__version__}")
        raise typer.Exit
