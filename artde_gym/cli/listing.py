"""`artde-gym list`: registered environments, scenarios, controllers, disturbances and frontiers."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from artde_gym.cli.arguments import names
from artde_gym.cli.catalog import TOPICS, Entries
from artde_gym.cli.display import terminal
from artde_gym.errors import UnknownNameError, suggest_names
from artde_gym.evaluation.fitting_table import FittingTable

Shown = Callable[[Entries, Console], None]


def list_everything(
    topic: Annotated[
        str | None, typer.Argument(help=f"Topic to show in full: {', '.join(TOPICS)}. Default: a summary of all.")
    ] = None,
    name: Annotated[str | None, typer.Option(help="Comma-separated entries of the topic.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """List environments, scenarios, controllers with their gains, disturbances with their schemas, and frontiers."""
    if topic is not None and topic not in TOPICS:
        raise UnknownNameError("topic", topic, suggest_names(topic, TOPICS))
    if name is not None and topic is None:
        raise UnknownNameError("topic", topic, f"{', '.join(TOPICS)}; --name needs one")
    found = {one: TOPICS[one]() for one in (TOPICS if topic is None else [topic])}
    if topic is not None and name is not None:
        found[topic] = _chosen(found[topic], topic, names(name))
    if as_json:
        print(json.dumps(found if topic is None else found[topic], indent=2))
        return
    console = terminal()
    for one, entries in found.items():
        (_SHORT if topic is None else _FULL)[one](entries, console)
    if topic is None:
        console.print(f"For details: `artde-gym list` with one of {', '.join(TOPICS)}.")


def _chosen(entries: Entries, topic: str, wanted: list[str]) -> Entries:
    known = [entry["name"] for entry in entries]
    for name in wanted:
        if name not in known:
            raise UnknownNameError(f"name in {topic}", name, suggest_names(name, known))
    return [entry for entry in entries if entry["name"] in wanted]


def _table(title: str, *columns: str) -> FittingTable:
    return FittingTable(*columns, title=title, title_style="bold")


def _environments(entries: Entries, console: Console) -> None:
    table = _table("Environments", "environment", "robot", "engines")
    for entry in entries:
        table.add_row(entry["name"], entry["robot"], ", ".join(entry["engines"]))
    console.print(table)


def _environments_in_full(entries: Entries, console: Console) -> None:
    for entry in entries:
        table = _table(f"{entry['name']}: {entry['robot']} in {', '.join(entry['engines'])}", "argument", "default")
        for argument, default in entry["arguments"].items():
            table.add_row(argument, "the environment's own" if argument == "disturbances" else repr(default))
        console.print(table)
    console.print("Arguments, observation, action and reward are explained by help(gymnasium.make(...).unwrapped)")


def _scenarios(entries: Entries, console: Console) -> None:
    table = _table("Scenarios", "scenario", "description")
    for entry in entries:
        arguments = "".join(f", {key}={value}" for key, value in entry["arguments"].items())
        table.add_row(entry["name"], _with_detail(entry["text"], entry["environment"] + arguments))
    console.print(table)


def _scenarios_in_full(entries: Entries, console: Console) -> None:
    for entry in entries:
        _head(console, entry["name"], entry["text"])
        beside = "" if entry["thesis"] is None else f"; the thesis' {entry['thesis']}"
        _line(console, f"{entry['environment']} in {', '.join(entry['engines'])}{beside}")
        _line(console, f"arguments: {json.dumps(entry['arguments'])}")
        _line(console, f"disturbances: {json.dumps(entry['disturbances'])}")


def _controllers(entries: Entries, console: Console) -> None:
    table = _table("Controllers", "controller", "description, gains, presets")
    for entry in entries:
        presets: dict[str, list[str]] = {}
        for preset in entry["presets"]:
            presets.setdefault(preset["robot"], []).append(preset["preset"])
        detail = [" ".join(entry["gains"]), "; ".join(f"{robot}: {', '.join(own)}" for robot, own in presets.items())]
        table.add_row(entry["name"], _with_detail(entry["text"], *filter(None, detail)))
    console.print(table)


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


def _disturbances(entries: Entries, console: Console) -> None:
    table = _table("Disturbances", "kind", "description, robots, parameters")
    for entry in entries:
        parameters = ", ".join(parameter["name"] for parameter in entry["parameters"])
        name = entry["name"] + (" (list)" if entry["list"] else "")
        table.add_row(name, _with_detail(entry["text"], f"{', '.join(entry['robots'])}: {parameters}"))
    console.print(table)


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
    table = _table("Frontiers", "varied", "environment", "from", "to", "step", "harder")
    for entry in entries:
        numbers = (f"{entry[key]:g}" for key in ("low", "high", "tolerance"))
        table.add_row(entry["name"], entry["environment"], *numbers, entry["harder"])
    console.print(table)


def _with_detail(text: str, *details: str) -> Text:
    return Text.assemble(text, *((f"\n{detail}", "dim") for detail in details))


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


_SHORT: dict[str, Shown] = {
    "environments": _environments,
    "scenarios": _scenarios,
    "controllers": _controllers,
    "disturbances": _disturbances,
    "frontiers": _frontiers,
}
_FULL: dict[str, Shown] = {
    "environments": _environments_in_full,
    "scenarios": _scenarios_in_full,
    "controllers": _controllers_in_full,
    "disturbances": _disturbances_in_full,
    "frontiers": _frontiers,
}
