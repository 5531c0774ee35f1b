"""`artde-gym doctor`: checks of the installation."""

from __future__ import annotations

import json
import time
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from artde_gym.cli.arguments import names
from artde_gym.cli.display import terminal
from artde_gym.doctor import CHECKS, Report, run_checks

LOOK = {"ok": ("ok", "green"), "missing": ("--", "yellow"), "failed": ("FAILED", "bold red")}


def doctor(
    checks: Annotated[
        str | None, typer.Option(help=f"Comma-separated names: {', '.join(CHECKS)}. Default: all.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Check your installation and suggest fixes.

    The exit code is 1 if a required check fails.
    """
    console = terminal()
    found: dict[str, Report] = {}
    start = time.monotonic()
    for name, report in run_checks(None if checks is None else names("--checks", checks)):
        found[name] = report
        if not as_json:
            _print(report, console)
    counts = {status: sum(line.status == status for one in found.values() for line in one.outcomes) for status in LOOK}
    if as_json:
        shown = {name: [line._asdict() for line in report.outcomes] for name, report in found.items()}
        print(json.dumps({"counts": counts, "checks": shown}, indent=2))
    else:
        console.print(f"\n{_verdict(counts)} ({time.monotonic() - start:.0f} s)")
    if counts["failed"]:
        raise typer.Exit(1)


def _print(report: Report, console: Console) -> None:
    console.print(Text(f"\n{report.title}", style="bold"))
    lines = Table.grid(padding=(0, 1))
    lines.add_column(width=8)
    lines.add_column()
    for line in report.outcomes:
        word, style = LOOK[line.status]
        lines.add_row(Text(f"  {word}", style=style), Text(f"{line.what}: {line.found}", overflow="fold"))
        if line.remedy:
            lines.add_row("", Text(f"-> {line.remedy}", overflow="fold"))
    console.print(lines)


def _verdict(counts: dict[str, int]) -> str:
    if counts["failed"]:
        return f"{counts['failed']} required checks failed; follow the suggestions below FAILED."
    optional = f" Optional and missing (--): {counts['missing']}." if counts["missing"] else ""
    return f"All required checks passed.{optional}"
