"""The plan of a study: everything that determines its episodes, validated once.

`Plan.of` validates the arguments that `evaluate` and the studies take. A plan derived with `dataclasses.replace` is not
validated again, except by `try_out` for what only an environment can check.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from artde_gym.arguments import check_bool, check_integer, check_number
from artde_gym.evaluation.cells import Cell, cells_of, engines_of, validate_cell
from artde_gym.evaluation.gains import checked_gains, policy_for
from artde_gym.evaluation.identity import Identity, behind, identity_of
from artde_gym.evaluation.labels import named_controllers
from artde_gym.evaluation.provenance import provenance
from artde_gym.evaluation.registered import METRICS
from artde_gym.evaluation.rollout import Policy
from artde_gym.evaluation.tasks import Case, Task, tasks_of
from artde_gym.evaluation.workers import check_picklable, check_workers
from artde_gym.registration import ControllerSpec

MOST_EPISODES = 1_000_000
SLOWEST = 1e-3  # Hz, lowest rate of stored signals


@dataclasses.dataclass(frozen=True)
class Plan:
    """Controllers on the same seeded episodes of some cells.

    Attributes:
        controllers: by label.
        cells: environments with their arguments and disturbances.
        gains: controller -> gains that override its preset's.
        episodes: number per controller and cell.
        seed: base seed, from which those of the episodes are derived.
        workers: number of processes.
        vectorized: as for `evaluate`.
        record_episodes: how many episodes of each controller and cell leave signals; None for all, or none if
            `vectorized`.
        record_hz: rate of stored signals; infinite for all of them.
        allow_mixed: whether results of other software may be continued.
        together: whether cells that differ by disturbances alone share a vector, as controllers in one cell always do.
    """

    controllers: Mapping[str, Policy | ControllerSpec]
    cells: tuple[Cell, ...]
    gains: Mapping[str, dict[str, Any]]
    episodes: int
    seed: int
    workers: int
    vectorized: bool
    record_episodes: int | None
    record_hz: float
    allow_mixed: bool
    together: bool = False

    @classmethod
    def of(
        cls,
        controllers: Sequence[str | Policy] | Mapping[str, str | Policy],
        env_id: str | None = None,
        *,
        scenario: str | Sequence[str] | None = None,
        episodes: int = 1,
        seed: int = 0,
        workers: int = 1,
        disturbances: Mapping[str, Any] | None = None,
        env_kwargs: Mapping[str, Any] | None = None,
        gains: Mapping[str, Mapping[str, Any]] | None = None,
        vectorized: bool = False,
        record_episodes: int | None = None,
        record_hz: float = 100.0,
        allow_mixed: bool = False,
    ) -> Plan:
        """Make a plan from the arguments of `evaluate`; see there.

        Raises:
            UnknownNameError, OptionError: for an invalid argument.
        """
        check_workers(workers)
        check_integer("episodes", episodes, 1, MOST_EPISODES)
        check_integer("seed", seed, 0)
        check_number(
            "record_hz", record_hz, SLOWEST, math.inf, f"a number >= {SLOWEST:g} (Hz), infinite for every sample"
        )
        check_bool("vectorized", vectorized)
        if record_episodes is not None:
            check_integer("record_episodes", record_episodes, 0)
        named = named_controllers(controllers)
        own_gains = checked_gains(gains, named)
        cells = tuple(cells_of(env_id, scenario, env_kwargs, disturbances, vectorized))
        if workers > 1:
            check_picklable(named, own_gains)
        return cls(
            named, cells, own_gains, episodes, seed, workers, vectorized, record_episodes, record_hz, allow_mixed
        )

    @property
    def total(self) -> int:
        """Total number of episodes."""
        return self.episodes * len(self.cells) * len(self.controllers)

    @property
    def traces(self) -> int:
        """Number of episodes per controller and cell whose signals are stored."""
        if self.record_episodes is not None:
            return self.record_episodes
        return self.episodes if not self.vectorized else 0

    def only(self, names: Collection[str], cell: Cell) -> Plan:
        """Return the plan for some of the controllers in one cell."""
        controllers = {name: item for name, item in self.controllers.items() if name in names}
        gains = {name: values for name, values in self.gains.items() if name in names}
        return dataclasses.replace(self, controllers=controllers, gains=gains, cells=(cell,))

    def configuration(self) -> dict[str, Any]:
        """Return everything that determines an episode, as plain data; only equal ones resume a folder."""
        return {
            "cells": [{"name": cell.name, "env_id": cell.env_id, "kwargs": cell.kwargs} for cell in self.cells],
            "controllers": {name: identity.value for name, identity in self._identities.items()},
            "gains": self.gains,
            "episodes": self.episodes,
            "seed": self.seed,
            "vectorized": self.vectorized,
            "record_episodes": self.traces,
            "record_hz": self.record_hz if math.isfinite(self.record_hz) else "all",
            **({"metrics": sorted(METRICS)} if METRICS else {}),
        }

    def provenance(self, evidence: Mapping[str, str]) -> dict[str, Any]:
        """Return the provenance of the results, including the hashes from `try_out`."""
        identified_by = {name: identity.by for name, identity in self._identities.items()}
        return provenance(evidence, identified_by, engines_of(self.cells))

    @functools.cached_property
    def _identities(self) -> dict[str, Identity]:
        return {name: identity_of(item) for name, item in self.controllers.items()}

    def try_out(self) -> dict[str, str]:
        """Build everything once, so that an invalid argument is reported before the first episode, not in a worker.

        Returns:
            Hashes of the controllers' weights and code.

        Raises:
            OptionError, DisturbanceError, GainError: if an environment or a controller rejects an argument.
        """
        found: dict[str, str] = {}
        for cell in self.cells:
            env = validate_cell(self.vectorized, cell)
            for name, item in self.controllers.items():
                found |= behind(name, cell.env_id, item, policy_for(item, env, self.gains.get(name, {})))
        return found

    def tasks(self, done: Collection[tuple[str, str, int]]) -> Iterator[Task]:
        """Return the remaining tasks; `done` holds scenario, controller and number of finished episodes."""
        cases = [
            Case(cell, name, item, self.gains.get(name, {}), self.seed)
            for cell, (name, item) in itertools.product(self.cells, self.controllers.items())
        ]
        shown: dict[str, Any] = {"record_episodes": self.traces, "record_hz": self.record_hz}
        return tasks_of(
            cases, self.episodes, self.vectorized, done, **shown, together=self.together, workers=self.workers
        )
