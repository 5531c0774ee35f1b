"""`artde-gym frontier`: how much of one disturbance each controller survives."""

from __future__ import annotations

from typing import Annotated

import typer

from artde_gym.cli.arguments import (
    AllowMixed,
    Backend,
    Controllers,
    Disturbances,
    Engine,
    EnvKwargs,
    Gains,
    Out,
    Report,
    Seed,
    Vectorized,
    Workers,
    environment_kwargs,
    folder_of,
    json_object,
    names,
    optional_json,
    processes,
    vectorized_by,
)
from artde_gym.cli.display import Display, terminal
from artde_gym.cli.report import show_report
from artde_gym.kit import ROBOTS
from artde_gym.studies import frontier as run_frontier
from artde_gym.studies.frontier.console import print_frontier

_TESTS = [entry.frontier or kit.frontier for kit in ROBOTS.values() for entry in kit.environments]
VARIED = dict.fromkeys(path for test in _TESTS if test for path in test.ranges)


def frontier(
    vary: Annotated[str, typer.Option(help=f"What to vary; with a range of its own: {', '.join(VARIED)}.")],
    controllers: Controllers = "tde,atde,artde",
    env: Annotated[str, typer.Option(help="Environment id.")] = "BipedPush-v0",
    low: Annotated[float | None, typer.Option(help="Smallest value, in the parameter's unit.")] = None,
    high: Annotated[float | None, typer.Option(help="Largest value.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Width of the bracket to be found.")] = None,
    harder: Annotated[str | None, typer.Option(help="larger or smaller: which values are harder.")] = None,
    episodes: Annotated[int, typer.Option(help="Seeded episodes of each controller at each level.")] = 20,
    seed: Seed = 0,
    workers: Workers = None,
    survival: Annotated[float, typer.Option(help="Share of episodes without a fall that counts as survived.")] = 0.9,
    out: Out = None,
    engine: Engine = None,
    disturbances: Disturbances = None,
    env_kwargs: EnvKwargs = None,
    gains: Gains = None,
    vectorized: Vectorized = False,
    backend: Backend = None,
    allow_mixed: AllowMixed = False,
    report: Report = False,
) -> None:
    """Find how much of one disturbance each controller survives; the same command continues an interrupted run."""
    kwargs = environment_kwargs(env_kwargs, engine)
    console = terminal()
    with Display(console) as display:
        found = run_frontier(
            names(controllers),
            env,
            vary,
            low=low,
            high=high,
            tolerance=tolerance,
            harder=harder,  # pyright: ignore[reportArgumentType]  # checked there
            survival=survival,
            episodes=episodes,
            seed=seed,
            workers=processes(workers),
            out=folder_of(out),
            disturbances=optional_json("--disturbances", disturbances),
            env_kwargs=kwargs,
            gains=json_object("--gains", gains),
            vectorized=vectorized_by(vectorized, backend),
            allow_mixed=allow_mixed,
            on_progress=lambda value, update: display(update, f"{vary} {value:g}"),
        )
    print_frontier(found, console)
    if report and found.folder is not None:
        show_report(found.folder, console)
    if not found.complete:
        raise typer.Exit(130)
