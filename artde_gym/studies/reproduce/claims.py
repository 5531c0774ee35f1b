"""Claims as data, judged on seeded episodes; each robot provides its own.

A verdict is *holds* or *does not hold* if the 95 % intervals decide, *undecided* if they do not, and *not measured* if
an episode or a controller is missing. Claims of single runs ("TDE falls, ARTDE does not") are read as claims about the
majority of runs. A claim that is compared over several axes must hold on each of them.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import pandas as pd

from artde_gym.evaluation import statistics
from artde_gym.evaluation.pairing import paired_across
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.statistics import Estimate
from artde_gym.registry import Registry
from artde_gym.studies.frontier.axis import Axis
from artde_gym.studies.frontier.half import half_difference, rounded, survival_table
from artde_gym.studies.frontier.result import Frontier

CLAIM_COLUMNS = ["scenario", "claim", "verdict", "measured", "thesis"]
ADDED = "not in the thesis"
"""Source of a claim that the publication does not make."""
Outcome = Literal["holds", "does not hold", "undecided", "not measured"]


@dataclasses.dataclass(frozen=True)
class Verdict:
    """The outcome of a claim, and the measured values in words with their interval."""

    outcome: Outcome
    measured: str


@dataclasses.dataclass(frozen=True)
class Claim:
    """A statement that episodes can decide.

    Attributes:
        scenario: the scenario it concerns.
        text: the statement.
        thesis: the publication's own number or observation; `ADDED` for a question of this project.
        judge: episodes -> verdict.
        ablation: whether it takes the ablation of `artde_gym.studies.reproduce.reproduction`.
        curve: what a grid of `frontier` varies, that `judge` is given in place of episodes in the scenario.
        takes: controllers beside those that `reproduce` runs by default; without them it leaves the claim out.
    """

    scenario: str
    text: str
    thesis: str
    judge: Callable[[Any], Verdict]
    ablation: bool = False
    curve: str | None = None
    takes: tuple[str, ...] = ()


def improves(
    scenario: str, rival: str, metric: str, axes: Sequence[str], least: float = 0.0
) -> Callable[[Result], Verdict]:
    """Claim that the metric's mean is lower for ARTDE than for `rival` by at least `least` percent, on every axis."""

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
    """Claim that each controller falls (True), or finishes (False), more often than not."""

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
    """Claim that ARTDE's mean of the metric differs between two scenarios by at most `most` percent on every axis."""

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
        return Verdict(_within(estimates.values(), most), measured)

    return judge


def stays(scenario: str, other: str, metric: str, axes: Sequence[str], most: float) -> Callable[[Result], Verdict]:
    """ARTDE's mean of the metric differs by at most `most` percent on every axis, in scenarios that share no draws."""

    def judge(result: Result) -> Verdict:
        for name in (scenario, other):
            if missing := _missing(result, name, ("artde",)):
                return missing
        first, second = (_upright(result, name, "artde") for name in (scenario, other))
        estimates = {axis: statistics.change(first[f"{metric}_{axis}"], second[f"{metric}_{axis}"]) for axis in axes}
        axis, worst = max(estimates.items(), key=lambda item: np.nan_to_num(abs(item[1].value), nan=-1.0))
        if worst.n == 0:
            return _nothing(result, scenario, ("artde",))
        measured = f"largest difference: {axis} {_interval(worst)} %, {len(first)} and {len(second)} episodes"
        return Verdict(_within(estimates.values(), most), measured)

    return judge


def adapts(scenario: str, rival: str, metric: str) -> Callable[[Result], Verdict]:
    """Claim that ARTDE beats a TDE without adaptation: fewer falls, or a smaller error if as many finish."""
    return beats(scenario, "artde", rival, metric)


def beats(scenario: str, name: str, rival: str, metric: str) -> Callable[[Result], Verdict]:
    """Claim that a controller beats a rival: fewer falls, or a smaller error if as many finish."""

    def judge(result: Result) -> Verdict:
        rivals = (name, rival)
        if missing := _missing(result, scenario, rivals):
            return missing
        (ours, rate), (theirs, other) = (result.falls(scenario, one) for one in rivals)
        error = statistics.improvement(*result.pairs(scenario, *rivals, metric))
        measured = f"falls {ours}/{rate.n} against {theirs}/{other.n}; RMSE better by {_interval(error)} %"
        if rate.high < other.low or (ours <= theirs and error.low > 0):
            return Verdict("holds", measured)
        if rate.low > other.high or (ours >= theirs and error.high < 0):
            return Verdict("does not hold", measured)
        return Verdict("undecided", measured)

    return judge


def safer(scenario: str, name: str, rivals: Sequence[str]) -> Callable[[Result], Verdict]:
    """Judge whether a controller falls less often than each of its rivals."""

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
    """Judge whether a controller's settling times are finite (True) or infinite (False) more often than not."""

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
    """Claim that the metric's mean grows from each controller to the next."""

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


def outlasts(names: Sequence[str]) -> Callable[[Frontier], Verdict]:
    """Half of the episodes survive more for each controller than for the next, on the same seeds."""

    def judge(found: Frontier) -> Verdict:
        tables = {name: survival_table(found, name) for name in names}
        if missing := [name for name, table in tables.items() if table is None]:
            return Verdict("not measured", f"no whole grid of {', '.join(missing)}")
        levels, sign = found.axis.levels, 1.0 if found.axis.harder == "larger" else -1.0
        known = [table for table in tables.values() if table is not None]
        gaps = [half_difference(first, second, levels) for first, second in itertools.pairwise(known)]
        measured = ", ".join(
            f"{first} beyond {second} by {_gap(gap, found.axis)}"
            for (first, second), gap in zip(itertools.pairwise(names), gaps, strict=True)
        )
        # an end of 0 counts: half points lie inside their brackets, and brackets that share only a level differ
        if all(sign * gap.value > 0 and min(sign * gap.low, sign * gap.high) >= 0 for gap in gaps):
            return Verdict("holds", measured)
        reversed_ = any(sign * gap.value < 0 and max(sign * gap.low, sign * gap.high) <= 0 for gap in gaps)
        return Verdict("does not hold" if reversed_ else "undecided", measured)

    return judge


CLAIMS: Registry[tuple[Claim, ...]] = Registry("claims", "artde_gym.claims")
"""Claims by robot, from plug-ins and `register_claims`."""


def register_claims(name: str, claims: Sequence[Claim], *, replace: bool = False) -> None:
    """Add claims for `reproduce` to judge in their scenarios.

    Args:
        name: name of the set of claims, such as a robot's.
        claims: the claims to judge.
        replace: whether they may replace others with the same name.

    Raises:
        OptionError: if the name is taken and `replace` is not given.
    """
    CLAIMS.register(name, tuple(claims), replace=replace)


def all_claims() -> tuple[Claim, ...]:
    """Return the claims of all robots."""
    return tuple(itertools.chain.from_iterable(CLAIMS.values()))


def judge(
    result: Result,
    claims: Sequence[Claim] | None = None,
    curves: Mapping[tuple[str, str], Frontier] = MappingProxyType({}),
) -> pd.DataFrame:
    """Judge some claims, or all; one row a claim: scenario, claim, verdict, measured, thesis.

    `curves` are grids by scenario and what they vary.
    """
    rows = []
    for claim in all_claims() if claims is None else claims:
        if claim.curve is None:
            verdict = claim.judge(result)
        elif found := curves.get((claim.scenario, claim.curve)):
            verdict = claim.judge(found)
        else:
            verdict = Verdict("not measured", f"no grid of {claim.curve}")
        rows.append((claim.scenario, claim.text, verdict.outcome, verdict.measured, claim.thesis))
    return pd.DataFrame(rows, columns=CLAIM_COLUMNS)


def confirm(verdicts: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Put verdicts of several engines side by side: scenario, claim, one column per engine, confirmed.

    A verdict is *confirmed* if every engine reaches it and it is a decision; else `confirmed` is empty.
    """
    keys = ["scenario", "claim"]
    joined = pd.DataFrame({engine: table.set_index(keys)["verdict"] for engine, table in verdicts.items()})
    first = joined.iloc[:, 0]
    agreed = joined.nunique(axis=1).eq(1) & first.isin(["holds", "does not hold"])
    return joined.assign(confirmed=first.where(agreed, "")).reset_index()


def _upright(result: Result, scenario: str, controller: str) -> pd.DataFrame:
    """Return the episodes without a fall."""
    rows = result.rows(scenario, controller)
    upright: pd.DataFrame = rows.loc[~rows["fell"].to_numpy(dtype=np.bool_)]
    return upright


def _within(estimates: Collection[Estimate], most: float) -> Outcome:
    """Return True if all differences are at most so large (%)."""
    if all(-most <= estimate.low and estimate.high <= most for estimate in estimates):
        return "holds"
    return "does not hold" if any(one.low > most or one.high < -most for one in estimates) else "undecided"


def _missing(result: Result, scenario: str, controllers: tuple[str, ...]) -> Verdict | None:
    """Return a verdict if a controller has no episode."""
    missing = [name for name in controllers if not result.has(scenario, name)]
    return Verdict("not measured", f"no episodes of {', '.join(missing)}") if missing else None


def _nothing(result: Result, scenario: str, controllers: tuple[str, ...]) -> Verdict:
    """Return the verdict for controllers without a common seed on which none of them falls."""
    fallen = [name for name in controllers if _upright(result, scenario, name).empty]
    return Verdict("not measured", f"no episode without a fall: {', '.join(fallen)}" if fallen else "no common seeds")


def _interval(estimate: Estimate) -> str:
    if estimate.n == 0:
        return "(no pair without a fall)"
    span = f" ({estimate.low:+.1f}..{estimate.high:+.1f})" if np.isfinite(estimate.low) else ""
    return f"{estimate.value:+.1f}{span}"


def _gap(gap: Estimate, varied: Axis) -> str:
    if np.isnan(gap.value):
        return "an unknown amount"
    span = "" if np.isnan([gap.low, gap.high]).any() else f" ({gap.low:+g}..{gap.high:+g})"
    return f"{rounded(gap.value, varied):+g}{span}{'' if varied.unit == '1' else f' {varied.unit}'}"
