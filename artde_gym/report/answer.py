"""The answer in words: who is better, by how much, with what certainty."""

from __future__ import annotations

import math

from artde_gym.evaluation import statistics
from artde_gym.evaluation.console import UNITS
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.statistics import Estimate
from artde_gym.metrics_spec import MetricsSpec

FEW = 6  # seeds, below which an interval is itself uncertain


def ranking(result: Result, scenario: str, metric: str) -> list[str]:
    """Controllers by how often they fall; among those that fall as often, by their mean error."""

    def order(name: str) -> tuple[float, float]:
        _, rate = result.falls(scenario, name)
        error = statistics.mean(_walked(result, scenario, name, metric)).value
        return rate.value, math.inf if math.isnan(error) else error

    return sorted((name for name in result.controllers if len(result.rows(scenario, name))), key=order)


def headline(result: Result, trackings: dict[str, MetricsSpec]) -> str:
    """One sentence over all scenarios."""
    if len(result.controllers) == 1:
        return f"{result.controllers[0]} was evaluated alone: there is nothing to compare it with."
    won: dict[str, list[str]] = {}
    for scenario in result.scenarios:
        best = ranking(result, scenario, metric_of(trackings[scenario]))[0]
        won.setdefault("nobody" if _all_fall(result, scenario) else best, []).append(scenario)
    parts = [f"{name} in {', '.join(scenarios)}" for name, scenarios in sorted(won.items(), key=lambda x: -len(x[1]))]
    return f"Best, by falls first and RMS error second: {'; '.join(parts)}."


def sentences(result: Result, scenario: str, tracking: MetricsSpec) -> list[str]:
    """What a scenario shows: the leader's falls and error, then how the others compare with it, the closest first."""
    metric = metric_of(tracking)
    best, *rivals = names = ranking(result, scenario, metric)
    count = min(len(result.rows(scenario, name)) for name in names)
    care = [f"Only {count} seed{'s' if count != 1 else ''}: take the intervals with care."] if count < FEW else []
    if _all_fall(result, scenario):
        return ["Every controller fell in every episode.", *care]
    text, digits = UNITS[tracking.errors[0].unit]
    falls, rate = result.falls(scenario, best)
    error = statistics.mean(_walked(result, scenario, best, metric))
    said = f"{best} leads: {_falls(falls, rate)}; RMS error {error.value:.{digits}f}{_span(error, digits)} {text}"
    said += " in the episodes without a fall" if falls else ""
    return [f"{said}.", *(_comparison(result, scenario, best, rival, metric) for rival in rivals), *care]


def _comparison(result: Result, scenario: str, best: str, rival: str, metric: str) -> str:
    parts = []
    (_, mine), (fallen, theirs) = (result.falls(scenario, name) for name in (best, rival))
    if mine.value != theirs.value:
        sure = "beyond chance at 95 %" if mine.high < theirs.low else "the 95 % intervals overlap"
        parts.append(f"{_falls(fallen, theirs)} ({sure})")
    gain = statistics.improvement(*result.pairs(scenario, best, rival, metric))
    if gain.n:
        ours, others = result.pairs(scenario, best, rival, metric)
        wins = statistics.win_probability(ours, others)
        which, sign = ("smaller", 1) if gain.value >= 0 else ("larger", -1)
        low, high = sorted((sign * gain.low, sign * gain.high))
        size = Estimate(sign * gain.value, low, high, gain.n)
        sure = "beyond chance at 95 %" if size.low > 0 else "undecided"
        parts.append(
            f"the RMS error of {best} is {size.value:.1f}{_span(size, 1)} % {which} on the {gain.n} shared "
            f"seed{'s' if gain.n > 1 else ''} without a fall, and smaller on {100 * wins:.0f} % of them ({sure})"
        )
    elif not parts:
        parts.append(f"{_falls(fallen, theirs)}, and no shared seed without a fall is left to compare errors")
    return f"Against {rival}: {'; '.join(parts)}."


def _all_fall(result: Result, scenario: str) -> bool:
    return bool(result.episodes.loc[result.episodes["scenario"] == scenario, "fell"].all())


def metric_of(tracking: MetricsSpec) -> str:
    """Name of the RMS error that controllers are ranked by."""
    return f"rmse_{tracking.errors[0].unit}"


def _walked(result: Result, scenario: str, name: str, metric: str) -> list[float]:
    rows = result.rows(scenario, name)
    return rows.loc[~rows["fell"].astype(bool), metric].tolist()


def _falls(count: int, rate: Estimate) -> str:
    return f"it fell in {count} of {rate.n} episodes" if count else f"no fall in {rate.n} episode{'s'[: rate.n > 1]}"


def _span(estimate: Estimate, digits: int) -> str:
    return f" ({estimate.low:.{digits}f}..{estimate.high:.{digits}f})" if math.isfinite(estimate.low) else ""
