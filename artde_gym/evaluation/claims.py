"""The thesis' claims as data, each with a verdict from seeded episodes.

A verdict is *holds* or *does not hold* where the 95 % intervals say so, *undecided* where they do not, and *not
measured* where an episode or a controller is missing. Claims of single runs ("TDE falls, ARTDE does not") are read as
claims of what happens more often than not. A claim that is compared over several joints must hold on each of them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
import pandas as pd

from artde_gym.evaluation import statistics, thesis
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.statistics import Estimate

Outcome = Literal["holds", "does not hold", "undecided", "not measured"]


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What the episodes say of a claim: the outcome, and what was measured, in words with its interval."""

    outcome: Outcome
    measured: str


@dataclasses.dataclass(frozen=True)
class Claim:
    """A statement that episodes can decide.

    Attributes:
        scenario: in which it is made.
        text: the statement.
        thesis: the thesis' own number or observation; "ours" for a question that we add.
        judge: episodes -> verdict.
    """

    scenario: str
    text: str
    thesis: str
    judge: Callable[[Result], Verdict]


def improves(scenario: str, rival: str, metric: str, least: float) -> Callable[[Result], Verdict]:
    """On every joint the metric's mean is lower for ARTDE than for `rival` by at least `least` percent."""

    def judge(result: Result) -> Verdict:
        estimates = {}
        for joint in thesis.JOINTS:
            ours, theirs = _pairs(result, scenario, "artde", rival, f"{metric}_{joint}")
            estimates[joint] = statistics.improvement(ours, theirs)
        joint, worst = min(estimates.items(), key=lambda item: np.nan_to_num(item[1].value, nan=np.inf))
        if worst.n == 0:
            return _nothing(result, scenario, ("artde", rival))
        measured = f"least: {joint} {_interval(worst)} %, {worst.n} pairs"
        if all(estimate.low >= least for estimate in estimates.values()):
            return Verdict("holds", measured)
        if any(estimate.high < least for estimate in estimates.values()):
            return Verdict("does not hold", measured)
        return Verdict("undecided", measured)

    return judge


def falls(scenario: str, expected: dict[str, bool]) -> Callable[[Result], Verdict]:
    """Each controller falls (True), or walks to the end (False), more often than not."""

    def judge(result: Result) -> Verdict:
        missing = [name for name in expected if name not in result.controllers]
        rates = {name: result.falls(scenario, name) for name in expected if name not in missing}
        if missing or any(rate.n == 0 for _, rate in rates.values()):
            return _nothing(result, scenario, tuple(expected))
        measured = ", ".join(f"{name} {count}/{rate.n}" for name, (count, rate) in rates.items()) + " fell"
        agree = [rate.low > 0.5 if expected[name] else rate.high < 0.5 for name, (_, rate) in rates.items()]
        differ = [rate.high < 0.5 if expected[name] else rate.low > 0.5 for name, (_, rate) in rates.items()]
        if all(agree):
            return Verdict("holds", measured)
        return Verdict("does not hold" if any(differ) else "undecided", measured)

    return judge


def repeats(scenario: str, other: str, metric: str, most: float) -> Callable[[Result], Verdict]:
    """ARTDE's mean of the metric differs between two scenarios by at most `most` percent on every joint."""

    def judge(result: Result) -> Verdict:
        estimates = {}
        for joint in thesis.JOINTS:
            column = f"{metric}_{joint}"
            first, second = (_walked(result, name, "artde", column) for name in (scenario, other))
            shared = sorted(first.keys() & second.keys())
            estimates[joint] = statistics.improvement([first[i] for i in shared], [second[i] for i in shared])
        joint, worst = max(estimates.items(), key=lambda item: np.nan_to_num(abs(item[1].value), nan=-1.0))
        if worst.n == 0:
            return _nothing(result, scenario, ("artde",))
        difference = Estimate(-worst.value, -worst.high, -worst.low, worst.n)
        measured = f"largest difference: {joint} {_interval(difference)} %, {worst.n} pairs"
        if all(-most <= estimate.low and estimate.high <= most for estimate in estimates.values()):
            return Verdict("holds", measured)
        if any(estimate.low > most or estimate.high < -most for estimate in estimates.values()):
            return Verdict("does not hold", measured)
        return Verdict("undecided", measured)

    return judge


def adapts(scenario: str) -> Callable[[Result], Verdict]:
    """ARTDE beats plain TDE at the equivalent extra stiffness: fewer falls, or less error where as many walk."""

    def judge(result: Result) -> Verdict:
        rivals = ("artde", "tde+kd")
        if any(name not in result.controllers for name in rivals):
            return _nothing(result, scenario, rivals)
        (ours, rate), (theirs, other) = (result.falls(scenario, name) for name in rivals)
        if rate.n == 0 or other.n == 0:
            return _nothing(result, scenario, rivals)
        error = statistics.improvement(*_pairs(result, scenario, *rivals, "rmse_deg"))
        measured = f"falls {ours}/{rate.n} against {theirs}/{other.n}; RMSE better by {_interval(error)} %"
        if rate.high < other.low or (ours <= theirs and error.low > 0):
            return Verdict("holds", measured)
        if rate.low > other.high or (ours >= theirs and error.high < 0):
            return Verdict("does not hold", measured)
        return Verdict("undecided", measured)

    return judge


_FALL = {"tde": True, "atde": True, "artde": False}
_WALK = {"tde": False, "atde": False, "artde": False}

CLAIMS: tuple[Claim, ...] = (
    Claim("S1", "nobody falls", "nobody falls", falls("S1", _WALK)),
    *(
        Claim(
            "S1",
            f"ARTDE's RMSE is below {rival.upper()}'s on every joint by at least {least} %",
            f">= {least} % printed; {true} % follows from table 2.1",
            improves("S1", rival, "rmse_deg", least),
        )
        for rival, least, true in (("tde", 29.1, 32.7), ("atde", 20.6, 20.1))
    ),
    *(
        Claim(
            "S1",
            f"ARTDE's maximum error is below {rival.upper()}'s on every joint",
            f">= {least} % in table 2.1",
            improves("S1", rival, "max_abs_error_deg", 0.0),
        )
        for rival, least in (("tde", 38.1), ("atde", 21.1))
    ),
    Claim("S2", "TDE and ATDE fall with the payload, ARTDE does not", "26 s, 31 s, walks", falls("S2", _FALL)),
    Claim("S3", "ARTDE survives both pushes", "walks", falls("S3", {"artde": False})),
    Claim(
        "S3",
        "ARTDE's RMSE repeats that of S2 within 15 % on every joint",
        "<= 14 % (q2 of phase 3)",
        repeats("S3", "S2", "rmse_deg", 15.0),
    ),
    Claim("S1-L4", "at 4 ms: nobody falls", "1 ms in the thesis", falls("S1-L4", _WALK)),
    Claim("S2-L4", "at 4 ms: TDE and ATDE fall with the payload, ARTDE does not", "1 ms", falls("S2-L4", _FALL)),
    Claim("S3-L4", "at 4 ms: ARTDE survives both pushes", "1 ms in the thesis", falls("S3-L4", {"artde": False})),
    *(
        Claim(name, "adaptation adds to the equivalent extra stiffness (ARTDE against tde+kd)", "ours", adapts(name))
        for name in ("S1", "S2", "S3", "S1-L4", "S2-L4", "S3-L4")
    ),
)


def judge(result: Result, claims: Sequence[Claim] = CLAIMS) -> pd.DataFrame:
    """One row a claim: scenario, claim, verdict, measured, thesis."""
    rows = []
    for claim in claims:
        verdict = claim.judge(result)
        rows.append((claim.scenario, claim.text, verdict.outcome, verdict.measured, claim.thesis))
    return pd.DataFrame(rows, columns=["scenario", "claim", "verdict", "measured", "thesis"])


def _pairs(result: Result, scenario: str, first: str, second: str, column: str) -> tuple[list[float], list[float]]:
    """Values of two controllers on the seeds on which neither fell."""
    ours, theirs = (_walked(result, scenario, name, column) for name in (first, second))
    shared = sorted(ours.keys() & theirs.keys())
    return [ours[i] for i in shared], [theirs[i] for i in shared]


def _walked(result: Result, scenario: str, controller: str, column: str) -> dict[int, float]:
    return {i: row[column] for i, row in result.rows(scenario, controller).items() if not row["fell"]}


def _nothing(result: Result, scenario: str, controllers: tuple[str, ...]) -> Verdict:
    """Why there is nothing to judge by."""
    fallen = [name for name in controllers if result.rows(scenario, name) and not _walked_any(result, scenario, name)]
    return Verdict("not measured", f"no episode walked to its end: {', '.join(fallen)}" if fallen else "no episodes")


def _walked_any(result: Result, scenario: str, controller: str) -> bool:
    return any(not row["fell"] for row in result.rows(scenario, controller).values())


def _interval(estimate: Estimate) -> str:
    if estimate.n == 0:
        return "(no pair walked)"
    span = f" ({estimate.low:+.1f}..{estimate.high:+.1f})" if np.isfinite(estimate.low) else ""
    return f"{estimate.value:+.1f}{span}"
