"""Verdicts over worlds: in how many a claim holds, and whether that is more than in how many it reverses."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import scipy  # its `stats`, half a second, is imported when it is first used: not by workers

from artde_gym.arrays import Array
from artde_gym.evaluation import statistics
from artde_gym.evaluation.statistics import Estimate
from artde_gym.studies.multiverse.claims import OUTCOMES, Outcome, WorldClaim, WorldTable


@dataclasses.dataclass(frozen=True)
class Verdict:
    """Verdict of all worlds on a claim.

    Attributes:
        worlds: numbers of those that have run.
        outcome: of each of them (`OUTCOMES`), NaN where the claim says nothing.
        margin: of each of them.
    """

    claim: WorldClaim
    worlds: list[int]
    outcome: Array
    margin: Array

    def count(self, outcome: Outcome) -> int:
        """Return the number of worlds with an outcome."""
        return int((self.outcome == OUTCOMES[outcome]).sum())

    @property
    def decided(self) -> int:
        """Number of worlds of which the claim says something."""
        return int(np.isfinite(self.outcome).sum())

    def share(self, outcome: Outcome) -> Estimate:
        """Return the share of these worlds with an outcome, with Wilson's interval."""
        return statistics.rate(self.count(outcome), self.decided)

    @property
    def p_value(self) -> float:
        """Of the sign test over worlds, two-sided, ties left out; NaN if there are ties alone."""
        holds, reverses = self.count("holds"), self.count("reverses")
        return float(scipy.stats.binomtest(holds, holds + reverses).pvalue) if holds + reverses else float("nan")

    @property
    def most_favorable(self) -> int | None:
        """Number of the world that bears the claim out by the largest margin; None where all are alike, or none is."""
        return self._extreme(1.0)

    @property
    def least_favorable(self) -> int | None:
        """Number of the world that speaks against the claim by the largest margin."""
        return self._extreme(-1.0)

    def row(self) -> dict[str, Any]:
        """Return it as a row of a table."""
        told: dict[str, Any] = {"claim": self.claim.text, "worlds": self.decided}
        for outcome in OUTCOMES:
            share = self.share(outcome)
            told |= {outcome: self.count(outcome), f"{outcome}_share": share.value}
            told |= {f"{outcome}_low": share.low, f"{outcome}_high": share.high}
        return {**told, "p": self.p_value, "most_favorable": self.most_favorable, "least": self.least_favorable}

    def _extreme(self, sign: float) -> int | None:
        ranked = [
            (sign * outcome, sign * margin, -number)
            for number, outcome, margin in zip(self.worlds, self.outcome.tolist(), self.margin.tolist(), strict=True)
            if np.isfinite(outcome)
        ]
        alike = len(ranked) > 1 and len({place[:2] for place in ranked}) == 1
        return -max(ranked)[2] if ranked and not alike else None


def verdict_of(claim: WorldClaim, found: WorldTable) -> Verdict:
    """Judge a claim in all worlds."""
    return Verdict(claim, found.worlds, *claim.judge(found))
