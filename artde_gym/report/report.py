"""The file `report.html` of a results folder."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path
from typing import Any

from artde_gym.arguments import wrap_read_errors
from artde_gym.errors import OptionError, StoreError
from artde_gym.evaluation.environments import physics_of, robot_of
from artde_gym.evaluation.provenance import MIXED
from artde_gym.evaluation.store import write_atomically
from artde_gym.report import frontier_page, multiverse_page, signals, tables, training_page
from artde_gym.report.answer import headline, sentences
from artde_gym.report.html import bullets, page, paragraph, section
from artde_gym.report.laws import Laws, unavailable
from artde_gym.report.pictures import Progress, SnapshotSet
from artde_gym.report.replays import replay_of
from artde_gym.report.robot import figures_of, with_strip
from artde_gym.report.run import Episode, Run
from artde_gym.scenarios import SCENARIOS
from artde_gym.studies.frontier.result import RECORD
from artde_gym.studies.multiverse.result import last_run, read_multiverse

NAME = "report.html"
_LAST = ("Reference and loop", "Provenance")


def write_report(
    folder: str | Path, *, pictures: bool = False, videos: bool = False, on_progress: Progress = lambda _: None
) -> Path:
    """Write the report of an evaluation, a study or a training into its folder, finished or interrupted.

    Args:
        folder: results folder of `evaluate`, `reproduce`, `frontier`, `multiverse` or `train`.
        pictures: whether to rerun an evaluation's shown episodes for snapshots of motion, pushes and falls.
        videos: whether to rerun them for a video of each scenario (about a megabyte each).
        on_progress: called with the figure being drawn.

    Returns:
        The report's file.

    Raises:
        StoreError: if the folder has nothing to report.
        OptionError: for pictures or videos of anything but an evaluation.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise StoreError(
            "results folder", str(folder), "a folder that `evaluate`, `frontier`, `multiverse` or `train` wrote"
        )
    study = _study(folder)
    for name, asked in (("pictures", pictures), ("videos", videos)):
        if asked and study is not None:
            raise OptionError(name, asked, "leave it out", "goes with the results of `evaluate` and `reproduce` alone")
    wanted = "one that `evaluate`, `frontier`, `multiverse` or `train` of this release wrote"
    with wrap_read_errors("results folder", folder, wanted, StoreError):
        if study is not None:
            text = study(folder)
        else:
            run = Run.read(folder)
            text = _evaluation(run, SnapshotSet(run, pictures, videos, on_progress))
    write_atomically(folder / NAME, lambda file: file.write(text.encode()))
    return folder / NAME


def _study(folder: Path) -> Callable[[Path], str] | None:
    """Return what writes the report of a study's or a training's folder; None for that of an evaluation."""
    if (folder / RECORD).exists():
        return _frontier
    if (folder / training_page.RECORD).exists():
        return lambda folder: _training(training_page.read_training(folder))
    return None if last_run(folder) is None else _multiverse


def _evaluation(run: Run, album: SnapshotSet) -> str:
    result = run.result
    if not len(result.episodes):
        return page("artde-gym report", ["<h1>No episode was finished yet</h1>", _origin(run.record)])
    trackings = {scenario: run.tracking(scenario) for scenario in result.scenarios}
    said = {scenario: sentences(result, scenario, trackings[scenario]) for scenario in result.scenarios}
    title = f"{', '.join(result.controllers)} in {', '.join(result.scenarios)}"
    lone = len(said) == 1
    short = said if lone else {scenario: lines[:2] for scenario, lines in said.items()}
    body = [f"<h1>{escape(title)}</h1>", _answer(headline(result, trackings), short)]
    if not result.complete:
        body.append(paragraph("Interrupted or still running: the report covers the finished episodes."))
    body.append(_contents([*(["Claims"] if run.claims is not None else []), *result.scenarios, *_LAST]))
    if run.claims is not None:
        body.append(_anchored("Claims", tables.claims(run.claims)))
    laws = Laws(run)
    body += [_scenario(run, laws, album, name, [] if lone else lines) for name, lines in said.items()]
    body += [_anchored("Reference and loop", *_plants(run)), _anchored("Provenance", _origin(run.record))]
    return page(f"artde-gym: {title}", body)


def _plants(run: Run) -> list[str]:
    """Return the parts common to scenarios: each robot's loop once, and each of its references once."""
    parts: dict[str, list[str]] = {}
    for scenario in run.result.scenarios:
        cell = run.cell(scenario)
        figures = figures_of(robot_of(cell["env_id"]))
        if figures is not None:
            parts |= {key: part for key, part in figures.reference(cell["kwargs"]).items() if key not in parts}
    return [part for several in parts.values() for part in several]


def _scenario(run: Run, laws: Laws, album: SnapshotSet, scenario: str, said: list[str]) -> str:
    entry, cell = SCENARIOS.get(scenario), run.cell(scenario)
    place = f"{cell['env_id']} in {physics_of(cell['kwargs'])}"
    parts = [paragraph(f"{place}: {entry.text}." if entry else f"{place}.", "soft")]
    parts += [bullets(said) if said else "", tables.falls(run, scenario)]
    if run.result.episodes.loc[run.result.episodes["scenario"] == scenario, "fell"].any():
        parts.append(tables.survival(run, scenario))
    parts += replay_of(run, scenario)
    parts += album.figures(scenario)
    parts += tables.metrics(run, scenario)
    parts += [tables.watched(run, scenario), tables.events(run, scenario)]
    episode = run.episode(scenario)
    if episode is None:
        parts.append(paragraph("No signals were stored for this scenario, so there are no plots over time.", "soft"))
    else:
        parts += _episode(run, laws, scenario, episode)
    return _anchored(scenario, *parts)


def _episode(run: Run, laws: Laws, scenario: str, episode: Episode) -> list[str]:
    robot = robot_of(run.cell(scenario)["env_id"])
    tracking, episode = run.tracking(scenario), with_strip(robot, episode)
    parts = [*signals.tracking_error(episode, tracking), signals.gains(episode)]
    try:
        matrix = laws.lyapunov_matrix(scenario)
        if matrix is not None:
            parts.append(signals.lyapunov(episode, tracking, matrix))
        inside = laws.section(scenario)
    except ValueError as error:  # a controller, a gain or an environment that no longer exists
        inside = [unavailable(error)]
    figures = figures_of(robot)
    return [*parts, *([] if figures is None else figures.figures(episode)), *inside]


def _frontier(folder: Path) -> str:
    found, record = frontier_page.read_frontier(folder)
    head, lines = frontier_page.answer(found)
    wanted = record["configuration"]
    title = f"Frontier of {found.axis.path} in {wanted['env']}"
    body = [f"<h1>{escape(title)}</h1>", _answer(head, {"": lines})]
    if not found.complete:
        body.append(paragraph("Interrupted or still running: the report covers the finished levels."))
    body += frontier_page.parts(found)
    body.append(_anchored("Provenance", _origin(record)))
    return page(f"artde-gym: {title}", body)


def _multiverse(folder: Path) -> str:
    found = read_multiverse(folder)
    origin = {"provenance": found.provenance, "configuration": json.loads(found.design.text)}
    title = f"Claims over plausible worlds of {found.design.env_id}"
    body = [f"<h1>{escape(title)}</h1>"]
    if found.episodes.empty:
        raise StoreError("multiverse", str(folder), "run the command that made it again", "has no finished episode")
    head, lines = multiverse_page.answer(found)
    body.append(_answer(head, {"": lines}))
    if not found.complete:
        body.append(paragraph("Interrupted or still running: this holds the episodes that were finished."))
    sections = list(multiverse_page.parts(found))
    body.append(_contents([*(name for name, _ in sections), "Provenance"]))
    body += [_anchored(name, *drawn) for name, drawn in sections]
    body.append(_anchored("Provenance", _origin(origin)))
    return page(f"artde-gym: {title}", body)


def _training(run: training_page.Trained) -> str:
    head, lines = training_page.answer(run)
    title = f"Training of {run.name} in {run.record['configuration']['env_id']}"
    body = [f"<h1>{escape(title)}</h1>", _answer(head, {"": lines}), *training_page.parts(run)]
    packages = {"packages": ", ".join(f"{name} {version}" for name, version in run.record["versions"].items())}
    body.append(_anchored("Provenance", _facts(packages, run.record["configuration"])))
    return page(f"artde-gym: {title}", body)


def _answer(head: str, said: Mapping[str, list[str]]) -> str:
    parts = [f"<p><strong>{escape(head)}</strong></p>"]
    for name, lines in said.items():
        parts.append(bullets(lines) if len(said) == 1 else paragraph(f"{name}: {' '.join(lines)}"))
    return '<section class="answer"><h2>The answer</h2>' + "".join(parts) + "</section>"


def _contents(titles: list[str]) -> str:
    links = "".join(f'<li><a href="#{_anchor(title)}">{escape(title)}</a></li>' for title in titles)
    return f'<nav aria-label="Contents"><ul>{links}</ul></nav>'


def _anchored(title: str, *parts: str) -> str:
    return f'<div id="{_anchor(title)}">{section(title, *parts)}</div>'


def _anchor(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower())


def _origin(record: Mapping[str, Any]) -> str:
    """Return everything needed to reproduce the run."""
    origin = record["provenance"]
    facts = {
        "command": origin["command"],
        "time": origin["time"],
        "commit": origin["commit"] or "of an installed package",
        "Python": f"{origin['python']} on {origin['platform']}",
        "packages": _packages(origin),
    }
    if origin.get("engines"):
        facts["engines"] = ", ".join(f"{name}: {how}" for name, how in origin["engines"].items())
    for i, other in enumerate(origin.get(MIXED, []), start=1):
        facts[f"mixed with results of other software ({i})"] = f"commit {other['commit']}: {_packages(other)}"
    return _facts(facts, record["configuration"])


def _packages(origin: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {version}" for name, version in origin["packages"].items())


def _facts(facts: Mapping[str, str], configuration: Mapping[str, Any]) -> str:
    rows = "".join(f"<dt>{escape(key)}</dt><dd><code>{escape(str(value))}</code></dd>" for key, value in facts.items())
    whole = escape(json.dumps(configuration, indent=1))
    return (
        f"<dl>{rows}</dl><details><summary>Full configuration</summary>"
        '<div class="scroll" role="region" aria-label="Full configuration" tabindex="0">'
        f"<pre><code>{whole}</code></pre></div></details>"
    )
