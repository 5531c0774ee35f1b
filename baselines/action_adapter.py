"""Coupling of an agent to a robot: its features, and the acceleration that its action becomes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from artde_gym.layout import Layout
from controllers.laws.tracking import Array


class ActionAdapter(Protocol):
    """One robot's. All arrays may have leading axes, one entry an environment; memory is a named tuple of arrays."""

    features: Layout
    actions: tuple[str, ...]
    reward_scales: Mapping[str, float]

    def start(self, observation: Array) -> Any:
        """Memory at the start of an episode."""
        ...

    def observe(self, observation: Array, inside: Mapping[str, Array], state: Any) -> tuple[Array, Any]:
        """Return the agent's features (..., n_features) and the next state.

        Args:
            observation: of the environment.
            inside: what the base remembers of the sample before, and what it is about to see.
            state: of the call before.
        """
        ...

    def set_action(self, state: Any, action: Array) -> Any:
        """Memory with an action (..., n_actions) in [-1, 1] that acts until the next one."""
        ...

    def next_residual(self, state: Any) -> tuple[Array, Any]:
        """Return the acceleration du (..., n) of one control period and the next state."""
        ...

    def reward_terms(self, observation: Array, state: Any, fell: Any) -> dict[str, Array]:
        """Terms of the reward of one decision by name, at its end, observed already; weighted by `reward_scales`."""
        ...


def total(scales: Mapping[str, float], terms: Mapping[str, Array]) -> Array:
    """Sum scales times terms."""
    return np.asarray(sum(scale * terms[name] for name, scale in scales.items()))
