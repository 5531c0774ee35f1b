"""Cells: the environments to run, from named scenarios or from plain arguments."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from artde_gym.deprecation import current_disturbances
from artde_gym.errors import OptionError
from artde_gym.evaluation import canonical
from artde_gym.evaluation.environments import metrics_spec_of, single, vector, vector_of_one, with_engine
from artde_gym.evaluation.metrics import Span
from artde_gym.scenarios import CUSTOM, Scenario
from artde_gym.scenarios import scenario as find_scenario

DEFAULT_ENVIRONMENT = "BipedWalk-Payload-v0"


class Cell(NamedTuple):
    """One scenario to run, as plain data that can be sent to a worker.

    `engine_asked` tells whether its engine was asked for; else it is the default of this machine.
    """

    name: str
    env_id: str
    kwargs: dict[str, Any]
    phases: tuple[Span, ...] = ()
    engine_asked: bool = False


def cells_of(
    env_id: str | None,
    names: str | Sequence[str] | None,
    kwargs: Mapping[str, Any] | None,
    disturbances: Mapping[str, Any] | None,
    vectorized: bool = False,
) -> list[Cell]:
    """Return the cells to run: the named scenarios, or the environment itself; arguments as for `evaluate`.

    Each cell names its engine, so that a folder begun in one engine is not continued in another.

    Raises:
        UnknownNameError, OptionError: for an unknown scenario, or a scenario of another environment.
    """
    if not (env_id is None or isinstance(env_id, str)):
        raise OptionError("env_id", env_id, "the id of an environment, or None")
    kwargs = _mapping("env_kwargs", kwargs or {}, "a mapping of environment arguments")
    if "disturbances" in kwargs:
        raise OptionError("argument in env_kwargs", "disturbances", "pass it as `disturbances`", "has its own place")
    if disturbances is not None:
        disturbances = _mapping("disturbances", disturbances, "a mapping of kinds to their parameters")
        disturbances = current_disturbances(disturbances, told=True)
    if names is None:
        own = {} if disturbances is None else {"disturbances": disturbances}
        env_id = DEFAULT_ENVIRONMENT if env_id is None else env_id
        arguments = {**with_engine(env_id, kwargs, vectorized), **own}
        return [Cell(CUSTOM, env_id, arguments, engine_asked=_asked(kwargs))]
    cells = []
    for entry in _scenarios(env_id, names):
        chosen = dict(entry.disturbances if disturbances is None else disturbances)
        given = {**entry.kwargs, **kwargs}
        arguments = {**with_engine(entry.env_id, given, vectorized), "disturbances": chosen}
        cells.append(Cell(entry.name, entry.env_id, arguments, entry.phases, _asked(given)))
    return cells


def _asked(kwargs: Mapping[str, Any]) -> bool:
    """Tell whether an engine was asked for."""
    return kwargs.get("engine") is not None


def engines_of(cells: Iterable[Cell]) -> dict[str, str]:
    """Return the engines of some cells, with what chose each one: "asked for", "default", or both."""
    chosen: dict[str, set[str]] = {}
    for cell in cells:
        if (name := cell.kwargs.get("engine")) is not None:
            chosen.setdefault(name, set()).add("asked for" if cell.engine_asked else "default")
    return {name: " and ".join(sorted(how)) for name, how in chosen.items()}


def _scenarios(env_id: str | None, names: str | Sequence[str]) -> list[Scenario]:
    """Return the scenarios of these names; all of them must belong to the environment if one is given."""
    if not isinstance(names, Iterable):
        raise OptionError("scenario", names, "a name, several names, or None")
    entries = [find_scenario(name) for name in ([names] if isinstance(names, str) else names)]
    if not entries:
        raise OptionError("scenario", names, "at least one name, or None")
    if again := canonical.twice(entry.name for entry in entries):
        raise OptionError("scenario", again, "give each name once", "is given twice")
    for entry in entries:
        if env_id not in (None, entry.env_id):
            raise OptionError(f"environment of scenario {entry.name!r}", env_id, repr(entry.env_id))
    return entries


def _mapping(field: str, value: Any, allowed: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise OptionError(field, value, allowed)
    return dict(value)


def validate_cell(vectorized: bool, cell: Cell) -> Any:
    """Build an environment for a cell, which validates its arguments and disturbances.

    Raises:
        OptionError, DisturbanceError: for an invalid argument or disturbance.
    """
    try:
        json.dumps(cell.kwargs)
    except TypeError as error:
        raise OptionError("env_kwargs", cell.kwargs, "values that JSON can store") from error
    metrics_spec_of(cell.env_id)
    env, options = vector_of([cell], vector_of_one) if vectorized else single_of(cell)
    env.reset(options=options)
    return env


def single_of(cell: Cell) -> tuple[Any, dict[str, Any] | None]:
    """Return an environment, and options for its resets; cells that differ only by disturbances share one."""
    env = single(cell.env_id, json.dumps(shared_kwargs(cell)))
    return env, {"disturbances": cell.kwargs["disturbances"]} if "disturbances" in cell.kwargs else None


def vector_of(cells: Sequence[Cell], build: Callable[..., Any] = vector) -> tuple[Any, dict[str, Any] | None]:
    """Build a vector with one environment a cell, which differ by disturbances alone, and options for its resets."""
    first = cells[0]
    env = build(first.env_id, json.dumps(shared_kwargs(first)), len(cells))
    if "disturbances" not in first.kwargs:
        return env, None
    return env, {"disturbances": [cell.kwargs["disturbances"] for cell in cells]}


def shared_kwargs(cell: Cell) -> dict[str, Any]:
    """Return the arguments that cells of one environment share: disturbances come with each reset."""
    return {**cell.kwargs, "disturbances": {}} if "disturbances" in cell.kwargs else cell.kwargs
