"""Options shared by several commands, and the parsing of their values."""

from __future__ import annotations

import atexit
import contextlib
import datetime
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from artde_gym.arguments import wrap_read_errors
from artde_gym.errors import OptionError
from artde_gym.files import making_folder
from artde_gym.sim.factory import ENGINES

T = TypeVar("T")

WALK = "BipedWalk-Payload-v0"

Controllers = Annotated[str, typer.Option(help="Comma-separated names; see `list`.")]
Seed = Annotated[int, typer.Option(help="Base random seed.")]
Workers = Annotated[int | None, typer.Option(help="Number of processes. Default: all cores.")]
Out = Annotated[Path | None, typer.Option(help="Results folder. Default: runs/<date and time>.")]
Vectorized = Annotated[
    bool,
    typer.Option("--vectorized", help="Run many episodes at once in a vector environment (the biped's in MuJoCo)."),
]
Backend = Annotated[str | None, typer.Option(hidden=True)]
"""Deprecated form of `--vectorized`."""
Engine = Annotated[str | None, typer.Option(help=f"Physics engine: {' or '.join(ENGINES)}. Default: see `doctor`.")]
Disturbances = Annotated[str | None, typer.Option(help="JSON, or a .json file; override the scenario's disturbances.")]
EnvKwargs = Annotated[str | None, typer.Option(help="JSON; arguments of the environment.")]
Gains = Annotated[str | None, typer.Option(help='JSON; gains by controller, e.g. {"artde": {"gamma_0": 200}}.')]
AllowMixed = Annotated[
    bool,
    typer.Option(
        "--allow-mixed", help="Resume a folder started with other software versions; its provenance records this."
    ),
]
Report = Annotated[bool, typer.Option("--report", help="Also write report.html.")]
Pictures = Annotated[
    bool,
    typer.Option(
        "--pictures", help="Add pictures of the motion, pushes and falls to the report; runs these episodes again."
    ),
]
Videos = Annotated[bool, typer.Option("--videos", help="Add a video of each scenario to the report (needs ffmpeg).")]


def renamed_option(old: str, value: T | None, new: str, given: T, default: T) -> T:
    """Return the value of an option, `value` under its deprecated name `old`, else the one `given` under the new name.

    Raises:
        OptionError: if it is given under both.
    """
    if value is None:
        return given
    if given != default:
        raise OptionError(old, value, f"only {new}, its new name")
    typer.echo(f"{old} is deprecated; use {new}", err=True)
    return value


def vectorized_by(vectorized: bool, backend: str | None) -> bool:
    """Return True if episodes run in a vector environment, according to `--vectorized` or the deprecated `--backend`.

    Raises:
        OptionError: for an unknown backend.
    """
    if backend not in (None, "single", "batch"):
        raise OptionError("--backend", backend, "'batch', 'single'; better use --vectorized")
    if backend is None:
        return vectorized
    return renamed_option("--backend", backend, "--vectorized", "batch" if vectorized else "", "") == "batch"


def names(option: str, text: str) -> list[str]:
    """Split a comma-separated list of names.

    Raises:
        OptionError: if one of them is empty.
    """
    found = [name.strip() for name in text.split(",")]
    if not all(found):
        raise OptionError(option, text, "names with a comma between two of them")
    return found


def json_object(option: str, text: str | None) -> dict[str, Any]:
    """Parse a JSON object; empty without text.

    Raises:
        OptionError: if the text is not a JSON object.
    """
    if text is None:
        return {}
    try:
        value = json.loads(text, object_pairs_hook=lambda pairs: _each_once(option, pairs))
    except OptionError:
        raise
    except (ValueError, RecursionError) as error:
        raise OptionError(option, text, f"a JSON object ({error})") from error
    if not isinstance(value, dict):
        raise OptionError(option, text, "a JSON object")
    return value


def _each_once(option: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the pairs of a JSON object; a key given twice would lose a value."""
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        again = next(key for key in keys if keys.count(key) > 1)
        raise OptionError(f"key of {option}", again, "leave one of them", "is given twice")
    return found


def joined(option: str, inside: Mapping[str, Any], beside: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments in an option's JSON object and those of options of their own.

    Raises:
        OptionError: for an argument that is given in both ways with different values.
    """
    for name, value in beside.items():
        if name in inside and inside[name] != value:
            problem = f"contradicts the {value!r} of --{name.replace('_', '-')}"
            raise OptionError(f"{name} in {option}", inside[name], "leave one of them out", problem)
    return {**inside, **beside}


def optional_json(option: str, text: str | None) -> dict[str, Any] | None:
    """Parse a JSON object; None without text, since an empty object has a meaning."""
    return None if text is None else json_object(option, text)


def given_disturbances(text: str | None) -> dict[str, Any] | None:
    """Return the disturbances of `--disturbances`, JSON or the name of a file of it; None without any.

    Raises:
        OptionError: if it is no JSON object, or the file cannot be read.
    """
    if text is not None and text.endswith(".json"):
        with wrap_read_errors("--disturbances", Path(text), "JSON, or a .json file of it", OptionError):
            text = Path(text).read_text(encoding="utf-8-sig")  # editors on Windows begin a file with a mark
    return optional_json("--disturbances", text)


def environment_kwargs(text: str | None, engine: str | None) -> dict[str, Any]:
    """Return the environment's arguments from `--env-kwargs` and `--engine`, before anything is opened or written.

    Raises:
        OptionError: if the text is not a JSON object, names another engine than `--engine`, or the engine is not
            installed (MissingDependencyError).
    """
    kwargs = json_object("--env-kwargs", text)
    if engine is not None and engine in ENGINES:
        ENGINES[engine].require()
    return joined("--env-kwargs", kwargs, {} if engine is None else {"engine": engine})


def processes(workers: int | None) -> int:
    """Return the given number of processes, or one per core."""
    return (os.cpu_count() or 1) if workers is None else workers


def folder_of(out: Path | None) -> Path:
    """Return the given results folder, or create a new one, named by the time, for this process alone.

    Raises:
        StoreError: if none can be created here.
    """
    if out is not None:
        return out
    second = Path("runs") / datetime.datetime.now().strftime("%Y-%m-%d-%H%M%S")
    folder, number = second, 1
    with making_folder(second):
        second.parent.mkdir(exist_ok=True)
        while not _made(folder):
            number += 1
            folder = second.with_name(f"{second.name}-{number}")
    atexit.register(_remove_if_empty, folder.absolute())
    return folder


def _made(folder: Path) -> bool:
    """Make a folder; return False if it exists."""
    try:
        folder.mkdir()
    except FileExistsError:
        return False
    return True


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()
