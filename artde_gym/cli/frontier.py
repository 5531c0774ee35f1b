"""`artde-gym frontier`: robustness margin of each controller to one disturbance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
    given_disturbances,
    json_object,
    names,
    processes,
    vectorized_by,
)
from artde_gym.cli.display import Display, terminal
from artde_gym.cli.report import show_report
from artde_gym.errors import OptionError
from artde_gym.evaluation import canonical
from artde_gym.files import check_figure, write_atomically
from artde_gym.kit import ROBOTS

if TYPE_CHECKING:
    from artde_gym.studies.frontier.result import Frontier

_TESTS = [entry.frontier or kit.frontier for kit in ROBOTS.values() for entry in kit.environments]
VARIED = dict.fromkeys(path for test in _TESTS if test for path in test.ranges)


def frontier(
    vary: Annotated[str, typer.Option(help=f"Parameter to vary; with a default range: {', '.join(VARIED)}.")],
    controllers: Controllers = "tde,atde,artde",
    env: Annotated[str, typer.Option(help="Environment id.")] = "BipedPush-v0",
    low: Annotated[
        float | None, typer.Option(help="Smallest value, in the parameter's unit. Default: see `list frontiers`.")
    ] = None,
    high: Annotated[float | None, typer.Option(help="Largest value. Default: as for --low.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Step between levels. Default: as for --low.")] = None,
    harder: Annotated[str | None, typer.Option(help="Harder values: larger or smaller. Default: as for --low.")] = None,
    episodes: Annotated[int, typer.Option(help="Seeded episodes per controller and level.")] = 20,
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
    scenario: Annotated[
        str | None, typer.Option(help="In place of the standard test's, comma-separated; a folder inside for each.")
    ] = None,
    grid: Annotated[
        bool,
        typer.Option("--grid", help="Run every level, not only those of a bisection; find where half survive, too."),
    ] = False,
    figure: Annotated[Path | None, typer.Option(help="Another place for frontier.svg, one file a scenario.")] = None,
    allow_mixed: AllowMixed = False,
    report: Report = False,
) -> None:
    """Find how much of one disturbance each controller survives. Re-run the command to resume."""
    from artde_gym.report.frontier_page import survival_chart  # heavy: only when the command runs
    from artde_gym.studies import frontier as run_frontier
    from artde_gym.studies.frontier.console import print_frontier

    kwargs = environment_kwargs(env_kwargs, engine)
    if figure is not None:
        check_figure("--figure", figure)
    console, folder = terminal(), folder_of(out)
    scenarios = [None] if scenario is None else _checked(names("--scenario", scenario), env, vary, kwargs)
    for one in scenarios:
        with Display(console) as display:
            found = run_frontier(
                names("--controllers", controllers),
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
                out=folder if one is None else folder / one,
                disturbances=given_disturbances(disturbances),
                env_kwargs=kwargs,
                gains=json_object("--gains", gains),
                vectorized=vectorized_by(vectorized, backend),
                scenario=one,
                grid=grid,
                allow_mixed=allow_mixed,
                on_progress=lambda value, update, display=display: display(update, f"{vary} {value:g}"),
            )
        if len(scenarios) > 1:
            console.rule(str(one))
        print_frontier(found, console)
        for path in _figures(found, figure, one):
            write_atomically(
                path, lambda file, found=found: file.write(survival_chart(found, legend=True).file().encode())
            )
        if report and found.folder is not None:
            show_report(found.folder, console)
        if not found.complete:
            raise typer.Exit(130)


def _checked(scenarios: list[str], env: str, vary: str, kwargs: dict[str, Any]) -> list[str]:
    """Return the scenarios if each of them makes a test, so that a wrong one shows before the first one has run.

    Raises:
        OptionError, UnknownNameError: otherwise.
    """
    from artde_gym.studies.frontier.standard import standard_test

    if again := canonical.twice(scenarios):
        raise OptionError("scenario", again, "name each one once", "is given twice")
    for one in scenarios:
        standard_test(env, vary, kwargs, one)
    return scenarios


def _figures(found: Frontier, figure: Path | None, scenario: str | None) -> list[Path]:
    """Return where the figure of a frontier is written: nowhere before a level has been run."""
    if found.levels.empty:
        return []
    own = [] if found.folder is None else [found.folder / "frontier.svg"]
    return (
        own if figure is None else [*own, figure if scenario is None else figure.with_stem(f"{figure.stem}-{scenario}")]
    )
