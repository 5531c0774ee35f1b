"""`artde-gym evaluate`: comparison of controllers on the same seeded episodes."""

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
    Gains,
    Out,
    Pictures,
    Report,
    Seed,
    Vectorized,
    Videos,
    Workers,
    environment_kwargs,
    folder_of,
    given_disturbances,
    json_object,
    names,
    processes,
    renamed_option,
    vectorized_by,
)
from artde_gym.cli.display import Display, terminal
from artde_gym.cli.report import show_report
from artde_gym.evaluation.environments import main_scenarios
from artde_gym.scenarios import CUSTOM

RECORD_HZ = 100.0


def evaluate(
    controllers: Controllers = "tde,atde,artde",
    scenario: Annotated[
        str | None,
        typer.Option(
            help="Comma-separated names; see `list`. Default: the environment's main ones. custom: the environment as "
            "it is, the default with --disturbances."
        ),
    ] = None,
    env: Annotated[str | None, typer.Option(help=f"Environment id. Default: the scenarios', or {WALK}.")] = None,
    episodes: Annotated[int, typer.Option(help="Seeded episodes per controller and scenario.")] = 3,
    seed: Seed = 0,
    workers: Workers = None,
    out: Out = None,
    vectorized: Vectorized = False,
    backend: Backend = None,
    engine: Engine = None,
    disturbances: Disturbances = None,
    env_kwargs: EnvKwargs = None,
    gains: Gains = None,
    record_episodes: Annotated[
        int | None, typer.Option(help="Number of episodes whose signals are stored. Default: all; none if vectorized.")
    ] = None,
    traced: Annotated[int | None, typer.Option(hidden=True)] = None,
    record_hz: Annotated[float, typer.Option(help="Rate of stored signals (Hz); inf for every step.")] = RECORD_HZ,
    trace_hz: Annotated[float | None, typer.Option(hidden=True)] = None,
    allow_mixed: AllowMixed = False,
    report: Report = False,
    pictures: Pictures = False,
    videos: Videos = False,
) -> None:
    """Compare controllers on the same seeded episodes.

    The tables show the thesis' numbers beside those measured.
    """
    from artde_gym.evaluation import evaluate as run_evaluation  # heavy: only when the command runs
    from artde_gym.evaluation.console import print_result

    vectorized = vectorized_by(vectorized, backend)
    record_episodes = renamed_option("--traced", traced, "--record-episodes", record_episodes, None)
    record_hz = renamed_option("--trace-hz", trace_hz, "--record-hz", record_hz, RECORD_HZ)
    if scenario is None:
        env = WALK if env is None else env
        chosen = (main_scenarios(env) if disturbances is None else ()) or None
    else:
        chosen = None if scenario == CUSTOM else names("--scenario", scenario)
    kwargs = environment_kwargs(env_kwargs, engine)
    folder = folder_of(out)
    console = terminal()
    with Display(console) as display:
        result = run_evaluation(
            names("--controllers", controllers),
            env,
            scenario=chosen,
            episodes=episodes,
            seed=seed,
            workers=processes(workers),
            out=folder,
            disturbances=given_disturbances(disturbances),
            env_kwargs=kwargs,
            gains=json_object("--gains", gains),
            vectorized=vectorized,
            record_episodes=record_episodes,
            record_hz=record_hz,
            allow_mixed=allow_mixed,
            on_progress=display,
        )
    print_result(result, console)
    if report or pictures or videos:
        show_report(folder, console, pictures=pictures, videos=videos)
    if not result.complete:
        raise typer.Exit(130)
