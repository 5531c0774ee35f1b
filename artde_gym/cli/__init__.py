"""The `artde-gym` command, one module per subcommand; only this package may import controllers and baselines."""

from __future__ import annotations

import sys
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
from artde_gym.errors import ArtdeGymError
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
    try:
        app()
    except (ArtdeGymError, GainError, gym.error.Error, OSError) as error:  # OSError: a full disk, for example
        typer.echo(f"artde-gym: {error}", err=True)
        sys.exit(2)


@app.callback(invoke_without_command=True)
def version(
    show: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Simulate and evaluate time-delay control."""
    if show:
        print(f"artde-gym {__version__}")
        raise typer.Exit
