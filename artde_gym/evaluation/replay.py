"""Replays of an evaluation's episodes, or of episodes that were not run before."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from artde_gym.arguments import check_integer, wrap_read_errors
from artde_gym.errors import OptionError, StoreError, UnknownNameError, suggest_names
from artde_gym.evaluation.cells import Cell
from artde_gym.evaluation.environments import metrics_spec_of, physics_of, robot_of, single_arguments
from artde_gym.evaluation.plan import Plan
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.evaluation.store import read_episodes, read_record
from artde_gym.evaluation.takes import Take, compared, has_motion, new_take, stored_take, text_of
from artde_gym.motion.replay import Replay
from artde_gym.motion.scene import scene_of
from artde_gym.palette import styles
from artde_gym.registration import registered_controllers
from artde_gym.scenarios import SCENARIOS

TOGETHER = 4  # controllers at most in one figure

Row = Mapping[str, Any]
Rows = Mapping[tuple[str, int], Row]
"""Rows of the table of episodes by controller and number."""
Progress = Callable[[str, float], None]


def replay(
    controllers: Sequence[str | Policy] | Mapping[str, str | Policy],
    env_id: str | None = None,
    *,
    scenario: str | None = None,
    seed: int = 0,
    episode: int = 0,
    disturbances: Mapping[str, Any] | None = None,
    env_kwargs: Mapping[str, Any] | None = None,
    gains: Mapping[str, Mapping[str, Any]] | None = None,
    on_progress: Progress | None = None,
) -> Replay:
    """Run an episode of each controller, as `evaluate` does with the same arguments, and show them in a browser.

    Args:
        controllers, env_id, scenario, disturbances, env_kwargs, gains: as for `evaluate`.
        seed, episode: which one of an evaluation's episodes.
        on_progress: called with the controller that runs and the simulated time (s).

    Returns:
        The replay: a notebook shows it as it is, `save("fall.html")` makes a file of it.

    Raises:
        UnknownNameError, OptionError, DisturbanceError, GainError: for a bad argument.
        RobotError: for a robot that says nothing of its looks.
    """
    own_seed = episode_seed(check_integer("seed", seed, 0), check_integer("episode", episode, 0))
    plan = Plan.of(
        controllers, env_id, scenario=scenario, seed=seed, disturbances=disturbances, env_kwargs=env_kwargs, gains=gains
    )
    (cell,) = plan.cells
    plan.try_out()
    takes = [
        new_take(cell, name, item, plan.gains.get(name, {}), own_seed, on_progress=_told(on_progress, name))
        for name, item in plan.controllers.items()
    ]
    return Replay((figure_of(cell, {episode: takes}, {}),))


def replay_folder(
    folder: str | Path,
    scenario: str | Sequence[str] | None = None,
    controllers: Sequence[str] | None = None,
    episode: int | None = None,
    *,
    on_progress: Progress | None = None,
) -> Replay:
    """Show episodes of an evaluation's folder.

    Args:
        folder: what `evaluate` wrote.
        scenario: names of scenarios; None for all of them.
        controllers: names, of each scenario; None for the first ones, at most `TOGETHER`.
        episode: number; None for the worst, the median and the best one whose motion is stored.
        on_progress: called with the controller that runs and the simulated time (s), where an episode runs again.

    An episode whose motion is not stored is run again from its seed; a note says if it did not repeat.

    Raises:
        StoreError: if the folder is none, or has no episode yet.
        UnknownNameError, OptionError: for a scenario, a controller or an episode that it does not have.
    """
    archive = _Archive(Path(folder))
    if not archive.scenarios:
        raise StoreError("results folder", str(folder), "run the evaluation first", "has no finished episode")
    names = archive.scenarios if scenario is None else [scenario] if isinstance(scenario, str) else list(scenario)
    figures, notes = [], []
    for name in names:
        found, ranks = archive.takes(name, controllers, episode, on_progress)
        figures.append(figure_of(archive.cell(name), found, ranks))
        notes += [take.note for takes in found.values() for take in takes if take.note]
    return Replay(tuple(figures), tuple(notes))


def figure_of(cell: Cell, takes: Mapping[int, Sequence[Take]], ranks: Mapping[int, str]) -> dict[str, Any]:
    """Return what the viewer shows of a cell: takes by number of the episode, and how each one ranks."""
    tracking = metrics_spec_of(cell.env_id, cell.kwargs)
    entry = SCENARIOS.get(cell.name)
    chosen = styles(dict.fromkeys(take.name for several in takes.values() for take in several))
    episodes = [
        {
            "number": number,
            "rank": ranks.get(number, ""),
            "runs": [text_of(take, tracking, chosen[take.name].color) for take in several],
        }
        for number, several in takes.items()
    ]
    return {
        "format": "motion 1",
        "title": f"{entry.name}: {entry.text}" if entry else cell.env_id,
        "scene": scene_of(robot_of(cell.env_id), cell.kwargs, cell.env_id).text(),
        "episodes": episodes,
    }


def with_motion(numbers: Sequence[int], scenario: str, places: Mapping[str, Path]) -> list[int]:
    """Return the episodes whose motion is stored of all controllers, each of which has its folder."""
    return [
        number
        for number in numbers
        if all(has_motion(folder, scenario, name, number) for name, folder in places.items())
    ]


def ranked(cell: Cell, rows: Rows, names: Sequence[str]) -> list[int]:
    """Order the episodes that all of the controllers have, the best first.

    Fewer falls are better, among equals those that come later, among equals the smaller mean error.
    """
    metric = f"rmse_{metrics_spec_of(cell.env_id).errors[0].unit}"
    numbers = dict.fromkeys(number for _, number in rows)
    complete = [number for number in numbers if all((name, number) in rows for name in names)]

    def order(number: int) -> tuple[float, float, float]:
        found = [rows[name, number] for name in names]
        falls, times = (sum(row[column] for row in found) for column in ("fell", "duration_s"))
        return falls, -times, sum(row[metric] for row in found)

    return sorted(complete, key=order)


def worst_median_best(order: Sequence[int]) -> dict[int, str]:
    """Name the ends and the middle of an order, the best first; the worst comes first."""
    if len(order) < 2:
        return dict.fromkeys(order, "")
    middle = {order[(len(order) - 1) // 2]: "median"} if len(order) > 2 else {}
    return {order[-1]: "worst", **middle, order[0]: "best"}


class _Archive:
    """An evaluation's folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._configuration = read_record(folder)["configuration"]
        with wrap_read_errors("results folder", folder, "one that `evaluate` wrote", StoreError):
            cells = self._configuration["cells"]
            self._cells = {cell["name"]: Cell(cell["name"], cell["env_id"], cell["kwargs"]) for cell in cells}
        _, table = read_episodes(folder, self._configuration)
        self._rows: dict[str, dict[tuple[str, int], Row]] = {name: {} for name in self._cells}
        for row in table.to_dict(orient="records"):
            self._rows[row["scenario"]][row["controller"], row["episode"]] = {str(key): row[key] for key in row}

    @property
    def scenarios(self) -> list[str]:
        """Scenarios of which any episode is finished."""
        return [name for name, rows in self._rows.items() if rows]

    def cell(self, scenario: str) -> Cell:
        """Return what was run, as single environments take it.

        Raises:
            UnknownNameError: if it has no episode.
        """
        if scenario not in self.scenarios:
            raise UnknownNameError("scenario", scenario, suggest_names(scenario, self.scenarios))
        cell = self._cells[scenario]
        return cell._replace(kwargs=single_arguments(cell.env_id, cell.kwargs))

    def takes(
        self, scenario: str, controllers: Sequence[str] | None, episode: int | None, on_progress: Progress | None
    ) -> tuple[dict[int, list[Take]], dict[int, str]]:
        """Find the takes of a scenario by episode, and how these rank."""
        cell, rows = self.cell(scenario), self._rows[scenario]
        names = _chosen(rows, controllers)
        order = ranked(cell, rows, names)
        if episode is not None and episode not in order:
            raise OptionError("episode", episode, f"one that all of {', '.join(names)} have: {sorted(order)}")
        seen = with_motion(order, scenario, dict.fromkeys(names, self._folder))
        ranks = worst_median_best(seen or order)
        if episode is not None:
            ranks = {episode: ranks.get(episode, "")}
        elif not seen:
            ranks = dict(list(ranks.items())[:1])  # to run all of them again would take long

        def take(name: str, number: int) -> Take:
            row = rows[name, number]
            return stored_take(self._folder, scenario, name, row) or self._again(cell, name, row, on_progress)

        return {number: [take(name, number) for name in names] for number in ranks}, ranks

    def _again(self, cell: Cell, name: str, row: Row, on_progress: Progress | None) -> Take:
        known = registered_controllers()
        if name not in known:
            problem = "has no motion in the folder, and no registered name by which it could be run again"
            raise UnknownNameError("controller", name, f"registered are {suggest_names(name, known)}", problem)
        gains = self._configuration.get("gains", {}).get(name, {})
        take = new_take(cell, name, known[name], gains, int(row["seed"]), _told(on_progress, name))
        return compared(take, row, physics_of(cell.kwargs), physics_of(self._cells[cell.name].kwargs))


def _chosen(rows: Rows, controllers: Sequence[str] | None) -> list[str]:
    known = list(dict.fromkeys(name for name, _ in rows))
    if controllers is None:
        return known[:TOGETHER]
    if not 1 <= len(controllers) <= TOGETHER:
        raise OptionError("controllers", list(controllers), f"1 to {TOGETHER} names")
    for name in controllers:
        if name not in known:
            raise UnknownNameError("controller", name, suggest_names(name, known))
    return list(dict.fromkeys(controllers))


def _told(on_progress: Progress | None, name: str) -> Callable[[float], None] | None:
    return None if on_progress is None else lambda time: on_progress(name, time)
