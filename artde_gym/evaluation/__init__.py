"""The evaluation harness: seeded episodes, metrics, statistics and results folders."""

from artde_gym.deprecation import moved
from artde_gym.evaluation.evaluate import evaluate
from artde_gym.evaluation.registered import Metric, register_metric
from artde_gym.evaluation.result import Result

__all__ = ["Metric", "Result", "evaluate", "register_metric"]

_STUDIES = ("Frontier", "Reproduction", "Sweep", "Tuning", "frontier", "read_sweep", "reproduce", "sweep", "tune")
_SCENARIOS = ("SCENARIOS", "Scenario", "scenario")

__getattr__ = moved(
    __name__,
    {**dict.fromkeys(_STUDIES, "artde_gym.studies"), **dict.fromkeys(_SCENARIOS, "artde_gym.scenarios")},
)
