"""Judging policies: seeded episodes, metrics, statistics and results folders."""

from artde_gym.evaluation.evaluate import evaluate
from artde_gym.evaluation.frontier import Frontier, frontier
from artde_gym.evaluation.reproduce import Reproduction, reproduce
from artde_gym.evaluation.result import Result
from artde_gym.evaluation.scenarios import SCENARIOS, Scenario, scenario
from artde_gym.evaluation.sweep import Sweep, sweep
from artde_gym.evaluation.sweep_store import read_sweep
from artde_gym.evaluation.tune import Tuning, tune

__all__ = [
    "SCENARIOS",
    "Frontier",
    "Reproduction",
    "Result",
    "Scenario",
    "Sweep",
    "Tuning",
    "evaluate",
    "frontier",
    "read_sweep",
    "reproduce",
    "scenario",
    "sweep",
    "tune",
]
