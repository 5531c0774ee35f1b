"""`artde-gym reproduce`: reproduction of the thesis' tables and claims."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from artde_gym.cli.arguments import AllowMixed, Pictures, Report, Seed, Videos, Workers, names, processes
from artde_gym.cli.display import Display, terminal
from artde_gym.cli.report import show_report
from artde_gym.errors import OptionError
from artde_gym.kit import ROBOTS
from artde_gym.sim.factory import ENGINES, resolve_engine

ROBOT_NAMES = [name for name, kit in ROBOTS.items() if kit.reproduced[0]]


def reproduce(
    robot: Annotated[str, typer.Option(help=f"{', '.join(ROBOT_NAMES)}, or all.")] = "all",
    engine: Annotated[
        str | None, typer.Option(help=f"Physics engine: {', '.join(ENGINES)}, or both. Default: the fastest.")
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(help="Seeded episodes per controller and scenario. Default: 10, or 4 where walks run singly."),
    ] = None,
    scenario: Annotated[str | None, typer.Option(help="Comma-separated names. Default: all of the robot.")] = None,
    controllers: Annotated[str | None, typer.Option(help="Comma-separated names. Default: the robot's.")] = None,
    ablation: Annotated[
        bool, typer.Option(help="Also run TDE at ARTDE's mean gain; in an existing folder, only this is new.")
    ] = False,
    curves: Annotated[
        bool, typer.Option("--curves", help="Run the grids of `frontier` by which some claims are judged, too.")
    ] = False,
    seed: Seed = 0,
    workers: Workers = None,
    out: Annotated[
        Path, typer.Option(help="Results folder, with one subfolder per engine and robot; re-run to resume.")
    ] = Path("runs/reproduce"),
    allow_mixed: AllowMixed = False,
    report: Report = False,
    pictures: Pictures = False,
    videos: Videos = False,
) -> None:
    """Run the thesis' scenarios and judge each of its claims.

    The thesis' tables are printed beside those measured. Re-run the command to resume.
    """
    from artde_gym.evaluation.console import print_claims, print_result  # heavy: only when the command runs
    from artde_gym.studies import reproduce as run_reproduction
    from artde_gym.studies.frontier.console import print_frontier
    from artde_gym.studies.reproduce.claims import confirm
    from artde_gym.studies.reproduce.reproduction import folder_name, kit_of, reproducible, scenarios_of

    robots = reproducible() if robot == "all" else [kit_of(robot).name]
    engines = list(ENGINES) if engine == "both" else [None if engine is None else resolve_engine(engine)]
    named = None if scenario is None else names("--scenario", scenario)
    shares = {name: chosen for name in robots if (chosen := scenarios_of(name, named))}
    for one in named or ():
        if not any(one in chosen for chosen in shares.values()):
            raise OptionError("scenario", one, f"a scenario of the robot {robot!r}")
    console = terminal()
    for name, chosen in shares.items():
        verdicts: dict[str, Any] = {}
        for one in engines:
            with Display(console) as display:
                found = run_reproduction(
                    name,
                    out / (one or "fastest") / folder_name(name),
                    scenarios=chosen,
                    controllers=None if controllers is None else names("--controllers", controllers),
                    ablation=ablation,
                    curves=curves,
                    episodes=episodes,
                    seed=seed,
                    workers=processes(workers),
                    engine=one,
                    allow_mixed=allow_mixed,
                    on_progress=lambda what, update, display=display: display(update, what),
                )
            if len(engines) > 1:
                console.rule(f"{name} in {one}")
            print_result(found.result, console)
            print_claims(found.claims, console)
            for curve in found.curves.values():
                print_frontier(curve, console)
            verdicts[str(one)] = found.claims
            if (report or pictures or videos) and found.result.folder is not None:
                show_report(found.result.folder, console, pictures=pictures, videos=videos)
            if not found.result.complete:
                raise typer.Exit(130)
        if len(engines) > 1:
            both = confirm(verdicts)
            both.to_csv(out / f"claims-{folder_name(name)}.csv", index=False)
            print_claims(both, console)
