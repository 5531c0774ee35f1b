"""Claims as data, each with a verdict from seeded episodes; each robot brings its own.

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

from artde_gym.evaluation import statistics
from artde_gym.evaluation.pairing import paired_across
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.statistics import Estimate
from artde_gym.registry import Registry

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
        thesis: the publication's own number or observation; "ours" for a question that we add.
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


def safer(scenario: str, name: str, rivals: Sequence[str]) -> Callable[[Result], Verdict]:
    """A controller falls less often than each of its rivals."""

    def judge(result: Result) -> Verdict:
        if missing := _missing(result, scenario, (name, *rivals)):
            return missing
        count, rate = result.falls(scenario, name)
        others = {rival: result.falls(scenario, rival) for rival in rivals}
        measured = (
            f"{name} {count}/{rate.n}, " + ", ".join(f"{r} {n}/{of.n}" for r, (n, of) in others.items()) + " fell"
        )
        if all(rate.high < of.low for _, of in others.values()):
            return Verdict("holds", measured)
        wrong = any(rate.low > of.high for _, of in others.values())
        return Verdict("does not hold" if wrong else "undecided", measured)

    return judge


def settles(scenario: str, time: str, expected: Mapping[str, bool]) -> Callable[[Result], Verdict]:
    """A column of settling times is finite for a controller (True), or never is (False), more often than not."""

    def judge(result: Result) -> Verdict:
        if missing := _missing(result, scenario, tuple(expected)):
            return missing
        if time not in result.episodes:
            return Verdict("not measured", f"no column {time}")
        rates: dict[str, Estimate] = {}
        for name in expected:
            known = _upright(result, scenario, name)[time].dropna().to_numpy(np.float64)
            rates[name] = statistics.rate(int(np.isfinite(known).sum()), len(known))
        if any(rate.n == 0 for rate in rates.values()):
            return _nothing(result, scenario, tuple(expected))
        measured = ", ".join(f"{name} {rate.value * rate.n:.0f}/{rate.n}" for name, rate in rates.items()) + " settled"
        agree = [rate.low > 0.5 if expected[name] else rate.high < 0.5 for name, rate in rates.items()]
        differ = [rate.high < 0.5 if expected[name] else rate.low > 0.5 for name, rate in rates.items()]
        if all(agree):
            return Verdict("holds", measured)
        return Verdict("does not hold" if any(differ) else "undecided", measured)

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


CLAIMS: Registry[tuple[Claim, ...]] = Registry("claims", "artde_gym.claims")
"""Claims by robot: those of plug-ins, and those registered."""


def register_claims(name: str, claims: Sequence[Claim], *, replace: bool = False) -> None:
    """Have more claims judged by `reproduce`, in whose scenarios they are made.

    Args:
        name: under which they are known, such as a robot's.
        claims: to be judged.
        replace: whether they may take the place of others of the same name.

    Raises:
        OptionError: if the name is taken and `replace` is not given.
    """
    CLAIMS.register(name, tuple(claims), replace=replace)


def all_claims() -> tuple[Claim, ...]:
    """Return the claims of all robots."""
    return tuple(itertools.chain.from_iterable(CLAIMS.values()))


def judge(result: Result, claims: Sequence[Claim] | None = None) -> pd.DataFrame:
    """Judge some claims, or all; one row a claim: scenario, claim, verdict, measured, thesis."""
    rows = []
    for claim in all_claims() if claims is None else claims:
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
