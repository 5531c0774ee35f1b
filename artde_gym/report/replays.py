"""The replay of a scenario in a report: episodes whose motion is stored, for a browser to turn and to stop."""

from __future__ import annotations

from typing import Any

from artde_gym.errors import ArtdeGymError
from artde_gym.evaluation.cells import Cell
from artde_gym.evaluation.replay import TOGETHER, figure_of, ranked, with_motion, worst_median_best
from artde_gym.evaluation.takes import Take, stored_take
from artde_gym.motion.page import element
from artde_gym.report.answer import metric_of, ranking
from artde_gym.report.html import paragraph
from artde_gym.report.run import Run

ABOUT = (
    "Replay of the same seed under each controller: drag to turn the view, press play, or click into a chart. Arrows: "
    "pushes and the ground's forces; dashed: the reference. A robot that has fallen is frozen and gray."
)


def replay_of(run: Run, scenario: str) -> list[str]:
    """Return the replay of a scenario, its best controllers first; a sentence where none can be shown."""
    try:
        return _shown(run, scenario)
    except (ArtdeGymError, ValueError) as error:  # a robot without a scene, a controller or an argument of then
        return [paragraph(f"No replay is shown here: {error}.", "soft")]


def _shown(run: Run, scenario: str) -> list[str]:
    own = run.cell(scenario)
    cell = Cell(scenario, own["env_id"], own["kwargs"])
    names = ranking(run.result, scenario, metric_of(run.tracking(scenario)))[:TOGETHER]
    rows: dict[tuple[str, int], dict[str, Any]] = {}
    for name in names:
        for row in run.result.rows(scenario, name).reset_index().to_dict(orient="records"):
            rows[name, int(row["episode"])] = {str(key): value for key, value in row.items()}
    places = {name: run.place(scenario, name) for name in names}
    ranks = worst_median_best(with_motion(ranked(cell, rows, names), scenario, places))
    if not ranks:
        told = (
            "No motion was stored for this scenario, as by vectorized evaluations and by older releases. "
            f"`artde-gym replay FOLDER --scenario {scenario}`, with this folder, runs an episode again from its seed "
            "to show it, and says if it does not repeat."
        )
        return [paragraph(told, "soft")]

    def takes(number: int) -> list[Take]:
        found = (stored_take(places[name], scenario, name, rows[name, number]) for name in names)
        return [take for take in found if take is not None]

    return [paragraph(ABOUT, "soft"), element(figure_of(cell, {number: takes(number) for number in ranks}, ranks))]
