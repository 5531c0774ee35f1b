"""Judging policies: seeded episodes, metrics, statistics and results folders."""

from artde_gym.evaluation.evaluate import evaluate
from artde_gym.evaluation.frontier import Frontier, frontier
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.scenarios import SCENARIOS, Scenario, scenario
from artde_gym.evaluation.tune import Tuning, tune

__all__ = ["SCENARIOS", "Frontier", "Result", "Scenario", "Tuning", "evaluate", "frontier", "scenario", "tune"]
