"""Named scenarios: an environment, its arguments and its disturbances, fixed on physical grounds.

Each robot brings its own, see `artde_gym.robots`. Every scenario varies from seed to seed, so that a result is a rate
and not a single trajectory.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from artde_gym.registry import Registry


@dataclasses.dataclass(frozen=True)
class Scenario:
    """One entry.

    Attributes:
        thesis: the thesis' scenario that it stands beside, if any.
        phases: (start, end) (s) of parts that are measured one by one too.
    """

    name: str
    env_id: str
    kwargs: Mapping[str, Any]
    disturbances: Mapping[str, Any]
    text: str
    thesis: str | None = None
    phases: tuple[tuple[float, float], ...] = ()


SCENARIOS: Registry[Scenario] = Registry(
    "scenario", "artde_gym.robots", lambda kit: {entry.name: entry for entry in kit.scenarios}
)
"""All scenarios by name: those of every robot, and those registered."""


def scenario(name: str) -> Scenario:
    """Return the scenario called `name`.

    Raises:
        UnknownNameError: if there is none.
    """
    return SCENARIOS.find(name)


def register_scenario(entry: Scenario, *, replace: bool = False) -> None:
    """Make a scenario known to `evaluate`, to `reset(options={"scenario": ...})` and to the command line.

    Raises:
        OptionError: if its name is taken and `replace` is not given.
    """
    SCENARIOS.register(entry.name, entry, replace=replace)
