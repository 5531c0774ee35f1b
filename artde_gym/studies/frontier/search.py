"""The robustness frontier: how much of one disturbance each controller survives.

The standard test, the same for all controllers and used where no disturbances are given, is a walk of Ojas of 12 s in
scenario S2, or a flight of the Q450 of 20 s in scenario Q1 (its payload is not dropped before the end), with what is
varied set to its value. Where a push is varied, there is one push for 0.2 s on the chest, or the vehicle, in place of
the scenario's own, from any side with equal probability, at a time drawn uniformly from one stride of steady walking (5
to 7 s) or half a loop at full speed (6 to 16 s): a robot is easier to topple in some phases than in others, and nobody
chooses when he is pushed. Where a rotor's loss is varied, it is the front left one's, from such a time on.

A level counts as survived if the *observed* share of episodes without a fall is at least `survival`. The bracket holds
the point where the observed share crosses it, for these seeds. What n episodes say about the true share is Wilson's
95 % interval at both ends of the bracket: with 18 of 20 survived it is 70 to 97 %. Seeds are the same at every level
and for every controller, so that two frontiers differ by the controllers and not by luck of the draw; they are one
sample of the variation nonetheless. Levels off a controller's path through the bisection are not run: survival that
falls and rises again between them stays unseen.

    frontier.csv     one row a controller
    levels.csv       one row a tested level and controller
    frontier.png     survival against the varied value
    frontier.json    configuration and provenance, written before the first episode
    levels/<value>/  the results folder of each level, see `artde_gym.evaluation.store`
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from artde_gym.deprecation import takes_old_names
from artde_gym.evaluation import statistics
from artde_gym.evaluation.cells import CUSTOM
from artde_gym.evaluation.evaluate import run_plan
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.tasks import Update
from artde_gym.kit import Harder
from artde_gym.studies.frontier.axis import axis
from artde_gym.studies.frontier.bisection import search
from artde_gym.studies.frontier.design import Design
from artde_gym.studies.frontier.result import Frontier
from artde_gym.studies.frontier.store import FrontierStore
from artde_gym.studies.frontier.table import LEVEL_COLUMNS, frontier_of

RECORD_HZ = 10.0  # a frontier has hundreds of episodes; their traces are for a look at a fall, not for metrics


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
    allow_mixed: bool = False,
    on_progress: Callable[[float, Update], None] | None = None,
) -> Frontier:
    """Find by bisection the hardest value of one disturbance that each controller survives.

    Args:
        controllers: as for `evaluate`.
        env_id: any registered environment of this project.
        vary: "kind.parameter" of `artde_gym.disturbances.DISTURBANCES`, in all entries of a kind that takes several;
            or an argument of the environment that is a number.
        low: smallest value, in the parameter's unit (a control period in s); there are defaults for usual paths.
        high: largest value.
        tolerance: width of the bracket to be found.
        harder: whether "larger" or "smaller" values are harder; there are defaults for usual paths.
        survival: share of episodes without a fall that a level takes to count as survived, above 0 up to 1.
        episodes: of each controller at each level.
        seed: of everything; episode i has the same seed at every level and for every controller.
        workers: processes; the results do not depend on it.
        out: folder to store everything in; the same call continues an interrupted one.
        disturbances: in place of the standard test's; the environment's own duration is then kept, too.
        env_kwargs: arguments of the environment.
        gains: as for `evaluate`, also `vectorized` and `allow_mixed`.
        on_progress: called with the value of the running level and the progress of its episodes.

    Returns:
        The frontier; `complete` is False after an interruption (Ctrl-C), with all finished levels in it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for a bad argument, before the first episode.
        StoreError: if `out` holds other results, or results of other software, or is written by another process.
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
    design = Design.of(plan, axis(plan.cells[0].env_id, vary, low, high, tolerance, harder), survival)
    store = None if out is None else FrontierStore(Path(out), _configuration(plan, design), allow_mixed)
    return _Levels(plan, design, store, on_progress).search()


def _configuration(plan: Plan, design: Design) -> dict[str, Any]:
    return {
        "env": plan.cells[0].env_id,
        "axis": dataclasses.asdict(design.axis),
        "controllers": list(plan.controllers),  # what they stand for is checked by the folders of the levels
        "survival": design.survival,
        "episodes": plan.episodes,
        "seed": plan.seed,
        "disturbances": design.disturbances,
        "env_kwargs": design.arguments,
        "gains": plan.gains,
        "vectorized": plan.vectorized,
    }


class _Levels:
    """The levels of a frontier, run where the bisection asks for them."""

    def __init__(
        self,
        plan: Plan,
        design: Design,
        store: FrontierStore | None,
        on_progress: Callable[[float, Update], None] | None,
    ) -> None:
        self._plan, self._design, self._store, self._on_progress = plan, design, store, on_progress
        self._rows: list[dict[str, Any]] = []

    def search(self) -> Frontier:
        """Run the levels until all brackets are found, or the user interrupts."""
        complete = True
        try:
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
            if self._rows:
                self._store.draw(found)
        return found

    def _run(self, index: int, names: list[str]) -> dict[str, bool]:
        """Run a level with some of the controllers, and say which of them survived it."""
        value = self._design.axis.levels[index]
        plan = self._plan.only(names, self._design.at(value, self._plan.cells[0]))
        folder = None if self._store is None else self._store.level(value)
        result = run_plan(plan, folder, self._on_progress and functools.partial(self._on_progress, value))
        if not result.complete:
            raise KeyboardInterrupt
        survived: dict[str, bool] = {}
        for name in names:
            falls, rate = result.falls(CUSTOM, name)
            share = statistics.rate(rate.n - falls, rate.n)
            survived[name] = share.value >= self._design.survival
            row = (value, name, rate.n, rate.n - falls, *share[:3])
            self._rows.append(dict(zip(LEVEL_COLUMNS, row, strict=True)))
        if self._store is not None:
            self._store.write(self._found(complete=False))
        return survived

    def _found(self, complete: bool) -> Frontier:
        folder = None if self._store is None else self._store.path
        names = list(self._plan.controllers)
        return frontier_of(self._design.axis, names, self._rows, self._design.survival, folder, complete)
