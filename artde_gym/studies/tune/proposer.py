"""Proposals of gains for the next trial."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.extras import needs
from artde_gym.registration import GainRange

Gains = dict[str, float]


class Proposer:
    """Optuna as a function from finished trials to the next gains.

    Raises:
        MissingDependencyError: if it is not installed.
    """

    def __init__(self, seed: int) -> None:
        with needs("tune"):
            import optuna
        self._optuna = optuna
        self._seed = seed
        optuna.logging.set_verbosity(optuna.logging.WARNING)  # not one line per trial

    def propose(
        self, name: str, space: Mapping[str, GainRange], history: list[tuple[Gains, float]], number: int
    ) -> Gains:
        """Return the gains of trial `number`, to four digits."""
        if number == 0:
            return {gain: where.initial for gain, where in space.items()}
        optuna = self._optuna
        ranges: dict[str, Any] = {
            gain: optuna.distributions.FloatDistribution(where.low, where.high, log=True)
            for gain, where in space.items()
        }
        own = np.random.SeedSequence([self._seed, zlib.crc32(name.encode()), number])
        study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=int(own.generate_state(1)[0])))
        study.add_trials(
            [optuna.trial.create_trial(params=params, distributions=ranges, value=cost) for params, cost in history]
        )
        found = study.ask(ranges).params
        return {gain: min(max(float(f"{found[gain]:.4g}"), where.low), where.high) for gain, where in space.items()}
