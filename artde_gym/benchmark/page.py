"""Output of a benchmark as JSON, and as a page."""

from __future__ import annotations

import dataclasses
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from artde_gym.benchmark.figure import Figure, Section
from artde_gym.evaluation.provenance import provenance

INTRODUCTION = """\
# Benchmark

Times hold for one machine; ratios (no unit) were measured in one run, all variants in turns, and carry over to others.
A missed target is marked. *Bare* is the engine alone, without the environment around it; a *closed loop* is
environment and controller. A control period of the biped and the arm is 1 ms, of the quadrotor 15 ms: 1000 us, or
15 000 us, over the time of a closed loop is how many times faster than real time it runs. This command writes the
page on your machine:

    {command}

{machine}
"""


def record(found: Mapping[str, Section]) -> dict[str, Any]:
    """Return all results with their provenance, for JSON."""
    sections = {name: _record(section) for name, section in found.items()}
    return {"provenance": provenance(), "machine": machine(), "sections": sections}


def page(found: Mapping[str, Section]) -> str:
    """Return all results as Markdown."""
    origin, here = provenance(), machine()
    versions = ", ".join(f"{name} {version}" for name, version in origin["packages"].items())
    about = f"{here['processor']}, {here['cores']} cores; Python {origin['python']}, {versions}; {origin['time']}."
    lines = [INTRODUCTION.format(command=origin["command"], machine=about)]
    for section in found.values():
        lines += [f"## {section.title}", "", section.text, ""]
        if section.skipped:
            lines += [f"*Left out: {section.skipped}*", ""]
        if section.figures:
            lines += ["| what | value | unit | target |", "|---|---:|---|---|"]
            lines += [f"| {_escaped(figure.what)} | {_row(figure)} |" for figure in section.figures]
            lines.append("")
    return "\n".join(lines)


def machine() -> dict[str, Any]:
    """Return processor and number of cores."""
    processor = platform.processor() or platform.machine() or "an unknown processor"
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                processor = line.partition(":")[2].strip()
                break
    except OSError:
        pass
    return {"processor": processor, "cores": os.cpu_count()}


def written(value: float) -> str:
    """Format a number with three significant digits, without an exponent."""
    if not abs(value) < 1000:
        return f"{value:,.0f}".replace(",", " ")
    digits = max(0, 2 - (len(f"{abs(value):.0f}") - 1)) if abs(value) >= 1 else 3
    return f"{value:.{digits}f}"


def _row(figure: Figure) -> str:
    target = figure.target + (" (missed)" if figure.met is False else "")
    return f"{written(figure.value)} | {'' if figure.unit == '1' else figure.unit} | {target}"


def _record(section: Section) -> dict[str, Any]:
    figures = [{**dataclasses.asdict(figure), "met": figure.met} for figure in section.figures]
    return {**dataclasses.asdict(section), "figures": figures}


def _escaped(text: str) -> str:
    return text.replace("|", "\\|")
