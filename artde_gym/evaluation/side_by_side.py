"""Policies side by side: each drives some rows of one vector environment, as if it were alone there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.evaluation.rollout import Policy

Mask = NDArray[np.bool_]


class _State(NamedTuple):
    """What each policy remembers, the actions of all rows, and the rows whose episodes have ended."""

    policies: list[Any]
    actions: Array
    over: Mask


class SideBySide:
    """One policy a row; an episode that has ended is over, and a policy rests when all of its episodes are.

    Args:
        policies: of each row; rows with the same object are computed at once.
    """

    def __init__(self, policies: Sequence[Policy]) -> None:
        rows: dict[int, list[int]] = {}
        for row, policy in enumerate(policies):
            rows.setdefault(id(policy), []).append(row)
        self._parts = [(policies[some[0]], np.array(some)) for some in rows.values()]
        if all(hasattr(policy, "diagnostics") for policy, _ in self._parts):
            self.diagnostics = self._diagnostics

    def predict(
        self, observation: Any, state: _State | None = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Array, _State]:
        """Compute the actions of all rows; those of episodes that are over stay as they were."""
        over = np.zeros(len(observation), np.bool_) if state is None else state.over | episode_start
        remembered = [None] * len(self._parts) if state is None else list(state.policies)
        actions = None if state is None else state.actions.copy()
        for i, (policy, rows) in enumerate(self._parts):
            if over[rows].all():
                continue
            own, remembered[i] = policy.predict(
                observation[rows], state=remembered[i], episode_start=episode_start[rows], deterministic=deterministic
            )
            if actions is None:
                actions = np.zeros((len(observation), own.shape[-1]), own.dtype)
            actions[rows] = own
        return np.asarray(actions), _State(remembered, np.asarray(actions), over)

    def _diagnostics(self, state: _State) -> dict[str, Array]:
        told: dict[str, Array] = {}
        for (policy, rows), own in zip(self._parts, state.policies, strict=True):
            diagnose: Any = policy
            for name, values in diagnose.diagnostics(own).items():
                if name not in told:
                    told[name] = np.zeros((len(state.over), *np.shape(values)[1:]), np.asarray(values).dtype)
                told[name][rows] = values
        return told
