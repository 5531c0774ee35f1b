"""The robustness frontier: the largest disturbance that each controller survives.

The standard test, the same for all controllers and the default for disturbances, is a walk of Ojas of 12 s in scenario
S2, or a flight of the Q450 of 20 s in scenario Q1 (its payload is not dropped before the end), with the varied number
set to its value. If a push's magnitude is varied, one push for 0.2 s on the chest, or the vehicle, replaces the
scenario's own; so does a pulse of the ground force. Without a default range, the scenario's own are varied. The push
comes from any side with equal probability, at a time drawn uniformly from one stride of steady walking (5 to 7 s) or
half a loop at full speed (6 to 16 s), since a robot is easier to topple in some phases than in others. If a rotor's
loss is varied, it is the front left rotor's, from such a time on.

A level counts as survived if the *observed* share of episodes without a fall is at least `survival`. The bracket holds
the point where the observed share crosses it, for these seeds. The true share lies, with 95 %, in Wilson's interval at
both ends of the bracket: with 18 of 20 survived it is 70 to 97 %. Seeds are the same at every level
and for every controller, so that two frontiers differ by the controllers and not by luck of the draw; they are one
sample of the variation nonetheless. Levels off a controller's path through the bisection are not run: survival that
falls and rises again between them stays unseen. With `grid`, every level is run with every controller, episode by
episode so that an interruption leaves whole curves of fewer episodes behind; in vector environments all levels of all
controllers run side by side. There is then a half point for each controller, see `artde_gym.studies.frontier.half`.

The ground force of the thesis is a grid of its own: `vary="grf_pulse.magnitude", grid=True` in scenario S1 or S2.

    frontier.csv     one row per controller
    levels.csv       one row per tested level and controller
    half.csv         one row a controller, of a grid
    frontier.json    configuration and provenance, written before the first episode
    levels/<value>/  the results folder of each level, see `artde_gym.evaluation.store`
    grid/            in place of those, the results folder of a whole grid, whose scenarios are the levels by number
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from artde_gym.deprecation import takes_old_names
from artde_gym.evaluation import statistics
from artde_gym.evaluation.cells import Cell, engines_of
from artde_gym.evaluation.evaluate import run_plan
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.tasks import Update
from artde_gym.kit import Harder
from artde_gym.scenarios import CUSTOM
from artde_gym.studies.frontier.axis import GAINS, axis
from artde_gym.studies.frontier.bisection import search
from artde_gym.studies.frontier.design import Design
from artde_gym.studies.frontier.half import half_points
from artde_gym.studies.frontier.result import Frontier
from artde_gym.studies.frontier.store import GRID, FrontierStore
from artde_gym.studies.frontier.table import LEVEL_COLUMNS, frontier_of

RECORD_HZ = 10.0  # a frontier has hundreds of episodes; their traces are for viewing a fall, not for metrics


@takes_old_names
@writes_folder
def frontier(
    controllers: Sequence[str | Policy] | Mapping[str, str | Policy],
    env_id: str = "BipedPush-v0",
    vary: str = "push.magnitude",
    *,
    low: float | None = None,
    high: float | None = None,
    tolerance: float | None = None,
    harder: Harder | None = None,
    survival: float = 0.9,
    episodes: int = 20,
    seed: int = 0,
    workers: int = 1,
    out: str | Path | None = None,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    gains: Mapping[str, Mapping[str, Any]] | None = None,
    vectorized: bool = False,
    scenario: str | None = None,
    grid: bool = False,
    allow_mixed: bool = False,
    on_progress: Callable[[float, Update], None] | None = None,
) -> Frontier:
    """Find the hardest value of one disturbance that each controller survives, by bisection or on a whole grid.

    Args:
        controllers: as for `evaluate`.
        env_id: any registered environment of this project.
        vary: "kind.parameter" of `artde_gym.disturbances.DISTURBANCES`, in all entries of a kind that takes several;
            "gains." and a gain of all controllers; or an argument of the environment that is a number.
        low: smallest value, in the parameter's unit (a control period in s); there are defaults for usual paths.
        high: largest value.
        tolerance: width of the bracket to be found.
        harder: whether "larger" or "smaller" values are harder; without, it is what the robot's
            standard test or the kind of disturbance says, else "larger".
        survival: share of episodes without a fall that a level takes to count as survived, above 0 up to 1.
        episodes: of each controller at each level.
        seed: of everything; episode i has the same seed at every level and for every controller.
        workers: processes; the results do not depend on it.
        out: folder to store everything in; the same call continues an interrupted one.
        disturbances: in place of the standard test's; the environment's own duration is then kept, too.
        env_kwargs: arguments of the environment.
        gains: as for `evaluate`, also `vectorized` and `allow_mixed`.
        scenario: whose disturbances and arguments the standard test takes in place of its own scenario's.
        grid: run all levels, not only those on a path through the bisection.
        on_progress: called with the value of the running level and the progress of its episodes.

    Returns:
        The frontier; after an interruption (Ctrl-C), `complete` is False and all finished levels are in it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for an invalid argument, before the first episode.
        StoreError: if `out` holds other results or results of other software, or another process is writing to it.
    """
    plan = Plan.of(
        controllers,
        env_id,
        episodes=episodes,
        seed=seed,
        workers=workers,
        disturbances=disturbances,
        env_kwargs=env_kwargs,
        gains=gains,
        vectorized=vectorized,
        record_hz=RECORD_HZ,
        allow_mixed=allow_mixed,
    )
    design = Design.of(plan, axis(plan.cells[0].env_id, vary, low, high, tolerance, harder), survival, scenario)
    configuration = {**_configuration(plan, design), **({"grid": True} if grid else {})}
    store = None if out is None else FrontierStore(Path(out), configuration, engines_of(plan.cells), allow_mixed)
    return _Levels(plan, design, store, on_progress).search(grid=grid)


def _configuration(plan: Plan, design: Design) -> dict[str, Any]:
    return {
        "env": plan.cells[0].env_id,
        "axis": dataclasses.asdict(design.axis),
        "controllers": list(plan.controllers),  # their content is checked by the levels' folders
        "survival": design.survival,
        "episodes": plan.episodes,
        "seed": plan.seed,
        "disturbances": design.disturbances,
        "env_kwargs": design.arguments,
        "gains": plan.gains,
        "vectorized": plan.vectorized,
    }


class _Levels:
    """The levels of a frontier, run on request of the bisection."""

    def __init__(
        self,
        plan: Plan,
        design: Design,
        store: FrontierStore | None,
        on_progress: Callable[[float, Update], None] | None,
    ) -> None:
        self._plan, self._design, self._store, self._on_progress = plan, design, store, on_progress
        self._rows: list[dict[str, Any]] = []
        self._episodes: pd.DataFrame | None = None

    def search(self, *, grid: bool) -> Frontier:
        """Run the levels until all brackets are found, or the user interrupts."""
        complete = True
        try:
            if grid:
                complete = self._run_all()
            else:
                search(len(self._design.axis.levels), list(self._plan.controllers), self._run)
        except KeyboardInterrupt:
            complete = False
        except Exception:
            if self._store is not None:
                self._store.abandon()
            raise
        found = self._found(complete)
        if self._store is not None:
            self._store.write(found)
        return found

    def _run_all(self) -> bool:
        """Run all levels with all controllers; returns whether this was not interrupted."""
        levels, (cell,) = self._design.axis.levels, self._plan.cells
        cells = tuple(self._design.at(value, cell)._replace(name=str(i)) for i, value in enumerate(levels))
        if self._design.axis.kind == GAINS:
            plans = [
                (self._plan_at(value, cell), f"levels/{value:.10g}") for value, cell in zip(levels, cells, strict=True)
            ]
        else:
            plans = [(dataclasses.replace(self._plan, cells=cells, together=True), GRID)]
        complete, parts = True, []
        for plan, folder in plans:
            result = self._run_plan(plan, folder) if complete else Result(pd.DataFrame(), complete=False)
            complete = result.complete
            parts.append(result.episodes)
        self._episodes = pd.concat(parts, ignore_index=True)
        found = Result(self._episodes)
        for i, name in itertools.product(range(len(levels)), self._plan.controllers):
            self._count(found, str(i), levels[i], name)
        return complete

    def _plan_at(self, value: float, cell: Cell) -> Plan:
        return dataclasses.replace(self._plan, cells=(cell,), gains=self._design.gains_at(value, self._plan))

    def _run_plan(self, plan: Plan, folder: str) -> Result:
        """Run a plan whose cells are levels by number, into a folder within that of the frontier."""
        levels, on_progress = self._design.axis.levels, self._on_progress
        tell = on_progress and (lambda update: on_progress(levels[int(update.task.cell.name)], update))
        return run_plan(plan, None if self._store is None else self._store.path / folder, tell)

    def _count(self, result: Result, scenario: str, value: float, name: str) -> bool:
        """Count a controller's falls at a level, and say whether it survived."""
        if not result.has(scenario, name):
            return False
        falls, rate = result.falls(scenario, name)
        share = statistics.rate(rate.n - falls, rate.n)
        row = (value, name, rate.n, rate.n - falls, *share[:3])
        self._rows.append(dict(zip(LEVEL_COLUMNS, row, strict=True)))
        return share.value >= self._design.survival

    def _run(self, index: int, names: list[str]) -> dict[str, bool]:
        """Run a level with some of the controllers; return which of them survived."""
        value = self._design.axis.levels[index]
        plan = self._plan.only(names, self._design.at(value, self._plan.cells[0]))
        plan = dataclasses.replace(plan, gains=self._design.gains_at(value, plan))
        folder = None if self._store is None else self._store.level(value)
        result = run_plan(plan, folder, self._on_progress and functools.partial(self._on_progress, value))
        if not result.complete:
            raise KeyboardInterrupt
        survived = {name: self._count(result, CUSTOM, value, name) for name in names}
        if self._store is not None:
            self._store.write(self._found(complete=False))
        return survived

    def _found(self, complete: bool) -> Frontier:
        folder = None if self._store is None else self._store.path
        names = list(self._plan.controllers)
        found = frontier_of(self._design.axis, names, self._rows, self._design.survival, folder, complete)
        if self._episodes is None:
            return found
        found = dataclasses.replace(found, episodes=self._episodes)
        return dataclasses.replace(found, half=half_points(found))
