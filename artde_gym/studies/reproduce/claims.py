"""The thesis' claims as data, each with a verdict from seeded episodes.

A verdict is *holds* or *does not hold* where the 95 % intervals say so, *undecided* where they do not, and *not
measured* where an episode or a controller is missing. Claims of single runs ("TDE falls, ARTDE does not") are read as
claims of what happens more often than not. A claim that is compared over several axes must hold on each of them.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
import pandas as pd

from artde_gym.evaluation import statistics, thesis
from artde_gym.evaluation.pairing import paired_across
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.statistics import Estimate

CLAIM_COLUMNS = ["scenario", "claim", "verdict", "measured", "thesis"]
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
        ablation: whether it takes the ablation of `artde_gym.studies.reproduce.reproduction`.
    """

    scenario: str
    text: str
    thesis: str
    judge: Callable[[Result], Verdict]
    ablation: bool = False


def improves(
    scenario: str, rival: str, metric: str, axes: Sequence[str], least: float = 0.0
) -> Callable[[Result], Verdict]:
    """On every axis the metric's mean is lower for ARTDE than for `rival` by at least `least` percent."""

    def judge(result: Result) -> Verdict:
        if missing := _missing(result, scenario, ("artde", rival)):
            return missing
        estimates = {
            axis: statistics.improvement(*result.pairs(scenario, "artde", rival, f"{metric}_{axis}")) for axis in axes
        }
        axis, worst = min(estimates.items(), key=lambda item: np.nan_to_num(item[1].value, nan=np.inf))
        if worst.n == 0:
            return _nothing(result, scenario, ("artde", rival))
        measured = f"least: {axis} {_interval(worst)} %, {worst.n} pairs"
        if all(estimate.low >= least for estimate in estimates.values()):
            return Verdict("holds", measured)
        if any(estimate.high < least for estimate in estimates.values()):
            return Verdict("does not hold", measured)
        return Verdict("undecided", measured)

    return judge


def falls(scenario: str, expected: dict[str, bool]) -> Callable[[Result], Verdict]:
    """Each controller falls (True), or walks to the end (False), more often than not."""

    def judge(result: Result) -> Verdict:
        if missing := _missing(result, scenario, tuple(expected)):
            return missing
        rates = {name: result.falls(scenario, name) for name in expected}
        measured = ", ".join(f"{name} {count}/{rate.n}" for name, (count, rate) in rates.items()) + " fell"
        agree = [rate.low > 0.5 if expected[name] else rate.high < 0.5 for name, (_, rate) in rates.items()]
        differ = [rate.high < 0.5 if expected[name] else rate.low > 0.5 for name, (_, rate) in rates.items()]
        if all(agree):
            return Verdict("holds", measured)
        return Verdict("does not hold" if any(differ) else "undecided", measured)

    return judge


def repeats(scenario: str, other: str, metric: str, axes: Sequence[str], most: float) -> Callable[[Result], Verdict]:
    """ARTDE's mean of the metric differs between two scenarios by at most `most` percent on every axis."""

    def judge(result: Result) -> Verdict:
        for name in (scenario, other):
            if missing := _missing(result, name, ("artde",)):
                return missing
        first, second = paired_across(*(_upright(result, name, "artde") for name in (scenario, other)))
        estimates = {
            axis: statistics.improvement(first[f"{metric}_{axis}"], second[f"{metric}_{axis}"]) for axis in axes
        }
        axis, worst = max(estimates.items(), key=lambda item: np.nan_to_num(abs(item[1].value), nan=-1.0))
        if worst.n == 0:
            return _nothing(result, scenario, ("artde",))
        difference = Estimate(-worst.value, -worst.high, -worst.low, worst.n)
        measured = f"largest difference: {axis} {_interval(difference)} %, {worst.n} pairs"
        if all(-most <= estimate.low and estimate.high <= most for estimate in estimates.values()):
            return Verdict("holds", measured)
        if any(estimate.low > most or estimate.high < -most for estimate in estimates.values()):
            return Verdict("does not hold", measured)
        return Verdict("undecided", measured)

    return judge


def adapts(scenario: str, rival: str, metric: str) -> Callable[[Result], Verdict]:
    """ARTDE beats a TDE that does not adapt: fewer falls, or a smaller error where as many stay up."""

    def judge(result: Result) -> Verdict:
        rivals = ("artde", rival)
        if missing := _missing(result, scenario, rivals):
            return missing
        (ours, rate), (theirs, other) = (result.falls(scenario, name) for name in rivals)
        error = statistics.improvement(*result.pairs(scenario, *rivals, metric))
        measured = f"falls {ours}/{rate.n} against {theirs}/{other.n}; RMSE better by {_interval(error)} %"
        if rate.high < other.low or (ours <= theirs and error.low > 0):
            return Verdict("holds", measured)
        if rate.low > other.high or (ours >= theirs and error.high < 0):
            return Verdict("does not hold", measured)
        return Verdict("undecided", measured)

    return judge


def ordered(scenario: str, names: Sequence[str], metric: str) -> Callable[[Result], Verdict]:
    """The metric's mean grows from each controller to the next."""

    def judge(result: Result) -> Verdict:
        if missing := _missing(result, scenario, tuple(names)):
            return missing
        estimates = [
            statistics.improvement(*result.pairs(scenario, first, second, metric))
            for first, second in itertools.pairwise(names)
        ]
        if any(estimate.n == 0 for estimate in estimates):
            return _nothing(result, scenario, tuple(names))
        measured = ", ".join(
            f"{first} below {second} by {_interval(estimate)} %"
            for (first, second), estimate in zip(itertools.pairwise(names), estimates, strict=True)
        )
        if all(estimate.low > 0 for estimate in estimates):
            return Verdict("holds", measured)
        return Verdict("does not hold" if any(estimate.high < 0 for estimate in estimates) else "undecided", measured)

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
            improves("S1", rival, "rmse_deg", thesis.JOINTS, least),
        )
        for rival, least, true in (("tde", 29.1, 32.7), ("atde", 20.6, 20.1))
    ),
    *(
        Claim(
            "S1",
            f"ARTDE's maximum error is below {rival.upper()}'s on every joint",
            f">= {least} % in table 2.1",
            improves("S1", rival, "max_abs_error_deg", thesis.JOINTS),
        )
        for rival, least in (("tde", 38.1), ("atde", 21.1))
    ),
    Claim("S2", "TDE and ATDE fall with the payload, ARTDE does not", "26 s, 31 s, walks", falls("S2", _FALL)),
    Claim("S3", "ARTDE survives both pushes", "walks", falls("S3", {"artde": False})),
    Claim(
        "S3",
        "ARTDE's RMSE repeats that of S2 within 15 % on every joint",
        "<= 14 % (q2 of phase 3)",
        repeats("S3", "S2", "rmse_deg", thesis.JOINTS, 15.0),
    ),
    Claim("S1-L4", "at 4 ms: nobody falls", "1 ms in the thesis", falls("S1-L4", _WALK)),
    Claim("S2-L4", "at 4 ms: TDE and ATDE fall with the payload, ARTDE does not", "1 ms", falls("S2-L4", _FALL)),
    Claim("S3-L4", "at 4 ms: ARTDE survives both pushes", "1 ms in the thesis", falls("S3-L4", {"artde": False})),
    *(
        Claim(
            name,
            "adaptation adds to the equivalent extra stiffness (ARTDE against tde+kd)",
            "ours",
            adapts(name, "tde+kd", "rmse_deg"),
            ablation=True,
        )
        for name in ("S1", "S2", "S3", "S1-L4", "S2-L4", "S3-L4")
    ),
    Claim("Q1", "nobody crashes", "nobody crashes", falls("Q1", {"atde": False, "asmc": False, "artde": False})),
    *(
        Claim(
            "Q1",
            f"ARTDE's RMSE is below {rival.upper()}'s in y and z by more than 30 %",
            f"> 30 % printed; {true} follow from table 3.1",
            improves("Q1", rival, "rmse_m", ("y", "z"), 30.0),
        )
        for rival, true in (("atde", "33 and 69 %"), ("asmc", "23 and 69 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE's peak error is below {rival.upper()}'s in x, y and z",
            f"{true} in table 3.1",
            improves("Q1", rival, "max_abs_error_m", thesis.POSITION),
        )
        for rival, true in (("atde", "0, 19 and 7 %"), ("asmc", "31, 12 and 0 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE's RMS roll and pitch errors are below {rival.upper()}'s",
            f"{true} in table 3.1",
            improves("Q1", rival, "rmse_deg", thesis.ATTITUDE[:2]),
        )
        for rival, true in (("atde", "37 and 25 %"), ("asmc", "-4 and 5 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE's peak attitude error is below {rival.upper()}'s on every axis",
            f"{true} in table 3.1",
            improves("Q1", rival, "max_abs_error_deg", thesis.ATTITUDE),
        )
        for rival, true in (("atde", "51, 25 and 4 %"), ("asmc", "22, 3 and 23 %"))
    ),
    *(
        Claim(
            "Q1",
            f"ARTDE sways less than {rival.upper()} after the payload's drop (peak error)",
            "the others sway, ARTDE does not",
            improves("Q1", rival, "peak_error_m", ("drop",)),
        )
        for rival in ("atde", "asmc")
    ),
    *(
        Claim(
            name,
            f"adaptation adds to {what} in wind (ARTDE against {rival})",
            "ours",
            adapts(name, rival, "rmse_m"),
            ablation=rival == "tde+kd",
        )
        for name in ("Q1", "Q1-gale")
        for what, rival in (("plain TDE", "tde"), ("the equivalent extra stiffness", "tde+kd"))
    ),
    Claim(
        "Q1-calm",
        "ARTDE is better than ATDE, and ATDE than TDE, without wind too",
        "ours",
        ordered("Q1-calm", ("artde", "atde", "tde"), "rmse_m"),
    ),
)


def judge(result: Result, claims: Sequence[Claim] = CLAIMS) -> pd.DataFrame:
    """One row a claim: scenario, claim, verdict, measured, thesis."""
    rows = []
    for claim in claims:
        verdict = claim.judge(result)
        rows.append((claim.scenario, claim.text, verdict.outcome, verdict.measured, claim.thesis))
    return pd.DataFrame(rows, columns=CLAIM_COLUMNS)


def confirm(verdicts: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Verdicts of several engines side by side: scenario, claim, one column an engine, confirmed.

    A verdict is *confirmed* where every engine comes to it and it is a decision; else `confirmed` is empty.
    """
    keys = ["scenario", "claim"]
    joined = pd.DataFrame({engine: table.set_index(keys)["verdict"] for engine, table in verdicts.items()})
    first = joined.iloc[:, 0]
    agreed = joined.nunique(axis=1).eq(1) & first.isin(["holds", "does not hold"])
    return joined.assign(confirmed=first.where(agreed, "")).reset_index()


def _upright(result: Result, scenario: str, controller: str) -> pd.DataFrame:
    """Episodes without a fall."""
    rows = result.rows(scenario, controller)
    upright: pd.DataFrame = rows.loc[~rows["fell"].to_numpy(dtype=np.bool_)]
    return upright


def _missing(result: Result, scenario: str, controllers: tuple[str, ...]) -> Verdict | None:
    """The verdict where a controller has no episode."""
    missing = [name for name in controllers if result.rows(scenario, name).empty]
    return Verdict("not measured", f"no episodes of {', '.join(missing)}") if missing else None


def _nothing(result: Result, scenario: str, controllers: tuple[str, ...]) -> Verdict:
    """The verdict where no seed has an episode without a fall of each controller."""
    fallen = [name for name in controllers if _upright(result, scenario, name).empty]
    return Verdict("not measured", f"no episode without a fall: {', '.join(fallen)}" if fallen else "no common seeds")


def _interval(estimate: Estimate) -> str:
    if estimate.n == 0:
        return "(no pair without a fall)"
    span = f" ({estimate.low:+.1f}..{estimate.high:+.1f})" if np.isfinite(estimate.low) else ""
    return f"{estimate.value:+.1f}{span}"
