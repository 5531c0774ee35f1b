"""Evaluating controllers: the same seeded episodes for each of them, on several processes."""

from __future__ import annotations

import functools
import itertools
import json
import math
import pickle
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np
import pandas as pd

from artde_gym.arguments import number, whole
from artde_gym.errors import OptionError, UnknownNameError, among
from artde_gym.evaluation import canonical
from artde_gym.evaluation.batch import run_batch
from artde_gym.evaluation.environments import Backend, single, tracking_of, vector, with_engine
from artde_gym.evaluation.identity import behind, identity_of
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.metrics import Span
from artde_gym.evaluation.provenance import provenance
from artde_gym.evaluation.registered import METRICS, require_metrics
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.rollout import Episode, Policy, run_episode
from artde_gym.evaluation.seeds import episode_seed, with_exact_seeds
from artde_gym.evaluation.store import Store
from artde_gym.evaluation.workers import check_workers, run_here, run_parallel
from artde_gym.registration import ControllerSpec, make_controller, register_spec, registered_controllers
from artde_gym.scenarios import Scenario
from artde_gym.scenarios import scenario as find_scenario

DEFAULT_ENVIRONMENT = "BipedWalk-Payload-v0"
CUSTOM = "custom"
"""Name of the scenario when an environment is evaluated as it is."""

MOST_EPISODES = 1_000_000
SLOWEST = 1e-3  # Hz, of stored signals

CHUNK = 2500
"""Episodes at most that run at once in the batch backend: no result depends on it, and more would be little faster."""


class Cell(NamedTuple):
    """One scenario to run, as plain data that a worker can read."""

    name: str
    env_id: str
    kwargs: dict[str, Any]
    phases: tuple[Span, ...] = ()


class Task(NamedTuple):
    """Episodes of one controller that run at once: a single one, or a chunk. The first `traced` leave traces.

    `metrics` are the registered ones that the process must know.
    """

    backend: Backend
    cell: Cell
    controller: str
    policy: Policy | ControllerSpec
    gains: dict[str, Any]
    episodes: list[int]
    seeds: list[int]
    trace_hz: float
    traced: int
    metrics: tuple[str, ...] = ()


class Update(NamedTuple):
    """Progress of an evaluation: one task's simulated time (s), whether it has ended, and how many episodes have."""

    task: Task
    time_s: float
    ended: bool
    finished: int
    total: int


@writes_folder
def evaluate(
    controllers: Sequence[str | Policy] | Mapping[str, str | Policy],
    env_id: str | None = None,
    *,
    scenario: str | Sequence[str] | None = None,
    episodes: int = 20,
    seed: int = 0,
    workers: int = 1,
    out: str | Path | None = None,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    gains: Mapping[str, Mapping[str, Any]] | None = None,
    backend: Backend = "single",
    traced: int | None = None,
    trace_hz: float = 100.0,
    allow_mixed: bool = False,
    on_progress: Callable[[Update], None] | None = None,
) -> Result:
    """Run every controller through the same seeded episodes.

    Args:
        controllers: registered names, or policies with Stable-Baselines3's `predict` (listed under their `name`, else
            their class); as a mapping, under its keys.
        env_id: any registered environment of this project. Scenarios bring their own; with one, it must be theirs.
        scenario: one or several names of `artde_gym.scenarios`; None for the environment as it is.
        episodes: of each controller in each scenario.
        seed: of the whole evaluation; episode i has the same seed for every controller and scenario.
        workers: processes; the results do not depend on it.
        out: folder to store them in; the same call continues an interrupted one. Nothing is stored without it.
        disturbances: in place of the scenario's or the environment's own.
        env_kwargs: arguments of the environment, on top of the scenario's.
        gains: controller name -> gains in place of its preset's.
        backend: "single" for one environment an episode; "batch" for a vector of them in chunks of `CHUNK` episodes,
            which takes an environment with a vector form of its own. Both draw the same disturbances from a seed.
        traced: how many episodes of each controller and scenario leave signals in the folder; None for all of them, or
            none in the batch backend.
        trace_hz: rate of stored signals; infinite for all of them.
        allow_mixed: continue a folder whose episodes other software ran (versions, source code, weights of controllers,
            code of the user's own); its provenance then says so.
        on_progress: called about once a simulated second of each running episode or chunk, and at its end.

    Returns:
        The result; `complete` is False after an interruption (Ctrl-C), with all finished episodes in it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for a bad argument, before the first episode.
        StoreError: if `out` holds other results, or results of other software, or is written by another process.
    """
    whole("episodes", episodes, 1, MOST_EPISODES)
    check_workers(workers)
    whole("seed", seed, 0)
    number("trace_hz", trace_hz, SLOWEST, math.inf, f"a number >= {SLOWEST:g} (Hz), infinite for every sample")
    if backend not in get_args(Backend):
        raise OptionError("backend", backend, among(backend, get_args(Backend)))
    if traced is None:
        traced = episodes if backend == "single" else 0
    whole("traced", traced, 0)
    named = named_controllers(controllers)
    gains = checked_gains(gains, named)
    cells = cells_of(env_id, scenario, dict(env_kwargs or {}), disturbances, backend)
    evidence = _try_out(backend, cells, named, gains)
    if workers > 1:
        check_picklable(named, gains)

    store = None
    if out is not None:
        identities = {name: identity_of(item) for name, item in named.items()}
        configuration = {
            "cells": [{"name": cell.name, "env_id": cell.env_id, "kwargs": cell.kwargs} for cell in cells],
            "controllers": {name: identity.value for name, identity in identities.items()},
            "gains": gains,
            "episodes": episodes,
            "seed": seed,
            "backend": backend,
            "traced": traced,
            "trace_hz": trace_hz if np.isfinite(trace_hz) else "all",
            **({"metrics": sorted(METRICS)} if METRICS else {}),
        }
        made_by = provenance(evidence, {name: identity.by for name, identity in identities.items()})
        store = Store(Path(out), configuration, made_by, allow_mixed=allow_mixed)
    rows = [] if store is None else store.rows
    done = {(row["scenario"], row["controller"], row["episode"]) for row in rows}
    tasks = [
        Task(
            backend,
            cell,
            name,
            policy,
            gains.get(name, {}),
            left,
            [episode_seed(seed, episode) for episode in left],
            trace_hz,
            sum(episode < traced for episode in left),
            tuple(METRICS),
        )
        for chunk in chunks_of(episodes, 1 if backend == "single" else CHUNK)  # outermost: whole pairs are left behind
        for cell in cells
        for name, policy in named.items()
        if (left := [episode for episode in chunk if (cell.name, name, episode) not in done])
    ]
    total = episodes * len(cells) * len(named)
    finished = total - sum(len(task.episodes) for task in tasks)

    def report(task: Task, time: float, ended: bool) -> None:
        nonlocal finished
        finished += ended * len(task.episodes)
        if on_progress is not None:
            on_progress(Update(task, time, ended, finished, total))

    complete = True
    on_time = functools.partial(report, ended=False)
    runs = run_here(run_task, tasks, on_time) if workers == 1 else run_parallel(run_task, tasks, workers, on_time)
    try:
        for task, results in runs:
            report(task, duration_of(results), True)
            labelled = [({**labels_of(task, i), **result.row}, result.traces) for i, result in enumerate(results)]
            if store is None:
                rows += [row for row, _ in labelled]
            else:
                store.add(labelled)
    except KeyboardInterrupt:
        complete = False
    finally:
        runs.close()
    places = {(cell.name, name): i for i, (cell, name) in enumerate(itertools.product(cells, named))}
    rows = sorted(rows, key=lambda row: (row["episode"], places[row["scenario"], row["controller"]]))
    result = Result(with_exact_seeds(pd.DataFrame(rows)), None if store is None else store.folder, complete)
    if store is not None and rows:
        store.finish(rows, result.summary())
    return result


def chunks_of(episodes: int, size: int) -> list[range]:
    """Episodes in equal runs of at most `size`."""
    count = -(-episodes // size)
    edges = [episodes * i // count for i in range(count + 1)]
    return [range(first, stop) for first, stop in itertools.pairwise(edges)]


def labelled(controllers: Any) -> dict[str, str | Policy]:
    """Give each controller the name under which it is listed.

    Raises:
        OptionError: for no controller, a name that is no word, or one that comes twice.
    """
    if isinstance(controllers, str):
        raise OptionError("controllers", controllers, "a list of names or policies")
    if isinstance(controllers, Mapping):
        pairs = list(controllers.items())
    else:
        pairs = [
            (item if isinstance(item, str) else getattr(item, "name", type(item).__name__), item)
            for item in controllers
        ]
    if not pairs:
        raise OptionError("controllers", controllers, "at least one")
    for label, _ in pairs:
        if not isinstance(label, str):
            raise OptionError("name of a controller", label, "a word")
    if again := twice(label for label, _ in pairs):
        raise OptionError("controllers", again, "each name once; give a mapping to tell two of one name apart")
    return dict(pairs)


def twice(names: Iterable[str]) -> str | None:
    """Find a name that comes twice, in whatever spelling."""
    seen: set[str] = set()
    for name in names:
        if canonical.name(name) in seen:
            return name
        seen.add(canonical.name(name))
    return None


def named_controllers(controllers: Any) -> dict[str, Policy | ControllerSpec]:
    """Controllers by the name under which they are listed, names replaced by what they stand for."""
    known = registered_controllers()
    named: dict[str, Policy | ControllerSpec] = {}
    for label, item in labelled(controllers).items():
        if isinstance(item, str):
            if item not in known:
                raise UnknownNameError("controller", item, among(item, known))
            named[label] = known[item]
        elif hasattr(item, "predict"):
            named[label] = item
        else:
            raise OptionError("controllers", item, "a registered name, or an object with `predict`")
    return named


def cells_of(
    env_id: str | None,
    names: str | Sequence[str] | None,
    kwargs: dict[str, Any],
    disturbances: Mapping[str, Any] | None,
    backend: Backend = "single",
) -> list[Cell]:
    """What to run of an environment: named scenarios, or it as it is; arguments as of `evaluate`.

    Each one names the engine it runs in, so that a folder begun in one engine does not go on in another.

    Raises:
        UnknownNameError, OptionError: for an unknown scenario, or one of another environment.
    """
    if "disturbances" in kwargs:
        raise OptionError(
            "env_kwargs", "disturbances", "environment arguments; disturbances have an argument of their own"
        )
    if names is None:
        own = {} if disturbances is None else {"disturbances": dict(disturbances)}
        env_id = env_id or DEFAULT_ENVIRONMENT
        return [Cell(CUSTOM, env_id, {**with_engine(env_id, kwargs, backend), **own})]
    entries: list[Scenario] = [find_scenario(name) for name in ([names] if isinstance(names, str) else names)]
    if not entries:
        raise OptionError("scenario", names, "at least one name, or None")
    if again := twice(entry.name for entry in entries):
        raise OptionError("scenario", again, "each name once: its episodes would count twice")
    for entry in entries:
        if env_id not in (None, entry.env_id):
            raise OptionError(f"environment of scenario {entry.name!r}", env_id, repr(entry.env_id))
    cells = []
    for entry in entries:
        chosen = dict(entry.disturbances if disturbances is None else disturbances)
        arguments = with_engine(entry.env_id, {**entry.kwargs, **kwargs}, backend)
        cells.append(Cell(entry.name, entry.env_id, {**arguments, "disturbances": chosen}, entry.phases))
    return cells


def checked_gains(gains: Any, named: Collection[str]) -> dict[str, dict[str, Any]]:
    """Gains of each controller that has any given, in dictionaries of their own.

    Raises:
        UnknownNameError: for gains of a controller that is not among those named.
        OptionError: if they are not a mapping of controllers to mappings of their gains.
    """
    if gains is None:
        return {}
    if not isinstance(gains, Mapping):
        raise OptionError("gains", gains, "a mapping of controllers to mappings of their gains")
    for name, values in gains.items():
        if name not in named:
            raise UnknownNameError("gains", name, among(name, named))
        if not (isinstance(values, Mapping) and all(isinstance(gain, str) for gain in values)):
            raise OptionError(f"gains of {name!r}", values, "a mapping of its gains")
    return {name: dict(values) for name, values in gains.items()}


def _try_out(
    backend: Backend, cells: list[Cell], named: Mapping[str, Any], gains: Mapping[str, dict[str, Any]]
) -> dict[str, str]:
    """Build everything once, so that a bad argument shows before the first episode and not in a worker.

    Returns what is `behind` the controllers.
    """
    found: dict[str, str] = {}
    for cell in cells:
        env = tried(backend, cell)
        for name, item in named.items():
            found |= behind(name, cell.env_id, item, policy_for(item, env, gains.get(name, {})))
    return found


def check_picklable(named: Mapping[str, Any], gains: Mapping[str, dict[str, Any]]) -> None:
    """See that controllers can be sent to other processes.

    Raises:
        OptionError: if one cannot.
    """
    for name, item in named.items():
        try:
            pickle.dumps((item, gains.get(name)))
        except Exception as error:  # pickling runs code of the policy's class
            allowed = f"one that can be pickled, to be sent to several workers; or workers=1 ({error})"
            raise OptionError(f"controller {name!r}", item, allowed) from error


def tried(backend: Backend, cell: Cell) -> Any:
    """An environment for a scenario, whose arguments and disturbances have been found good.

    Raises:
        OptionError, DisturbanceError: if they are not.
    """
    try:
        json.dumps(cell.kwargs)
    except TypeError as error:
        raise OptionError("env_kwargs", cell.kwargs, "values that JSON can write") from error
    tracking_of(cell.env_id)
    if backend == "batch":
        return _vector(cell, 1)
    env, options = _single(cell)
    env.reset(options=options)
    return env


def labels_of(task: Task, number: int) -> dict[str, Any]:
    """Columns that say which episode a row is of: the task's episode at place `number`."""
    return {
        "controller": task.controller,
        "env": task.cell.env_id,
        "scenario": task.cell.name,
        "seed": task.seeds[number],
        "episode": task.episodes[number],
    }


def run_task(task: Task, on_progress: Callable[[float], None]) -> list[Episode]:
    """Run the episodes of a task; `on_progress` is called with the simulated time (s)."""
    require_metrics(task.metrics)
    options: dict[str, Any] = {"trace_hz": task.trace_hz, "phases": task.cell.phases, "on_progress": on_progress}
    if task.backend == "batch":
        env = _vector(task.cell, len(task.seeds))
        policy = policy_for(task.policy, env, task.gains)
        return run_batch(env, policy, task.seeds, traced=task.traced, **options)
    env, reset_options = _single(task.cell)
    policy = policy_for(task.policy, env, task.gains)
    results = [run_episode(env, policy, seed, options=reset_options, **options) for seed in task.seeds]
    return [result if i < task.traced else Episode(result.row, {}) for i, result in enumerate(results)]


def _single(cell: Cell) -> tuple[Any, dict[str, Any] | None]:
    """An environment, and options for its resets: what differs by its disturbances alone shares an environment."""
    if "disturbances" not in cell.kwargs:
        return single(cell.env_id, json.dumps(cell.kwargs)), None
    options = {"disturbances": cell.kwargs["disturbances"]}
    return single(cell.env_id, json.dumps({**cell.kwargs, "disturbances": {}})), options


def _vector(cell: Cell, size: int) -> Any:
    return vector(cell.env_id, json.dumps(cell.kwargs), size)


def duration_of(results: list[Episode]) -> float:
    """Simulated time (s) of the longest episode."""
    return max(result.row["duration_s"] for result in results)


def policy_for(item: Policy | ControllerSpec, env: Any, gains: dict[str, Any]) -> Policy:
    """What drives an environment: a registered controller built for it, or the policy itself.

    Raises:
        OptionError: for gains of a policy.
        GainError: for a bad gain.
    """
    if isinstance(item, ControllerSpec):
        register_spec(item)  # a worker knows only what this project registers itself
        return make_controller(item.name, env, **gains)
    if gains:
        raise OptionError("gains", gains, "gains of registered names; a policy object has its own")
    return item
