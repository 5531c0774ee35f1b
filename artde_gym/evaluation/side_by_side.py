"""Policies side by side: each drives some rows of one vector environment, as if it were alone there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import real_array
from artde_gym.arrays import Array
from artde_gym.errors import ActionError
from artde_gym.evaluation.rollout import Policy

Mask = NDArray[np.bool_]
Rows = slice | NDArray[np.int64]
"""Rows of a vector; those that follow each other as a slice, which copies nothing."""


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
        size: number of components of an action.
        labels: of each row, for errors; its number without.

    Attributes:
        parts: each policy that is computed, with its rows.
    """

    def __init__(self, policies: Sequence[Policy], kinds: Sequence[str], size: int, labels: Sequence[str] = ()) -> None:
        self.parts = [part for group in _rows_by(kinds) for part in _parts(policies, group)]
        self._size, self.labels = size, labels or [f"row {i}" for i in range(len(policies))]

    def predict(
        self, observation: Any, state: _State | None = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Array, _State]:
        """Compute the actions of all rows; those of episodes that are over stay as they were.

        Raises:
            ActionError: if a policy's actions are not numbers of the right shape.
        """
        if state is None:
            order = "F" if observation.flags.f_contiguous else "C"
            actions = np.zeros((len(observation), self._size), order=order)
            state = _State([None] * len(self.parts), actions, np.zeros(len(observation), np.bool_))
        else:
            over = state.over | episode_start if episode_start.any() else state.over
            state = _State(list(state.policies), state.actions.copy("K"), over)
        for i, (policy, rows) in enumerate(self.parts):
            if state.over[rows].all():
                continue
            seen, starts = np.array(observation[rows]), np.array(episode_start[rows])  # copies: policies write
            own, state.policies[i] = policy.predict(
                seen, state=state.policies[i], episode_start=starts, deterministic=deterministic
            )
            try:
                self._take(own, len(seen), state.actions, rows)
            except ActionError as error:
                raise error.within(self.labels[int(np.arange(len(self.labels))[rows][0])]) from error
        return state.actions, state

    def _take(self, own: Any, count: int, actions: Array, rows: Rows) -> None:
        shape = (count, self._size)
        given = real_array("actions", own, f"numbers of the shape {shape}")
        if given.shape != shape:  # it might be broadcast
            raise ActionError("shape of the actions", given.shape, str(shape))
        actions[rows] = given


def _parts(policies: Sequence[Policy], group: NDArray[np.int64]) -> list[tuple[Policy, Rows]]:
    """Divide rows of one kind of policy into parts: one for all that can be stacked, else one a policy."""
    some = [policies[row] for row in group.tolist()]
    apart = [group[rows] for rows in _rows_by([id(policy) for policy in some])]
    stack = getattr(some[0], "stacked", None)
    whole = stack(some) if stack is not None and len(apart) > 1 else None
    if whole is not None:
        return [(whole, _sliced(group))]
    return [(policies[rows[0]], _sliced(rows)) for rows in apart]


def _rows_by(keys: Sequence[Any]) -> list[NDArray[np.int64]]:
    rows: dict[Any, list[int]] = {}
    for row, key in enumerate(keys):
        rows.setdefault(key, []).append(row)
    return [np.array(some) for some in rows.values()]


def _sliced(rows: NDArray[np.int64]) -> Rows:
    first, last = int(rows[0]), int(rows[-1])
    return slice(first, last + 1) if last - first + 1 == len(rows) else rows
