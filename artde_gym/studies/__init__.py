"""Studies built on evaluations, each with a design, a store and a result of its own.

`reproduce` judges the thesis' claims, `frontier` finds the largest disturbance that a controller survives, `tune` gives
every controller the same number of trials, `sweep` runs a grid or a random sample of cases, and `multiverse` judges
claims over plausible worlds.
"""

from typing import TYPE_CHECKING

from artde_gym.lazy import lazy

if TYPE_CHECKING:
    from artde_gym.studies.frontier import Frontier, frontier
    from artde_gym.studies.multiverse import Multiverse, multiverse, read_multiverse, register_world_claims
    from artde_gym.studies.reproduce import Reproduction, reproduce
    from artde_gym.studies.sweep import Sweep, read_sweep, sweep
    from artde_gym.studies.tune import Tuning, tune

__all__ = [
    "Frontier",
    "Multiverse",
    "Reproduction",
    "Sweep",
    "Tuning",
    "frontier",
    "multiverse",
    "read_multiverse",
    "read_sweep",
    "register_world_claims",
    "reproduce",
    "sweep",
    "tune",
]

__getattr__ = lazy(
    __name__,
    {
        "Frontier": "artde_gym.studies.frontier",
        "Multiverse": "artde_gym.studies.multiverse",
        "Reproduction": "artde_gym.studies.reproduce",
        "Sweep": "artde_gym.studies.sweep",
        "Tuning": "artde_gym.studies.tune",
        "frontier": "artde_gym.studies.frontier",
        "multiverse": "artde_gym.studies.multiverse",
        "read_multiverse": "artde_gym.studies.multiverse",
        "read_sweep": "artde_gym.studies.sweep",
        "register_world_claims": "artde_gym.studies.multiverse",
        "reproduce": "artde_gym.studies.reproduce",
        "sweep": "artde_gym.studies.sweep",
        "tune": "artde_gym.studies.tune",
    },
)
