"""Cells: what is run of an environment, as named scenarios or as it is."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from artde_gym.deprecation import current_disturbances
from artde_gym.errors import OptionError
from artde_gym.evaluation import canonical
from artde_gym.evaluation.environments import metrics_spec_of, single, vector, with_engine
from artde_gym.evaluation.metrics import Span
from artde_gym.scenarios import Scenario
from artde_gym.scenarios import scenario as find_scenario

DEFAULT_ENVIRONMENT = "BipedWalk-Payload-v0"
CUSTOM = "custom"
"""Name of the scenario when an environment is evaluated as it is."""


class Cell(NamedTuple):
    """One scenario to run, as plain data that a worker can read."""

    name: str
    env_id: str
    kwargs: dict[str, Any]
    phases: tuple[Span, ...] = ()


def cells_of(
    env_id: str | None,
    names: str | Sequence[str] | None,
    kwargs: Mapping[str, Any] | None,
    disturbances: Mapping[str, Any] | None,
    vectorized: bool = False,
) -> list[Cell]:
    """Find what to run of an environment: named scenarios, or it as it is; arguments as for `evaluate`.

    Each one names the engine that it runs in, so that a folder begun in one engine is not continued in another.

    Raises:
        UnknownNameError, OptionError: for an unknown scenario, or one of another environment.
    """
    if not (env_id is None or isinstance(env_id, str)):
        raise OptionError("env_id", env_id, "the id of an environment, or None")
    kwargs = _mapping("env_kwargs", kwargs or {}, "a mapping of arguments of the environment")
    if "disturbances" in kwargs:
        raise OptionError(
            "env_kwargs", "disturbances", "environment arguments; disturbances have an argument of their own"
        )
    if disturbances is not None:
        disturbances = _mapping("disturbances", disturbances, "a mapping of kinds to their parameters")
        disturbances = current_disturbances(disturbances, told=True)
    if names is None:
        own = {} if disturbances is None else {"disturbances": disturbances}
        env_id = env_id or DEFAULT_ENVIRONMENT
        return [Cell(CUSTOM, env_id, {**with_engine(env_id, kwargs, vectorized), **own})]
    cells = []
    for entry in _scenarios(env_id, names):
        chosen = dict(entry.disturbances if disturbances is None else disturbances)
        arguments = with_engine(entry.env_id, {**entry.kwargs, **kwargs}, vectorized)
        cells.append(Cell(entry.name, entry.env_id, {**arguments, "disturbances": chosen}, entry.phases))
    return cells


def _scenarios(env_id: str | None, names: str | Sequence[str]) -> list[Scenario]:
    """Find the scenarios of these names, all of them of the environment if one is given."""
    if not isinstance(names, Iterable):
        raise OptionError("scenario", names, "a name or several, or None")
    entries = [find_scenario(name) for name in ([names] if isinstance(names, str) else names)]
    if not entries:
        raise OptionError("scenario", names, "at least one name, or None")
    if again := canonical.twice(entry.name for entry in entries):
        raise OptionError("scenario", again, "each name once: its episodes would count twice")
    for entry in entries:
        if env_id not in (None, entry.env_id):
            raise OptionError(f"environment of scenario {entry.name!r}", env_id, repr(entry.env_id))
    return entries


def _mapping(field: str, value: Any, allowed: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise OptionError(field, value, allowed)
    return dict(value)


def validate_cell(vectorized: bool, cell: Cell) -> Any:
    """Build an environment for a cell, whose arguments and disturbances have then been found good.

    Raises:
        OptionError, DisturbanceError: if they are not.
    """
    try:
        json.dumps(cell.kwargs)
    except TypeError as error:
        raise OptionError("env_kwargs", cell.kwargs, "values that JSON can write") from error
    metrics_spec_of(cell.env_id)
    if vectorized:
        return vector_of(cell, 1)
    env, options = single_of(cell)
    env.reset(options=options)
    return env


def single_of(cell: Cell) -> tuple[Any, dict[str, Any] | None]:
    """Build an environment, and options for its resets: cells that differ by disturbances alone share one."""
    if "disturbances" not in cell.kwargs:
        return single(cell.env_id, json.dumps(cell.kwargs)), None
    options = {"disturbances": cell.kwargs["disturbances"]}
    return single(cell.env_id, json.dumps({**cell.kwargs, "disturbances": {}})), options


def vector_of(cell: Cell, size: int) -> Any:
    """Build a vector of `size` environments."""
    return vector(cell.env_id, json.dumps(cell.kwargs), size)
