"""`artde-gym sweep`: a grid or random sample of cases in seeded episodes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from artde_gym.cli.arguments import AllowMixed, Workers, processes
from artde_gym.cli.display import Display, terminal


def sweep(
    file: Annotated[Path, typer.Argument(help="YAML description of the sweep.")],
    out: Annotated[Path | None, typer.Option(help="Results folder. Default: runs/<name of the file>.")] = None,
    workers: Workers = None,
    executor: Annotated[
        str, typer.Option("--executor", "--engine", help="local: processes of this machine; ray: a Ray cluster.")
    ] = "local",
    address: Annotated[
        str | None,
        typer.Option(help="Address of a running Ray cluster; auto: this machine's. Default: start a new one."),
    ] = None,
    allow_mixed: AllowMixed = False,
) -> None:
    """Run a grid or a random sample of cases. Re-run the command to resume."""
    from artde_gym.studies import sweep as run_sweep  # heavy: only when the command runs
    from artde_gym.studies.sweep.console import print_sweep

    console = terminal()
    with Display(console) as display:
        found = run_sweep(
            file,
            out or Path("runs") / file.stem,
            workers=processes(workers),
            executor=executor,  # pyright: ignore[reportArgumentType]  # checked there
            address=address,
            allow_mixed=allow_mixed,
            on_progress=lambda what, update: display(update, what),
        )
    print_sweep(found, console)
    if not found.complete:
        raise typer.Exit(130)
