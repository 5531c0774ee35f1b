"""`artde-gym list`: registered environments, scenarios, controllers, disturbances and frontiers."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from artde_gym.cli.arguments import names
from artde_gym.cli.catalog import TOPICS, Entries
from artde_gym.cli.display import terminal
from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.sim.factory import ENGINES

BATCH = "batch: a vector of many environments at once, by gymnasium.make_vec or --vectorized."

Shown = Callable[[Entries, Console], None]


def list_everything(
    topic: Annotated[
        str | None, typer.Argument(help=f"Topic to show in full: {', '.join(TOPICS)}. Default: a summary of all.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Comma-separated entries of the topic.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """List environments, scenarios, controllers, disturbances.

    Name a topic to see all of its entries with their values: gains, schemas of disturbances, standard frontiers.
    """
    if topic is not None and topic not in TOPICS:
        raise UnknownNameError("topic", topic, suggest_names(topic, TOPICS))
    if name is not None and topic is None:
        raise UnknownNameError("topic", topic, f"{', '.join(TOPICS)}; --name needs one")
    found = {one: TOPICS[one]() for one in (TOPICS if topic is None else [topic])}
    if topic is not None and name is not None:
        found[topic] = _chosen(found[topic], topic, names("--name", name))
    if as_json:
        print(json.dumps(found if topic is None else found[topic], indent=2))
        return
    console = terminal()
    if topic is None:
        _summary(found, console)
    else:
        _FULL[topic](found[topic], console)


def _chosen(entries: Entries, topic: str, wanted: list[str]) -> Entries:
    known = [entry["name"] for entry in entries]
    for name in wanted:
        if name not in known:
            raise UnknownNameError(f"name in {topic}", name, suggest_names(name, known))
    return [entry for entry in entries if entry["name"] in wanted]


def _in_engines(entry: dict[str, Any]) -> str:
    """Return where an environment runs as words; nothing for one without an engine of this project."""
    return f" in {', '.join(entry['engines'])}" if entry["engines"] else ""


def _table(title: str, *columns: str) -> FittingTable:
    return FittingTable(*columns, title=title, title_style="bold")


def _environments_in_full(entries: Entries, console: Console) -> None:
    for entry in entries:
        table = _table(f"{entry['name']}: {entry['robot']}{_in_engines(entry)}", "argument", "default")
        for argument, default in entry["arguments"].items():
            table.add_row(argument, "the environment's own" if argument == "disturbances" else repr(default))
        console.print(table)
    _about_engines(console)
    console.print("Arguments, observation, action and reward are explained by help(gymnasium.make(...).unwrapped)")


def _scenarios_in_full(entries: Entries, console: Console) -> None:
    for entry in entries:
        _head(console, entry["name"], entry["text"])
        beside = "" if entry["thesis"] is None else f"; the thesis' {entry['thesis']}"
        _line(console, f"{entry['environment']}{_in_engines(entry)}{beside}")
        _line(console, f"arguments: {_json(entry['arguments'])}")
        _line(console, f"disturbances: {_json(entry['disturbances'])}")


def _controllers_in_full(entries: Entries, console: Console) -> None:
    for entry in entries:
        _head(console, entry["name"], entry["text"])
        if not entry["presets"]:
            _line(console, f"no presets; made by {entry['entry_point']}")
        for robot in dict.fromkeys(preset["robot"] for preset in entry["presets"]):
            own = [preset for preset in entry["presets"] if preset["robot"] == robot]
            table = _table(f"on {robot}", "gain", "unit")
            for preset in own:
                table.add_column(preset["preset"] + (" *" if preset["default"] else ""), justify="right")
            for gain in dict.fromkeys(gain for preset in own for gain in preset["gains"]):
                values = [preset["gains"].get(gain) for preset in own]
                unit = next(value["unit"] for value in values if value)
                table.add_row(gain, unit, *("" if value is None else _value(value["value"]) for value in values))
            console.print(table)
            for preset in own:
                _line(console, f"{preset['preset']}: {preset['source']}")
    console.print()
    console.print("* default. Suffixes in a quadrotor's cascade: _p position loop, _q attitude loop. Gains without a "
                  "unit are words, or have mixed SI units because Q = I.")  # fmt: skip


def _disturbances_in_full(entries: Entries, console: Console) -> None:
    for entry in entries:
        _head(console, entry["name"] + (" (list)" if entry["list"] else ""), entry["text"])
        _line(console, f"for {', '.join(entry['robots'])}")
        for robot, words in entry["choices"].items():
            for parameter, allowed in words.items():
                _line(console, f"{parameter} on {robot}: {', '.join(allowed)}")
        table = _table("", "parameter", "default", "allowed", "meaning")
        for parameter in entry["parameters"]:
            default = "required" if parameter["required"] else _value(parameter["default"])
            default += "".join(f"\n{robot}: {_value(value)}" for robot, value in parameter["other_defaults"].items())
            bare = " (set by a bare number)" if parameter["name"] == entry["bare_number"] else ""
            kind = parameter["allowed"].replace(", or a distribution of such values", "")
            table.add_row(parameter["name"], default, kind, parameter["text"] + bare)
        console.print(table)
    console.print(Text('Any number may be a distribution: {"uniform": [low, high]}, {"normal": [mean, std]} or '
                       '{"choice": [...]}.'))  # fmt: skip


def _frontiers(entries: Entries, console: Console) -> None:
    """Print one table for all environments with the same ranges."""
    by_environment: dict[str, list[tuple[Any, ...]]] = {}
    for entry in entries:
        numbers = (f"{entry[key]:g}" for key in ("low", "high", "tolerance"))
        by_environment.setdefault(entry["environment"], []).append((entry["name"], *numbers, entry["harder"]))
    alike: dict[tuple[tuple[Any, ...], ...], list[str]] = {}
    for environment, rows in by_environment.items():
        alike.setdefault(tuple(rows), []).append(environment)
    for rows, environments in alike.items():
        _head(console, ", ".join(environments), "ranges of `artde-gym frontier --vary`")
        table = _table("", "varied", "from", "to", "step", "harder")
        for row in rows:
            table.add_row(*row)
        console.print(table)


def _summary(found: dict[str, Entries], console: Console) -> None:
    """Print the names of all entries, grouped where they are many."""
    environments = [{**entry, "engines": ", ".join(entry["engines"])} for entry in found["environments"]]
    _names(console, "Environments", _grouped(environments, "engines"))
    _about_engines(console)
    _names(console, "Scenarios", _grouped(found["scenarios"], "environment"))
    _names(console, "Controllers", {"": _of(found["controllers"])})
    _names(console, "Disturbances", {"": _of(found["disturbances"])})
    frontiers: dict[str, list[str]] = {}
    for environment, varied in _grouped(found["frontiers"], "environment").items():
        frontiers.setdefault(", ".join(varied), []).append(environment)
    of_environments = {", ".join(places): [varied] for varied, places in frontiers.items()}
    _names(console, "Frontiers: parameters of `frontier --vary`", of_environments)
    console.print()
    console.print(f"For details: `artde-gym list` with one of {', '.join(TOPICS)}.")


def _about_engines(console: Console) -> None:
    _line(console, BATCH)
    if missing := [name for name, spec in ENGINES.items() if spec.missing()]:
        _line(console, f"Not installed here: {', '.join(missing)}. `artde-gym doctor` says why.")


def _names(console: Console, title: str, groups: dict[str, list[str]]) -> None:
    console.print()
    console.print(Text(title, style="bold"))
    for group, members in groups.items():
        console.print(Padding(Text((f"{group}: " if group else "") + ", ".join(members)), (0, 0, 0, 2)))


def _of(entries: Entries) -> list[str]:
    return [entry["name"] for entry in entries]


def _grouped(entries: Entries, key: str) -> dict[str, list[str]]:
    groups: dict[str, list[str]] = {}
    for entry in entries:
        groups.setdefault(entry[key], []).append(entry["name"])
    return groups


def _json(value: Any) -> str:
    """Write a value as JSON, without the last digits that products of numbers leave (1.0499999999999998)."""
    return json.dumps(json.loads(json.dumps(value), parse_float=lambda number: float(f"{float(number):.12g}")))


def _head(console: Console, name: str, text: str) -> None:
    console.print()
    console.print(Text.assemble((name, "bold"), f": {text}"))


def _line(console: Console, text: str) -> None:
    console.print(Text(text), style="dim")


def _value(value: Any) -> str:
    if isinstance(value, list):
        if value and isinstance(value[0], list):
            return f"{len(value)} x {len(value)} (--json)"
        return ", ".join(map(_value, value))
    return str(value) if isinstance(value, (str, bool)) else f"{value:.4g}"


_FULL: dict[str, Shown] = {
    "environments": _environments_in_full,
    "scenarios": _scenarios_in_full,
    "controllers": _controllers_in_full,
    "disturbances": _disturbances_in_full,
    "frontiers": _frontiers,
}
