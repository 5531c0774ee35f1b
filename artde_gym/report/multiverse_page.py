"""The part of a report that shows claims over plausible worlds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from html import escape

import numpy as np
import pandas as pd

from artde_gym.errors import MissingDependencyError
from artde_gym.evaluation import statistics
from artde_gym.palette import Style, styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import Cell, details, figure, paragraph, table
from artde_gym.studies.multiverse.claims import OUTCOMES
from artde_gym.studies.multiverse.console import all_deciding, deciding_text, p_text, share_text
from artde_gym.studies.multiverse.deciding import FOLDS, Deciding, Node, rank_correlations
from artde_gym.studies.multiverse.factor import Factor
from artde_gym.studies.multiverse.result import FATES, Multiverse
from artde_gym.studies.multiverse.verdict import Verdict

WIDE, SIDE = 500, 64  # units of a chart, and of its margins
ROW = 38  # units, of a bar with its words
BINS = 6  # of the survival curve
COLUMNS = 24  # of a histogram
SHOWN: dict[str, Style] = {
    "holds": Style("#0072B2", "s"),
    "tie": Style("#9A9A9A", "s"),
    "reverses": Style("#D55E00", "s"),
}

ENDED: dict[str, Style] = {FATES[False]: SHOWN["holds"], FATES[True]: SHOWN["reverses"]}


def answer(found: Multiverse) -> tuple[str, list[str]]:
    """Write a headline, and a sentence on each claim."""
    shares = ", ".join(f"{name} {100 * found.survival(name).value:.0f} %" for name in found.controllers)
    head = f"Without a fall in {len(set(found.episodes['world']))} plausible worlds: {shares}."
    return head, [_sentence(verdict) for verdict in found.verdicts]


def parts(found: Multiverse) -> Iterator[tuple[str, list[str]]]:
    """Yield the sections: a title, and what stands below it."""
    if found.verdicts:
        yield "Claims", [_verdict_bars(found.verdicts), _claims(found)]
    yield "Survival", [_survival(found), _curves(found)]
    yield "Factors", [_effects(found), *_trees(found)]
    yield "Errors where both survive", _ratios(found)
    if found.verdicts:
        yield "Worlds to run again", [_ends(found, verdict) for verdict in found.verdicts]
    yield "Design", [_design(found)]


def _sentence(verdict: Verdict) -> str:
    if not verdict.decided:
        return f"{verdict.claim.text}: no world tells."
    holds, reverses = share_text(verdict.share("holds")), share_text(verdict.share("reverses"))
    p = p_text(verdict.p_value)
    test = f"; sign test p {p if p.startswith('<') else f'= {p}'}" if p else ""
    return f"{verdict.claim.text}: holds in {holds} % of {verdict.decided} worlds, reverses in {reverses} %{test}."


def _blank(name: str, x: Axis, rows: int, foot: str = "") -> Chart:
    """Make a chart of rows, the first one on top, without axes of numbers on the left."""
    height = rows * ROW + 52
    chart = Chart(name, x, Axis("", 0.0, float(rows)), WIDE, height, frame=False)
    for tick in x.ticks():
        chart.guide([tick, tick], [0.0, rows])
        chart.text(tick, -0.45, f"{tick:g}")
    if foot:
        chart.text((x.low + x.high) / 2, -0.95, foot)
    return chart


def claims_chart(verdicts: Sequence[Verdict]) -> Chart:
    """Draw in how many worlds each claim holds, ties and reverses: claims of which some world tells."""
    shown = [verdict for verdict in verdicts if verdict.decided]
    chart = _blank("Share of worlds in which each claim holds, ties and reverses", Axis("", 0.0, 100.0), len(shown),
                   "% of the worlds of which the claim says something")  # fmt: skip
    for row, verdict in enumerate(shown):
        y = len(shown) - row - 1
        chart.label(0.0, y + 0.62, f"{verdict.claim.text} ({verdict.decided})")
        _stacked(chart, [verdict.count(outcome) for outcome in OUTCOMES], list(SHOWN.values()), y, 0.0, 100.0)
        low, high = verdict.share("holds")[1:3]
        chart.line([100 * low, 100 * high], [y + 0.3] * 2, Style("#000000", "o"), text="95 % interval of holds")
    return chart


def _verdict_bars(verdicts: Sequence[Verdict]) -> str:
    if not any(verdict.decided for verdict in verdicts):
        return paragraph("No world tells anything of a claim yet.", "soft")
    caption = (
        "In how many worlds each claim holds, ties and reverses; in brackets, of how many it tells. The line is the "
        "95 % interval (Wilson) of the share in which it holds."
    )
    return figure(caption, {"": claims_chart(verdicts).svg()}, SHOWN)


def _stacked(chart: Chart, counts: Sequence[int], shown: Sequence[Style], y: float, left: float, right: float) -> None:
    total, start = max(sum(counts), 1), left
    for count, look in zip(counts, shown, strict=True):
        end = start + (right - left) * count / total
        if count:
            chart.box((start, end), (y + 0.12, y + 0.48), look, f"{count} of {total}")
        start = end


def _claims(found: Multiverse) -> str:
    rows = []
    for verdict in found.verdicts:
        shares = [verdict.share(outcome) for outcome in OUTCOMES]
        cells = [Cell(share_text(share), share.value if share.n else None) for share in shares]
        p = Cell(p_text(verdict.p_value), None if math.isnan(verdict.p_value) else verdict.p_value)
        rows.append([Cell(verdict.claim.text, kind="text"), Cell(str(verdict.decided), verdict.decided), *cells, p])
    columns = ["claim", "worlds", *(f"{outcome}, % (95 %)" for outcome in OUTCOMES), "sign test p"]
    return table("Worlds by outcome", columns, rows)


def _survival(found: Multiverse) -> str:
    rows = []
    for name in found.controllers:
        share = found.survival(name)
        rows.append([name, Cell(str(share.n), share.n), Cell(share_text(share), share.value)])
    return table("Worlds without a fall", ["controller", "worlds", "% (95 %)"], rows)


def _curves(found: Multiverse) -> str:
    """Draw survival against one factor, a chart for each value of another."""
    along, by = found.design.figure
    shown = styles(found.controllers)
    numbers = along.numbers(_values(found, along))
    bins = _bins(along, numbers)
    key = ", ".join(f"{place}: {text}" for place, text in enumerate(along.categories))
    x = Axis.of(f"{along.label}, {key}" if key else along.label, numbers, log=along.kind == "log_uniform")
    charts = {}
    for head, chosen in _groups(found, by).items():
        chart = Chart(
            f"Worlds without a fall against {along.name}, {head}", x, Axis("no fall (%)", 0.0, 104.0), 340, 230
        )
        for i, name in enumerate(found.controllers):
            _curve(chart, found, name, chosen, numbers, bins, shown[name], i)
        charts[head] = chart.svg()
    points = "at each choice" if along.kind == "choice" else "in bins of equally many worlds"
    caption = f"Survival against {along.name}, {points}; bars are 95 % intervals (Wilson)."
    return figure(caption, charts, shown)


def _bins(along: Factor, numbers: np.ndarray) -> np.ndarray:
    """Return the number of each world's bin: one a choice, else of equally many worlds."""
    if along.kind == "choice":
        return np.unique(numbers, return_inverse=True)[1]
    inner = np.unique(np.quantile(numbers, np.linspace(0.0, 1.0, BINS + 1)))[1:-1]
    return np.searchsorted(inner, numbers, side="right")


def _curve(
    chart: Chart,
    found: Multiverse,
    name: str,
    chosen: set[int],
    numbers: np.ndarray,
    bins: np.ndarray,
    look: Style,
    place: int,
) -> None:
    rows = found.episodes[found.episodes["controller"] == name]
    fell = {int(world): bool(fell) for world, fell in zip(rows["world"], rows["fell"], strict=True)}
    worlds = [world for world in fell if world in chosen]
    shift = (place / max(len(found.controllers) - 1, 1) - 0.5) * 0.03 * (chart.x.high - chart.x.low)
    points = []
    for one in range(bins.max() + 1):
        inside = [world for world in worlds if bins[world] == one]
        if inside:
            share = statistics.rate(sum(not fell[world] for world in inside), len(inside))
            points.append((float(np.mean(numbers[inside])) + shift, share))
    chart.line([at for at, _ in points], [100 * share.value for _, share in points], look, text=name, kind="path")
    for at, share in points:
        chart.interval(at, 100 * share.low, 100 * share.high, look)
        chart.marker(at, 100 * share.value, look, f"{name}: {share_text(share)} % of {share.n}")


def _values(found: Multiverse, factor: Factor) -> list[object]:
    return [world.factors[factor.name] for world in found.design.worlds]


def _groups(found: Multiverse, by: Factor | None) -> dict[str, set[int]]:
    """Group worlds by the value of a factor, or by thirds of its range."""
    if by is None:
        return {"": {world.number for world in found.design.worlds}}
    values = _values(found, by)
    if by.kind == "choice":
        return {
            f"{by.name} {value} {by.unit}".strip(): {i for i, own in enumerate(values) if own == value}
            for value in by.arguments
        }
    numbers = by.numbers(values)
    low, high = np.quantile(numbers, [1 / 3, 2 / 3])
    thirds = {"low": numbers <= low, "middle": (numbers > low) & (numbers <= high), "high": numbers > high}
    return {f"{by.name} {name}": set(np.flatnonzero(where).tolist()) for name, where in thirds.items()}


def _effects(found: Multiverse) -> str:
    factors, shown = found.design.factors, styles(found.controllers)
    chart = _blank("Rank correlation of each factor with survival", Axis("", -1.0, 1.0), len(factors),
                   "rank correlation with survival")  # fmt: skip
    chance = float("nan")
    for row, factor in enumerate(factors):
        chart.label(-1.0, len(factors) - row - 0.38, factor.name)
    for i, name in enumerate(found.controllers):
        rows: pd.DataFrame = found.episodes.loc[found.episodes["controller"] == name]
        up = 1.0 - rows["fell"].to_numpy(float)
        if np.ptp(up) == 0:
            continue
        values, chance = rank_correlations(found.factors([int(world) for world in rows["world"]]), up)
        for row, value in enumerate(values.tolist()):
            y = len(factors) - row - 0.72 + 0.2 * (i / max(len(found.controllers) - 1, 1) - 0.5)
            chart.marker(value, y, shown[name], f"{name}, {factors[row].name}: {value:+.2f}")
    for edge in (-chance, chance):
        chart.reference([edge, edge], [0.0, len(factors)], "chance")
    caption = (
        "Which factors go along with survival: Spearman's rank correlation with no fall, for each controller. Between "
        "the dashed lines chance alone lies in 95 % of the cases. A controller that always or never falls is left out."
    )
    return figure(caption, {"": chart.svg()}, shown)


def _trees(found: Multiverse) -> list[str]:
    """Draw what decides about survival and about each claim, a tree each; the first one open."""
    drawn: list[str] = []
    try:
        for what, decided in all_deciding(found):
            if decided is not None:
                shown = {name: look for name, look in {**SHOWN, **ENDED}.items() if name in decided.classes}
                chart = {"": _tree(decided, found.design.factors, shown)}
                part = figure(f"{what}: {deciding_text(found, decided)}.", chart, shown) + _importance(found, decided)
                drawn.append(details(what, part) if drawn else part)
    except MissingDependencyError as error:
        return [paragraph(f"Which factors decide is not told: {error}", "soft")]
    return drawn or [
        paragraph(f"Which factors decide is not told: it takes two outcomes of {FOLDS} worlds each.", "soft")
    ]


def _tree(decided: Deciding, factors: Sequence[Factor], shown: Mapping[str, Style]) -> str:
    rows = list(_lines(decided.tree, factors, "all worlds", 0))
    chart = Chart("A tree of what decides", Axis("", 0.0, 100.0), Axis("", 0.0, float(len(rows))), WIDE,
                  len(rows) * ROW + 52, frame=False)  # fmt: skip
    for row, (depth, text, counts) in enumerate(rows):
        y = len(rows) - row - 1
        chart.label(7.0 * depth, y + 0.62, f"{text} ({sum(counts)})")
        ordered = [counts[decided.classes.index(name)] for name in shown]
        _stacked(chart, ordered, list(shown.values()), y, 7.0 * depth, 100.0)
        if depth:
            chart.guide([7.0 * depth - 4, 7.0 * depth - 4, 7.0 * depth - 1], [y + 1.0, y + 0.3, y + 0.3])
    return chart.svg()


def _lines(node: Node, factors: Sequence[Factor], text: str, depth: int) -> Iterator[tuple[int, str, tuple[int, ...]]]:
    """Yield nodes from the root on, each with its depth, its condition and its counts."""
    yield depth, text, node.counts
    if node.factor is None or node.below is None or node.above is None:
        return
    factor = factors[node.factor]
    for sign, child in (("≤", node.below), (">", node.above)):
        yield from _lines(child, factors, _condition(factor, sign, node.threshold), depth + 1)


def _condition(factor: Factor, sign: str, threshold: float) -> str:
    places = factor.numbers(factor.arguments) if factor.kind == "choice" else np.zeros(0)
    if factor.categories:
        kept = (places <= threshold) == (sign == "≤")
        words = [str(value) for value, keep in zip(factor.arguments, kept.tolist(), strict=True) if keep]
        return f"{factor.name} {' or '.join(words)}"
    return f"{factor.name} {sign} {threshold:.3g} {factor.unit}".strip()


def _importance(found: Multiverse, decided: Deciding) -> str:
    rows = [
        [factor.name, Cell(f"{100 * value:+.1f}", value), Cell(f"{100 * error:.1f}", error)]
        for factor, value, error in sorted(
            zip(found.design.factors, decided.importance.tolist(), decided.spread.tolist(), strict=True),
            key=lambda row: -row[1],
        )
        if abs(value) > 0.002
    ]
    return (
        table(
            "Points of accuracy that are lost where a factor is permuted", ["factor", "points", "standard error"], rows
        )
        if rows
        else ""
    )


def _ratios(found: Multiverse) -> list[str]:
    charts = {}
    for verdict in found.verdicts:
        known = verdict.margin[np.isfinite(verdict.outcome)]
        if not verdict.claim.compares_errors or not len(known):
            continue
        ratios = np.exp(-known)
        mine, theirs = verdict.claim.controllers
        median = statistics.median(ratios)
        what = "" if verdict.claim.metric is None else f", {verdict.claim.metric}"
        interval = (
            f" ({median.low:.2f}..{median.high:.2f})" if math.isfinite(median.low) else ""
        )  # of six worlds or more
        head = f"{mine} over {theirs}{what}: {median.value:.2f}{interval}"
        charts[head] = _histogram(head, ratios)
    if not charts:
        return [paragraph("No two controllers are compared where both survive.", "soft")]
    caption = (
        "The error of one controller over that of another, world by world, where both survive; above each, its median "
        "with the 95 % interval. Left of the dashed line the first one is better."
    )
    return [figure(caption, charts, {"worlds": SHOWN["holds"]})]


def _histogram(head: str, ratios: np.ndarray) -> str:
    low, high = min(0.0, 1.0), max(1.5, float(np.quantile(ratios, 0.99)))
    counts, edges = np.histogram(np.minimum(ratios, high), bins=COLUMNS, range=(low, high))
    chart = Chart(head, Axis("ratio", low, high), Axis("worlds", 0.0, 1.08 * counts.max()), 340, 210)
    for i, count in enumerate(counts.tolist()):
        if count:
            chart.box(
                (edges[i], edges[i + 1]), (0.0, count), SHOWN["holds"], f"{edges[i]:.2f}..{edges[i + 1]:.2f}: {count}"
            )
    chart.reference([1.0, 1.0], [0.0, 1.08 * counts.max()], "equal")
    return chart.svg()


def _ends(found: Multiverse, verdict: Verdict) -> str:
    """Show commands for the two ends of a claim."""
    if verdict.most_favorable is None or verdict.least_favorable is None:
        return ""
    shown = []
    ends = {verdict.least_favorable: "Least", verdict.most_favorable: "Most"}  # one, where one world alone decides
    for world, what in reversed(ends.items()):
        lines = "\n".join(found.command(world, verdict.claim.controllers))
        shown.append(paragraph(f"{what} favorable: world {world}"))
        shown.append(
            f'<div class="scroll" role="region" aria-label="{what} favorable" tabindex="0"><pre><code>'
            f"{escape(lines)}</code></pre></div>"
        )
    return details(verdict.claim.text, *shown)


def _design(found: Multiverse) -> str:
    rows = [
        [factor.name, Cell(_range(factor), kind="text"), factor.unit, Cell(", ".join(factor.paths), kind="text"),
         Cell(factor.source, kind="text")]
        for factor in found.design.factors
    ]  # fmt: skip
    caption = f"What differs from world to world ({len(found.design.worlds)} worlds, in {found.design.env_id})"
    return table(caption, ["factor", "range", "unit", "path", "source"], rows)


def _range(factor: Factor) -> str:
    values = [f"{value:g}" if isinstance(value, (int, float)) else str(value) for value in factor.arguments]
    if factor.kind == "choice":
        return ", ".join(values)
    kind = {"uniform": "", "log_uniform": ", logarithmic", "quantiles": ", equal shares of the worlds between"}[
        factor.kind
    ]
    return f"{' to '.join(values)}{kind}"
