"""`artde-gym video`: video of an episode."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from artde_gym.cli.arguments import (
    WALK,
    Controllers,
    Disturbances,
    Engine,
    EnvKwargs,
    Gains,
    Seed,
    environment_kwargs,
    given_disturbances,
    json_object,
    names,
)
from artde_gym.cli.display import passing_bar, terminal


def video(
    out: Annotated[Path, typer.Option(help="File: .mp4 or .webm (with ffmpeg), .gif, .webp, or .png for one frame.")],
    controllers: Controllers = "artde",
    scenario: Annotated[str | None, typer.Option(help="Name; see `list`. Default: none, just --env.")] = None,
    env: Annotated[str | None, typer.Option(help=f"Environment id. Default: the scenario's, or {WALK}.")] = None,
    seed: Seed = 0,
    episode: Annotated[int, typer.Option(help="Index of the episode in `evaluate` with this seed.")] = 0,
    start: Annotated[float, typer.Option(help="Start of the shown part (s).")] = 0.0,
    end: Annotated[float, typer.Option(help="End of the shown part (s).", show_default=False)] = math.inf,
    speed: Annotated[float, typer.Option(help="Playback speed; 0.5 is half as fast as real time.")] = 1.0,
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 30.0,
    width: Annotated[int, typer.Option(help="Width of one controller's tile (pixels); its height is 3/4 of it.")] = 640,
    columns: Annotated[int | None, typer.Option(help="Tiles per row. Default: all.")] = None,
    engine: Engine = None,
    disturbances: Disturbances = None,
    env_kwargs: EnvKwargs = None,
    gains: Gains = None,
) -> None:
    """Make a video of one episode, controllers side by side.

    The episode is that of `evaluate` with the same seed.
    """
    from artde_gym.video import video as make_video  # only when asked for

    console = terminal()
    with passing_bar(console) as bar:
        shown = bar.add_task("")
        file = make_video(
            names("--controllers", controllers),
            out,
            env,
            scenario=scenario,
            seed=seed,
            episode=episode,
            start=start,
            end=end,
            speed=speed,
            fps=fps,
            width=width,
            columns=columns,
            disturbances=given_disturbances(disturbances),
            env_kwargs=environment_kwargs(env_kwargs, engine),
            gains=json_object("--gains", gains),
            on_progress=lambda time: bar.update(shown, description=f"{time:.1f} s simulated"),
        )
    console.print(f"Written to {file}", soft_wrap=True)
