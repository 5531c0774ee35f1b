"""What several commands ask for: their options, each declared once, and how their text is read."""

from __future__ import annotations

import atexit
import contextlib
import datetime
import json
import os
from pathlib import Path
from typing import Annotated, Any

import typer

from artde_gym.errors import OptionError
from artde_gym.sim.factory import ENGINES

WALK = "BipedWalk-Payload-v0"

Controllers = Annotated[str, typer.Option(help="Names, comma-separated; see `list`.")]
Seed = Annotated[int, typer.Option(help="Seed of everything.")]
Workers = Annotated[int | None, typer.Option(help="Processes. Default: all cores.")]
Out = Annotated[Path | None, typer.Option(help="Results folder. Default: runs/<date and time>.")]
Vectorized = Annotated[
    bool, typer.Option("--vectorized", help="Many episodes at once in a vector environment (of the biped, in MuJoCo).")
]
Backend = Annotated[str | None, typer.Option(hidden=True)]
"""Old form of `--vectorized`."""
Engine = Annotated[str | None, typer.Option(help=f"Physics engine: {' or '.join(ENGINES)}. Default: see `doctor`.")]
Disturbances = Annotated[str | None, typer.Option(help="JSON, in place of those that belong to what is run.")]
EnvKwargs = Annotated[str | None, typer.Option(help="JSON, arguments of the environment.")]
Gains = Annotated[str | None, typer.Option(help='JSON, e.g. {"artde": {"gamma_0": 200}}.')]
AllowMixed = Annotated[
    bool,
    typer.Option("--allow-mixed", help="Continue a folder that other software has begun; its provenance will say so."),
]
Report = Annotated[bool, typer.Option("--report", help="Write report.html, too.")]
Pictures = Annotated[
    bool, typer.Option("--pictures", help="Report with pictures of the motion, pushes and falls; runs them once more.")
]
Videos = Annotated[bool, typer.Option("--videos", help="Report with a video of each scenario (needs ffmpeg).")]


def renamed_option(old: str, new: str) -> None:
    """Tell which option has taken the place of one that was given."""
    typer.echo(f"{old} is deprecated; use {new}", err=True)


def vectorized_by(vectorized: bool, backend: str | None) -> bool:
    """Tell whether episodes run in a vector environment, also by the option's old form.

    Raises:
        OptionError: for a backend that never was.
    """
    if backend is None:
        return vectorized
    if backend not in ("single", "batch"):
        raise OptionError("--backend", backend, "'batch', 'single'; or rather --vectorized")
    renamed_option("--backend", "--vectorized")
    return backend == "batch"


def names(text: str) -> list[str]:
    """What a comma-separated list names."""
    return [name.strip() for name in text.split(",")]


def json_object(option: str, text: str | None) -> dict[str, Any]:
    """A JSON object; empty where there is no text.

    Raises:
        OptionError: not a JSON object.
    """
    if text is None:
        return {}
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise OptionError(option, text, f"a JSON object ({error})") from error
    if not isinstance(value, dict):
        raise OptionError(option, text, "a JSON object")
    return value


def optional_json(option: str, text: str | None) -> dict[str, Any] | None:
    """A JSON object; None where there is no text, since an empty object says something."""
    return None if text is None else json_object(option, text)


def environment_kwargs(text: str | None, engine: str | None) -> dict[str, Any]:
    """Arguments of the environment out of `--env-kwargs` and `--engine`."""
    kwargs = json_object("--env-kwargs", text)
    return kwargs if engine is None else {**kwargs, "engine": engine}


def processes(workers: int | None) -> int:
    """As many as were asked for, or all cores."""
    return (os.cpu_count() or 1) if workers is None else workers


def folder_of(out: Path | None) -> Path:
    """The results folder that was asked for, or a new one of this second, which is this process's own."""
    if out is not None:
        return out
    second = Path("runs") / datetime.datetime.now().strftime("%Y-%m-%d-%H%M%S")
    folder, number = second, 1
    while not _made(folder):
        number += 1
        folder = second.with_name(f"{second.name}-{number}")
    atexit.register(_remove_if_empty, folder.absolute())
    return folder


def _made(folder: Path) -> bool:
    """Make a folder, if it is not there yet."""
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        return False
    return True


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()
