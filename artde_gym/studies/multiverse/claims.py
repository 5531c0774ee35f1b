"""Claims over worlds, as data: each world bears one out, leaves it open, or reverses it; each robot brings its own."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from artde_gym.arrays import Array
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.registry import Registry

Outcome = Literal["holds", "tie", "reverses"]
OUTCOMES: dict[Outcome, float] = {"holds": 1.0, "tie": 0.0, "reverses": -1.0}
"""A world's outcome as a number; NaN where the claim says nothing of it."""


class Judged(NamedTuple):
    """Outcome (`OUTCOMES`) and margin of a claim in each world; the larger a margin, the more it is in its favor."""

    outcome: Array
    margin: Array


class WorldTable:
    """Outcomes in the worlds that all of some controllers have met: tables of one row a world, one column each.

    Args:
        episodes: with columns `world` and `controller`.
        main: name of the main error.
        controllers: which ones.
    """

    def __init__(self, episodes: pd.DataFrame, main: str, controllers: Sequence[str]) -> None:
        self.main = main
        self._names = list(controllers)
        rows: pd.DataFrame = episodes.loc[episodes["controller"].isin(self._names)]
        met = rows.groupby("world")["controller"].transform("nunique") == len(self._names)
        self._rows: pd.DataFrame = rows.loc[met]

    @property
    def worlds(self) -> list[int]:
        """Their numbers."""
        return [int(number) for number in self.duration.index]

    @functools.cached_property
    def fell(self) -> pd.DataFrame:
        """True if the episode ended in a fall."""
        return self.metric("fell").astype(bool)

    @functools.cached_property
    def duration(self) -> pd.DataFrame:
        """Duration of the episode (s)."""
        return self.metric("duration_s")

    def metric(self, name: str) -> pd.DataFrame:
        """Return any column of the episodes.

        Raises:
            UnknownNameError: if there is none of this name.
        """
        if name not in self._rows:
            raise UnknownNameError("metric", name, suggest_names(name, [str(column) for column in self._rows]))
        return self._rows.pivot(index="world", columns="controller", values=name).reindex(columns=self._names)


Judge: TypeAlias = Callable[[WorldTable], Judged]


@dataclasses.dataclass(frozen=True)
class WorldClaim:
    """A statement that each world can decide.

    Attributes:
        text: the statement.
        controllers: of which it is made.
        judge: worlds -> outcomes and margins.
        compares_errors: whether the margin is the logarithm of the second controller's error over the first one's.
        metric: that it compares; None for none, or for one that every table has.
    """

    text: str
    controllers: tuple[str, ...]
    judge: Judge
    compares_errors: bool = False
    metric: str | None = None


def survives(more: str, less: str) -> WorldClaim:
    """`more` survives where `less` falls; a tie where both survive or both fall."""

    def judge(found: WorldTable) -> Judged:
        outcome = found.fell[less].to_numpy(float) - found.fell[more].to_numpy(float)
        return Judged(outcome, (found.duration[more] - found.duration[less]).to_numpy())

    return WorldClaim(f"{more} survives where {less} falls", (more, less), judge)


def smaller(first: str, second: str, metric: str | None = None) -> WorldClaim:
    """`first` has the smaller metric, by default the main RMS error, where both survive."""

    def judge(found: WorldTable) -> Judged:
        table = found.metric(found.main if metric is None else metric)
        mine, theirs = (table[name].to_numpy(float) for name in (first, second))
        both = ~(found.fell[first] | found.fell[second]).to_numpy() & np.isfinite(mine) & np.isfinite(theirs)
        with np.errstate(divide="ignore", invalid="ignore"):
            margin = np.where(both, np.log(theirs / mine), np.nan)
        return Judged(np.where(both, np.sign(theirs - mine), np.nan), margin)

    what = "RMS error" if metric is None else metric
    text = f"{what} of {first} below that of {second}, both surviving"
    return WorldClaim(text, (first, second), judge, compares_errors=True, metric=metric)


def ordered(*names: str) -> WorldClaim:
    """Survival never gets worse along the names, and does get better: holds; all alike: a tie; else it reverses."""

    def judge(found: WorldTable) -> Judged:
        up = 1.0 - found.fell[list(names)].to_numpy(float)
        steps = np.diff(up, axis=1)
        outcome = np.where((steps < 0).any(axis=1), -1.0, (steps > 0).any(axis=1).astype(float))
        return Judged(outcome, (found.duration[names[-1]] - found.duration[names[0]]).to_numpy())

    text = f"survival in the order {' <= '.join(names)}, not all alike"
    return WorldClaim(text, names, judge)


def pattern(expected: Mapping[str, bool]) -> WorldClaim:
    """Each controller falls (True) or survives (False) as expected; it reverses where all do the opposite."""
    names = tuple(expected)

    def judge(found: WorldTable) -> Judged:
        as_said = np.array([found.fell[name].to_numpy() == fell for name, fell in expected.items()])
        times = found.duration
        last = [times[name].to_numpy() for name, fell in expected.items() if not fell] or [np.zeros(len(times))]
        first = [times[name].to_numpy() for name, fell in expected.items() if fell] or [np.zeros(len(times))]
        outcome = as_said.all(axis=0).astype(float) - (~as_said).all(axis=0)
        return Judged(outcome, np.min(last, axis=0) - np.max(first, axis=0))

    text = ", ".join(f"{name} {'falls' if fell else 'survives'}" for name, fell in expected.items())
    return WorldClaim(text, names, judge)


KINDS: dict[str, Callable[[Any], WorldClaim]] = {
    "survives": lambda names: survives(*_names("survives", names, exactly=2)),
    "smaller error": lambda names: smaller(*_names("smaller error", names, exactly=2)),
    "order": lambda names: ordered(*_names("order", names)),
    "falls": lambda expected: pattern(_expected(expected)),
}
"""How a design file states a claim: one key, and of whom it is made."""

WORLD_CLAIMS: Registry[tuple[WorldClaim, ...]] = Registry("claims over worlds", "artde_gym.world_claims")
"""Claims by robot: those of plug-ins, and those registered."""


def register_world_claims(name: str, claims: Sequence[WorldClaim], *, replace: bool = False) -> None:
    """Have claims judged by `multiverse` in designs that state none of their own.

    Args:
        name: of the robot.
        claims: to be judged, where all of their controllers run.
        replace: whether they may take the place of others of the same name.

    Raises:
        OptionError: if the name is taken and `replace` is not given.
    """
    WORLD_CLAIMS.register(name, tuple(claims), replace=replace)


def read_claims(given: Any, robot: str, controllers: Sequence[str]) -> tuple[WorldClaim, ...]:
    """Return the claims of a design: its own, else those of its robot, else all pairs of controllers.

    Raises:
        OptionError, UnknownNameError: for a claim of a design that is wrong, or of a controller that it does not run.
    """
    if given is None:
        # a robot's claims are of its standard design; what a design leaves out is not judged
        own = [claim for claim in WORLD_CLAIMS.get(robot, ()) if set(claim.controllers) <= set(controllers)]
        pairs = [(second, first) for first, second in itertools.combinations(controllers, 2)]
        return tuple(own) or tuple(claim for pair in pairs for claim in (survives(*pair), smaller(*pair)))
    if not isinstance(given, list):
        raise OptionError("claims", given, f"a list of mappings, each with one of the keys {', '.join(KINDS)}")
    return tuple(_read(entry, controllers) for entry in given)


def _read(entry: Any, controllers: Sequence[str]) -> WorldClaim:
    if not (isinstance(entry, Mapping) and len(entry) == 1 and next(iter(entry)) in KINDS):
        raise OptionError("claim", entry, f"a mapping with one of the keys {', '.join(KINDS)}")
    ((kind, content),) = entry.items()
    claim = KINDS[kind](content)
    for name in claim.controllers:
        if name not in controllers:
            raise OptionError(f"controller of the claim {claim.text!r}", name, suggest_names(name, controllers))
    return claim


def _names(kind: str, given: Any, exactly: int | None = None) -> list[str]:
    good = isinstance(given, list) and all(isinstance(name, str) for name in given) and len(set(given)) == len(given)
    if not good or (len(given) < 2 if exactly is None else len(given) != exactly):
        count = "at least two" if exactly is None else "two"
        raise OptionError(f"claim {kind!r}", given, f"a list of {count} controllers")
    return given


def _expected(given: Any) -> dict[str, bool]:
    if not (isinstance(given, Mapping) and given and all(isinstance(fell, bool) for fell in given.values())):
        raise OptionError("claim 'falls'", given, "a mapping of controllers to true (falls) or false (survives)")
    return dict(given)
