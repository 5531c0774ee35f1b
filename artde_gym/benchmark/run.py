"""Sections of the benchmark by name, and running them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from artde_gym.benchmark.figure import Section
from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.registration import resolved
from artde_gym.registry import pointed

SECTIONS: dict[str, str] = {
    "walk": "artde_gym.benchmark.walk:walking",
    "arm": "artde_gym.benchmark.arm:tracking",
    "flight": "artde_gym.benchmark.flight:flying",
    "fleet": "artde_gym.benchmark.flight:fleets",
    "biped-vector": "artde_gym.benchmark.biped_vector:biped_vector",
    "evaluation": "artde_gym.benchmark.evaluation:evaluating",
    "reset": "artde_gym.benchmark.reset:resetting",
    "controllers": "artde_gym.benchmark.calls:calling",
    "scaling": "artde_gym.benchmark.scaling:scaling",
    "memory": "artde_gym.benchmark.memory:growing",
    "peers": "artde_gym.benchmark.peers:peers",
    **pointed("artde_gym.benchmarks"),
}
"""Name -> "module:function", called as function(quick) to return a `Section`: our own, then those of the entry points
"artde_gym.benchmarks". They are strings, since a section may need packages that are not installed."""


def measure(
    names: Sequence[str] | None = None, *, quick: bool = False, on_section: Callable[[str], None] | None = None
) -> dict[str, Section]:
    """Measure some sections, or all, in this process, one after another.

    Args:
        names: keys of `SECTIONS`; None for all.
        quick: a tenth of the work: for a quick look, not for the page.
        on_section: called with each section's name before it begins.

    Raises:
        UnknownNameError: for an unknown section.
    """
    for name in names or ():
        if name not in SECTIONS:
            raise UnknownNameError("section", name, suggest_names(name, SECTIONS))
    found = {}
    for name in names or SECTIONS:
        if on_section is not None:
            on_section(name)
        found[name] = resolved(SECTIONS[name])(quick)
    return found
