"""The thesis' scenarios, run and judged claim by claim.

Beside the thesis' controllers and their rivals, an ablation can be run: plain TDE at constant extra stiffness and
damping (`tde+kd`), as much of it as ARTDE's robust gain c came to *in the same scenario*, on average over its episodes.
An advantage of ARTDE over that is due to adaptation. Claims on how much is survived take whole grids of `frontier`.

    <out>/                       the folder of `evaluate`, all controllers but the ablation
    <out>/ablation/<scenario>/   one of the ablation in each scenario, at a gain of its own
    <out>/curves/<scenario>/     the grids
    <out>/claims.csv             the claims with their verdicts
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from artde_gym.errors import OptionError
from artde_gym.evaluation.cells import Cell
from artde_gym.evaluation.environments import fastest_engine
from artde_gym.evaluation.evaluate import run_plan
from artde_gym.evaluation.labels import named_controllers
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.store import write_atomically
from artde_gym.evaluation.tasks import Update
from artde_gym.kit import ROBOTS, RobotKit, find_robot
from artde_gym.scenarios import scenario as find_scenario
from artde_gym.studies.frontier.result import Frontier
from artde_gym.studies.frontier.search import frontier
from artde_gym.studies.reproduce.claims import all_claims, judge

ADAPTIVE, ABLATION = "artde", "tde+kd"
EPISODES, SINGLE_EPISODES = 10, 4
"""Where walks run one by one, fewer of them: all seeds alike are still more often than not."""
RECORD_EPISODES = 3  # episodes of each cell that leave their signals: to look at; compressing all takes a minute or two
GAIN = "robust_gain_mean"  # column of a law's mean c; with a suffix for each loop of a cascade, as its gains have


@dataclasses.dataclass(frozen=True)
class Reproduction:
    """Episodes of all controllers, the claims with their verdicts, and the grids behind some of them."""

    result: Result
    claims: pd.DataFrame
    curves: Mapping[tuple[str, str], Frontier] = dataclasses.field(default_factory=dict)


def reproducible() -> list[str]:
    """Return the names of the robots that have scenarios to reproduce."""
    return [name for name, kit in ROBOTS.items() if kit.reproduced[0]]


def kit_of(robot: str) -> RobotKit:
    """Return the robot of this name or title.

    Raises:
        UnknownNameError: if no robot with scenarios to reproduce has it, or several have this title.
    """
    return find_robot(robot, reproducible())


def folder_name(robot: str) -> str:
    """Return the name of a robot's folder: its title, unless another robot has the same."""
    kit = kit_of(robot)
    return kit.title if [ROBOTS[name].title for name in reproducible()].count(kit.title) == 1 else kit.name


def scenarios_of(robot: str, names: Sequence[str] | None = None) -> tuple[str, ...]:
    """Return the named scenarios of a robot; all that reproduce it for None.

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
    curves: bool = False,
    episodes: int | None = None,
    seed: int = 0,
    workers: int = 1,
    engine: str | None = None,
    allow_mixed: bool = False,
    on_progress: Callable[[str, Update], None] | None = None,
) -> Reproduction:
    """Run a robot's scenarios with all its controllers and judge the claims made in them.

    Args:
        robot: name of a robot, such as "ojas" or "q450"; its title will do where no other robot has it.
        out: folder to store everything in; the same call continues an interrupted one.
        scenarios: of this robot, in place of all that its kit names.
        controllers: in place of the kit's, without the ablation.
        ablation: whether to run it too; "artde" must be among the controllers then.
        curves: whether to run the grids of claims in these scenarios, too.
        episodes: seeded episodes of each controller in each scenario; None for 10, or 4 where walks run singly.
        seed: of everything.
        workers: processes; the results do not depend on it.
        engine: physics engine, in its fastest vectorized; None for the fastest of all.
        allow_mixed: as for `evaluate`.
        on_progress: called with the running part ("episodes", "ablation in S1") and the progress of its episodes.

    Raises:
        UnknownNameError, OptionError: for an invalid argument, before the first episode.
        StoreError: if `out` holds other results or results of other software, or another process is writing to it.
    """
    chosen = scenarios_of(robot, scenarios)
    if not chosen:
        raise OptionError("scenarios", scenarios, f"at least one of the {robot}'s")
    names = list(kit_of(robot).reproduced[1] if controllers is None else controllers)
    if ABLATION in names:
        raise OptionError("controller", ABLATION, "pass ablation=True", "runs as the ablation, not by its name")
    if ablation and ADAPTIVE not in names:
        problem = f"lack {ADAPTIVE!r}, from which the ablation takes its gain"
        raise OptionError("controllers", names, "add it, or pass ablation=False", problem)
    vectorized, _ = fastest_engine(find_scenario(chosen[0]).env_id, engine)
    plan = Plan.of(
        names,
        scenario=chosen,
        episodes=_episodes(vectorized) if episodes is None else episodes,
        seed=seed,
        workers=workers,
        env_kwargs={} if engine is None else {"engine": engine},
        vectorized=vectorized,
        record_episodes=RECORD_EPISODES,
        allow_mixed=allow_mixed,
    )
    plan = dataclasses.replace(plan, together=True)
    folder = Path(out)
    result = run_plan(plan, folder, on_progress and functools.partial(on_progress, "episodes"))
    for cell in plan.cells if ablation else ():
        if result.complete:
            result = _with_ablation(result, plan, cell, folder, on_progress)
    made = [
        claim
        for claim in all_claims()
        if claim.scenario in result.scenarios and (ablation or not claim.ablation) and (curves or not claim.curve)
        if set(claim.takes) <= set(result.controllers)
    ]
    found: dict[tuple[str, str], Frontier] = {}
    for key in dict.fromkeys((claim.scenario, claim.curve) for claim in made if claim.curve):
        if result.complete:
            found[key] = _grid(plan, *key, folder, on_progress)
            result = dataclasses.replace(result, complete=found[key].complete)
    verdicts = judge(result, made, found)
    text = verdicts.to_csv(index=False, lineterminator="\n")
    write_atomically(folder / "claims.csv", lambda file: file.write(text.encode()))
    return Reproduction(result, verdicts, found)


def _episodes(vectorized: bool) -> int:
    return EPISODES if vectorized else SINGLE_EPISODES


def _grid(
    plan: Plan, scenario: str, path: str, folder: Path, on_progress: Callable[[str, Update], None] | None
) -> Frontier:
    """Run the standard grid of a scenario with the controllers of a plan."""
    (cell,) = (cell for cell in plan.cells if cell.name == scenario)
    return frontier(
        list(plan.controllers),
        cell.env_id,
        path,
        scenario=scenario,
        grid=True,
        episodes=plan.episodes,
        seed=plan.seed,
        workers=plan.workers,
        out=folder / "curves" / scenario,
        env_kwargs={"engine": cell.kwargs["engine"]} if cell.engine_asked else {},
        vectorized=plan.vectorized,
        allow_mixed=plan.allow_mixed,
        on_progress=on_progress and (lambda value, update: on_progress(f"{path} {value:g} in {scenario}", update)),
    )


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
    """Return the ablation's gains c (c_p, c_q for a cascade): means of ARTDE's over its episodes in a scenario."""
    return mean_gains(result.rows(scenario, ADAPTIVE))


def mean_gains(rows: pd.DataFrame) -> dict[str, float]:
    """Return the ablation's gains from episodes of an adaptive law; none if the law has no adaptive gain."""
    means = {column.removeprefix(GAIN): rows[column].to_numpy(np.float64) for column in rows if column.startswith(GAIN)}
    return {f"c{suffix}": float(values.mean()) for suffix, values in means.items() if np.isfinite(values).all()}
