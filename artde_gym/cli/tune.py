"""`artde-gym tune`: tuning of gains with the same budget for every controller."""

from __future__ import annotations

from typing import Annotated

import typer

from artde_gym.cli.arguments import (
    WALK,
    AllowMixed,
    Backend,
    Controllers,
    Disturbances,
    Engine,
    EnvKwargs,
    Out,
    Seed,
    Vectorized,
    Workers,
    environment_kwargs,
    folder_of,
    given_disturbances,
    names,
    processes,
    vectorized_by,
)
from artde_gym.cli.display import Display, terminal


def tune(
    controllers: Controllers = "tde,atde,artde",
    scenario: Annotated[str | None, typer.Option(help="Name; see `list`. Default: none, just --env.")] = None,
    env: Annotated[str | None, typer.Option(help=f"Environment id. Default: the scenario's, or {WALK}.")] = None,
    trials: Annotated[int, typer.Option(help="Sets of gains per controller, including its preset.")] = 50,
    episodes: Annotated[int, typer.Option(help="Seeded training episodes per trial.")] = 4,
    held_out: Annotated[int, typer.Option(help="Unseen seeded episodes of the final comparison.")] = 20,
    metric: Annotated[
        str | None, typer.Option(help="Column of episodes.csv to minimize. Default: the environment's first error.")
    ] = None,
    seed: Seed = 0,
    workers: Workers = None,
    out: Out = None,
    vectorized: Vectorized = False,
    backend: Backend = None,
    engine: Engine = None,
    disturbances: Disturbances = None,
    env_kwargs: EnvKwargs = None,
    allow_mixed: AllowMixed = False,
) -> None:
    """Tune gains with the same budget for every controller. Re-run the command to resume."""
    from artde_gym.studies import tune as run_tuning  # heavy: only when the command runs
    from artde_gym.studies.tune.console import print_tuning

    kwargs = environment_kwargs(env_kwargs, engine)
    console = terminal()
    with Display(console) as display:
        found = run_tuning(
            names("--controllers", controllers),
            env,
            scenario=scenario,
            trials=trials,
            episodes=episodes,
            held_out=held_out,
            metric=metric,
            seed=seed,
            workers=processes(workers),
            out=folder_of(out),
            disturbances=given_disturbances(disturbances),
            env_kwargs=kwargs,
            vectorized=vectorized_by(vectorized, backend),
            allow_mixed=allow_mixed,
            on_progress=lambda what, update: display(update, what),
        )
    print_tuning(found, console)
    if not found.complete:
        raise typer.Exit(130)
