"""`artde-gym multiverse`: claims over plausible worlds."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from artde_gym.cli.arguments import AllowMixed, Engine, Report, Workers, processes
from artde_gym.cli.display import Display, terminal
from artde_gym.cli.report import show_report
from artde_gym.files import check_figure, write_atomically


def multiverse(
    design: Annotated[str, typer.Option(help="A robot's standard design (arm, ojas, q450), or a YAML file.")],
    worlds: Annotated[int | None, typer.Option(help="Number of worlds. Default: the design's.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the worlds. Default: the design's.")] = None,
    out: Annotated[Path | None, typer.Option(help="Results folder. Default: runs/multiverse-<design>.")] = None,
    workers: Workers = None,
    vectorized: Annotated[
        bool | None, typer.Option(help="Worlds side by side, or one by one. Default: the design's.")
    ] = None,
    engine: Engine = None,
    allow_mixed: AllowMixed = False,
    report: Report = False,
    figure: Annotated[
        Path | None, typer.Option(help="SVG file for the shares of the worlds in which each claim holds.")
    ] = None,
) -> None:
    """Judge claims over plausible worlds.

    All controllers meet the same worlds. Re-run the command to resume.
    """
    from artde_gym.report.multiverse_page import claims_chart
    from artde_gym.studies import multiverse as run_multiverse  # heavy: only when the command runs
    from artde_gym.studies.multiverse.console import print_multiverse

    console = terminal()
    if figure is not None:
        check_figure("--figure", figure)
    with Display(console) as display:
        found = run_multiverse(
            design,
            out or Path("runs") / f"multiverse-{Path(design).stem}",
            worlds=worlds,
            seed=seed,
            vectorized=vectorized,
            engine=engine,
            workers=processes(workers),
            allow_mixed=allow_mixed,
            on_progress=lambda what, update: display(update, what),
        )
    print_multiverse(found, console)
    if figure is not None and any(verdict.decided for verdict in found.verdicts):
        drawing = claims_chart(found.verdicts).file().encode()
        write_atomically(figure, lambda file: file.write(drawing))
    if report:
        show_report(found.folder, console)
    if not found.complete:
        raise typer.Exit(130)
