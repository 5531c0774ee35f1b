"""The evaluation harness: seeded episodes, metrics, statistics and results folders."""

from typing import TYPE_CHECKING

from artde_gym.deprecation import moved
from artde_gym.lazy import lazy

if TYPE_CHECKING:
    from artde_gym.evaluation.evaluate import evaluate
    from artde_gym.evaluation.registered import Metric, register_metric
    from artde_gym.evaluation.result import Result, read_result

__all__ = ["Metric", "Result", "evaluate", "read_result", "register_metric"]

_OWN = {
    "Metric": "artde_gym.evaluation.registered",
    "Result": "artde_gym.evaluation.result",
    "evaluate": "artde_gym.evaluation.evaluate",
    "read_result": "artde_gym.evaluation.result",
    "register_metric": "artde_gym.evaluation.registered",
}
_STUDIES = ("Frontier", "Reproduction", "Sweep", "Tuning", "frontier", "read_sweep", "reproduce", "sweep", "tune")
_SCENARIOS = ("SCENARIOS", "Scenario", "scenario")

__getattr__ = lazy(
    __name__,
    _OWN,
    moved(
        __name__,
        {**dict.fromkeys(_STUDIES, "artde_gym.studies"), **dict.fromkeys(_SCENARIOS, "artde_gym.scenarios")},
    ),
)
