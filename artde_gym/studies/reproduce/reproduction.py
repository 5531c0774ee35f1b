"""The thesis' scenarios, run and judged claim by claim.

Beside the thesis' controllers and their rivals, an ablation can be run: plain TDE at constant extra stiffness and
damping (`tde+kd`), as much of it as ARTDE's robust gain c came to *in the same scenario*, on average over its episodes.
What ARTDE is better than that, it owes to adaptation.

    <out>/                       the folder of `evaluate`, all controllers but the ablation
    <out>/ablation/<scenario>/   one of the ablation in each scenario, at a gain of its own
    <out>/claims.csv             the claims with their verdicts
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation.cells import Cell
from artde_gym.evaluation.evaluate import run_plan
from artde_gym.evaluation.labels import named_controllers
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.store import write_atomically
from artde_gym.evaluation.tasks import Update
from artde_gym.kit import ROBOTS, RobotKit
from artde_gym.scenarios import scenario as find_scenario
from artde_gym.studies.reproduce.claims import all_claims, judge

ADAPTIVE, ABLATION = "artde", "tde+kd"
RECORD_EPISODES = 3  # episodes of each cell that leave their signals: to look at; compressing all takes a minute or two
GAIN = "robust_gain_mean"  # column of a law's mean c; with a suffix for each loop of a cascade, as its gains have


@dataclasses.dataclass(frozen=True)
class Reproduction:
    """Episodes of all controllers, and the claims with their verdicts (see `claims.judge`)."""

    result: Result
    claims: pd.DataFrame


def titles() -> list[str]:
    """Return how users call the robots that have scenarios to reproduce."""
    return [kit.title for kit in ROBOTS.values() if kit.reproduced[0]]


def kit_of(title: str) -> RobotKit:
    """Return the robot that users call so.

    Raises:
        UnknownNameError: if there is none with scenarios to reproduce.
    """
    if title not in titles():
        raise UnknownNameError("robot", title, suggest_names(title, titles()))
    return next(kit for kit in ROBOTS.values() if kit.title == title)


def scenarios_of(robot: str, names: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return those of the named scenarios in which a robot moves; all that it is reproduced in for None.

    Raises:
        UnknownNameError: for an unknown robot or scenario.
    """
    own, _ = kit_of(robot).reproduced
    environments = {entry.env_id for entry in kit_of(robot).environments}
    return own if names is None else tuple(name for name in names if find_scenario(name).env_id in environments)


@writes_folder
def reproduce(
    robot: str,
    out: str | Path,
    *,
    scenarios: Sequence[str] | None = None,
    controllers: Sequence[str] | None = None,
    ablation: bool = False,
    episodes: int = 10,
    seed: int = 0,
    workers: int = 1,
    engine: str | None = None,
    allow_mixed: bool = False,
    on_progress: Callable[[str, Update], None] | None = None,
) -> Reproduction:
    """Run a robot's scenarios with all its controllers and judge the claims made in them.

    Args:
        robot: a robot's title, such as "biped" or "quadrotor".
        out: folder to store everything in; the same call continues an interrupted one.
        scenarios: of this robot, in place of all that its kit names.
        controllers: likewise, without the ablation.
        ablation: whether to run it too; "artde" must be among the controllers then.
        episodes: seeded episodes of each controller in each scenario.
        seed: of everything.
        workers: processes; the results do not depend on it.
        engine: physics engine; None for the default one.
        allow_mixed: as for `evaluate`.
        on_progress: called with what runs ("episodes", "ablation in S1") and the progress of its episodes.

    Raises:
        UnknownNameError, OptionError: for a bad argument, before the first episode.
        StoreError: if `out` holds other results, or results of other software, or is written by another process.
    """
    chosen = scenarios_of(robot, scenarios)
    if not chosen:
        raise OptionError("scenarios", scenarios, f"at least one of the {robot}'s")
    names = list(kit_of(robot).reproduced[1] if controllers is None else controllers)
    if ABLATION in names:
        raise OptionError("controllers", ABLATION, "other names; it is run by ablation=True, at gains of its own")
    if ablation and ADAPTIVE not in names:
        raise OptionError("controllers", names, f"{ADAPTIVE!r} among them, from which the ablation takes its gain")
    plan = Plan.of(
        names,
        scenario=chosen,
        episodes=episodes,
        seed=seed,
        workers=workers,
        env_kwargs={"engine": engine},
        record_episodes=RECORD_EPISODES,
        allow_mixed=allow_mixed,
    )
    folder = Path(out)
    result = run_plan(plan, folder, on_progress and functools.partial(on_progress, "episodes"))
    for cell in plan.cells if ablation else ():
        if result.complete:
            result = _with_ablation(result, plan, cell, folder, on_progress)
    made = [claim for claim in all_claims() if claim.scenario in result.scenarios and (ablation or not claim.ablation)]
    verdicts = judge(result, made)
    text = verdicts.to_csv(index=False, lineterminator="\n")
    write_atomically(folder / "claims.csv", lambda file: file.write(text.encode()))
    return Reproduction(result, verdicts)


def _with_ablation(
    result: Result, plan: Plan, cell: Cell, folder: Path, on_progress: Callable[[str, Update], None] | None
) -> Result:
    """Add episodes of the ablation in one scenario to a result."""
    gains = {ABLATION: equivalent_gains(result, cell.name)}
    own = dataclasses.replace(plan, controllers=named_controllers([ABLATION]), cells=(cell,), gains=gains)
    news = on_progress and functools.partial(on_progress, f"ablation in {cell.name}")
    part = run_plan(own, folder / "ablation" / cell.name, news)
    return Result(pd.concat([result.episodes, part.episodes]), folder, part.complete)


def equivalent_gains(result: Result, scenario: str) -> dict[str, float]:
    """The ablation's gains c (of a cascade c_p, c_q): means of ARTDE's over its episodes in a scenario."""
    rows = result.rows(scenario, ADAPTIVE)
    means = {column.removeprefix(GAIN): rows[column].to_numpy(np.float64) for column in rows if column.startswith(GAIN)}
    return {f"c{suffix}": float(values.mean()) for suffix, values in means.items() if np.isfinite(values).all()}
