"""Policies side by side: each drives some rows of one vector environment, as if it were alone there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.evaluation.rollout import Policy

Mask = NDArray[np.bool_]
Rows = NDArray[np.int64]


class _State(NamedTuple):
    """State of each policy, actions of all rows, and the rows whose episodes have ended."""

    policies: list[Any]
    actions: Array
    over: Mask


class SideBySide:
    """One policy a row; an episode that has ended is over, and a policy rests when all of its episodes are.

    Args:
        policies: of each row; rows with the same object are computed at once.
        kinds: of each row; those of one kind are computed at once, too, if they differ in gains alone and their class
            has `stacked` (`controllers.policies.Policy`).
    """

    def __init__(self, policies: Sequence[Policy], kinds: Sequence[str]) -> None:
        self._parts = [part for group in _rows_by(kinds) for part in _parts(policies, group)]
        if any(hasattr(policy, "diagnostics") for policy, _ in self._parts):
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
        """Tell what the policies know, NaN in rows of those that do not tell it."""
        told: dict[str, Array] = {}
        for (policy, rows), own in zip(self._parts, state.policies, strict=True):
            diagnose: Any = getattr(policy, "diagnostics", lambda _: {})
            for name, values in diagnose(own).items():
                if name not in told:
                    told[name] = np.full((len(state.over), *np.shape(values)[1:]), np.nan)
                told[name][rows] = values
        return told


def _parts(policies: Sequence[Policy], group: Rows) -> list[tuple[Policy, Rows]]:
    """Divide rows of one kind of policy into parts: one for all that can be stacked, else one a policy."""
    some = [policies[row] for row in group.tolist()]
    apart = [group[rows] for rows in _rows_by([id(policy) for policy in some])]
    stack = getattr(some[0], "stacked", None)
    whole = stack(some) if stack is not None and len(apart) > 1 else None
    return [(whole, group)] if whole is not None else [(policies[rows[0]], rows) for rows in apart]


def _rows_by(keys: Sequence[Any]) -> list[Rows]:
    rows: dict[Any, list[int]] = {}
    for row, key in enumerate(keys):
        rows.setdefault(key, []).append(row)
    return [np.array(some) for some in rows.values()]
