"""Named scenarios: an environment, its arguments and its disturbances, fixed on physical grounds.

Each robot brings its own, see `artde_gym.robots`. Every scenario varies with the seed, so that results are rates over
many trajectories.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from artde_gym.registry import Registry

CUSTOM = "custom"
"""Name of the scenario for an environment that is evaluated with plain arguments."""


@dataclasses.dataclass(frozen=True)
class Scenario:
    """A named scenario.

    Attributes:
        thesis: the corresponding scenario of the thesis, if any.
        phases: (start, end) (s) of parts that also get metrics of their own.
    """

    name: str
    env_id: str
    kwargs: Mapping[str, Any]
    disturbances: Mapping[str, Any]
    text: str
    thesis: str | None = None
    phases: tuple[tuple[float, float], ...] = ()


SCENARIOS: Registry[Scenario] = Registry(
    "scenario", "artde_gym.robots", lambda kit: {entry.name: entry for entry in kit.scenarios}, reserved=(CUSTOM,)
)
"""All scenarios by name: those of every robot, and registered ones."""


def scenario(name: str) -> Scenario:
    """Return the scenario called `name`.

    Raises:
        UnknownNameError: if there is none.
    """
    return SCENARIOS.find(name)


def register_scenario(entry: Scenario, *, replace: bool = False) -> None:
    """Register a scenario for `evaluate`, `reset(options={"scenario": ...})` and the command line.

    Raises:
        OptionError: if its name is taken and `replace` is not given.
    """
    SCENARIOS.register(entry.name, entry, replace=replace)
