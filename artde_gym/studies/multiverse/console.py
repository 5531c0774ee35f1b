"""Tables of a multiverse for a terminal."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.text import Text

from artde_gym.errors import MissingDependencyError
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.evaluation.statistics import Estimate
from artde_gym.studies.multiverse.claims import OUTCOMES
from artde_gym.studies.multiverse.deciding import Deciding
from artde_gym.studies.multiverse.result import Multiverse

TOLD = 0.01
"""Share of the worlds by which a tree, or a factor in it, must tell more than without it to be named.

A factor's share must be two standard errors, too: of fifteen without any effect, some go along by chance.
"""


def print_multiverse(found: Multiverse, console: Console) -> None:
    """Print survival, the verdict on each claim, which factors decide, and how to run the two ends of it again."""
    if found.episodes.empty:
        console.print("No episode was finished.")
        return
    console.print(_survival(found))
    if found.verdicts:
        console.print(_claims(found))
    for verdict in found.verdicts:
        if not verdict.decided:
            console.print(Text(f"No world says anything of {verdict.claim.text!r}."))
    _print_deciding(found, console)
    _print_ends(found, console)
    if not found.complete:
        console.print("Interrupted: the same command continues; finished episodes are kept.")
    console.print(f"Written to {found.folder}", soft_wrap=True)


def share_text(share: Estimate) -> str:
    """Write a share and its interval in percent."""
    return f"{100 * share.value:.0f} ({100 * share.low:.0f}..{100 * share.high:.0f})" if share.n else ""


def p_text(p_value: float) -> str:
    """Write the p value of a sign test."""
    if math.isnan(p_value):
        return ""
    return "< 0.001" if p_value < 0.001 else f"{p_value:.3f}"


def _survival(found: Multiverse) -> FittingTable:
    table = FittingTable("controller", "worlds", "without a fall, % (95 %)", pad_edge=False)
    for name in found.controllers:
        share = found.survival(name)
        table.add_row(Text(name), str(share.n), share_text(share))
    return table


def _claims(found: Multiverse) -> FittingTable:
    table = FittingTable("claim", pad_edge=False)
    for title in ("worlds", *(f"{outcome}, % (95 %)" for outcome in OUTCOMES), "p"):
        table.add_column(title, justify="right")
    for verdict in found.verdicts:
        shares = [share_text(verdict.share(outcome)) for outcome in OUTCOMES]
        table.add_row(Text(verdict.claim.text), str(verdict.decided), *shares, p_text(verdict.p_value))
    return table


def _print_deciding(found: Multiverse, console: Console) -> None:
    try:
        for what, decided in all_deciding(found):
            if decided is not None:
                console.print(f"{what}: {deciding_text(found, decided)}")
    except MissingDependencyError as error:
        console.print(f"Which factors decide is not told: {error}")


def all_deciding(found: Multiverse) -> Iterator[tuple[str, Deciding | None]]:
    """Yield what decides about the survival of each controller, then about each claim.

    Raises:
        MissingDependencyError: without scikit-learn.
    """
    for name in found.controllers:
        yield f"Survival of {name}", found.deciding_survival(name)
    for verdict in found.verdicts:
        yield verdict.claim.text, found.deciding(verdict)


def deciding_text(found: Multiverse, decided: Deciding) -> str:
    """Say which factors decide, the most important one first, and how well they tell."""
    clear = decided.importance > np.maximum(TOLD, 2 * decided.spread)
    names = [found.design.factors[i].name for i in decided.importance.argsort()[::-1] if clear[i]]
    right = f"a tree is right in {100 * decided.accuracy:.0f} %, always the commonest in {100 * decided.baseline:.0f} %"
    known = decided.accuracy > decided.baseline + TOLD and names
    return f"decided by {', then '.join(names)} ({right})" if known else f"no factor tells ({right})"


def _print_ends(found: Multiverse, console: Console) -> None:
    first = next((verdict for verdict in found.verdicts if verdict.most_favorable is not None), None)
    if first is None:
        return
    ends = {first.least_favorable: "least", first.most_favorable: "most"}  # one, where one world alone decides
    for world, what in reversed(ends.items()):
        if world is not None:
            console.print(f"World {world}, the {what} favorable to {first.claim.text!r}:")
            for line in found.command(world, first.claim.controllers):
                console.print(f"  {line}", soft_wrap=True)
    console.print("Those of the other claims are in the report.")
