"""Computing time of an evaluation of several controllers in one vector environment, against each in one of its own."""

from __future__ import annotations

from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import Job, in_turns
from artde_gym.evaluation import evaluate

SCENARIOS = {"Q1": 3.0, "S1-GRF45": 1.5}
"""Scenario -> duration (s) of its episodes here."""
CONTROLLERS = ("tde", "artde", "atde", "pid", "artde-robust", "tde+kd", "tde+c", "tde-stiff")
FLYING = (*CONTROLLERS[:-1], "tde-tight")
COUNTS = (2, 8)
EPISODES = (3, 10)
LEAST = 1.3


def evaluating(quick: bool) -> Section:
    """Measure evaluations by the number of their controllers."""
    figures = []
    for scenario, duration in SCENARIOS.items():
        names = FLYING if scenario == "Q1" else CONTROLLERS
        for count in COUNTS[:1] if quick else COUNTS:
            for episodes in EPISODES:
                variants = {
                    "apart": _evaluations([[name] for name in names[:count]], scenario, duration, episodes),
                    "together": _evaluations([list(names[:count])], scenario, duration, episodes),
                }
                times = in_turns({key: lambda job=job: job for key, job in variants.items()}, 1 if quick else 3)
                ratio = times["apart"] / times["together"]
                figures.append(Figure(f"{scenario}, {count} controllers, {episodes} episodes each: rate together "
                                      "against apart", ratio, least=LEAST))  # fmt: skip
    text = (
        "`evaluate(..., vectorized=True)` with several controllers, which share one vector environment, against one "
        "call for each of them; "
        + " and ".join(f"{duration:g} s of {scenario}" for scenario, duration in SCENARIOS.items())
        + ", one process, by computing time."
    )
    return Section("Several controllers in one vector", text, tuple(figures))


def _evaluations(parts: list[list[str]], scenario: str, duration: float, episodes: int) -> Job:
    def job() -> None:
        for names in parts:
            evaluate(names, scenario=scenario, episodes=episodes, vectorized=True, env_kwargs={"duration": duration})

    return job
