"""A small network on NumPy: features, normalized, through layers of tanh to an action in [-1, 1]^n.

    x = clip((features - mean) / sqrt(variance + 1e-8), -10, 10)
    x = tanh(x W_i + b_i)     for each hidden layer
    action = clip(x W + b, -1, 1)

A row's action does not depend on what other rows there are, to the bit.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import OptionError
from controllers.laws.tracking import Array

Float = NDArray[np.float32]

EPSILON = 1e-8  # of Stable-Baselines3's VecNormalize, as is the clipping
CLIP = 10.0


@dataclasses.dataclass(frozen=True)
class Network:
    """Weights of the network at the top, all float32.

    Attributes:
        mean, variance: of the features, (n,).
        layers: (W (inputs, outputs), b (outputs,)) of each layer, the last one linear.
        squashed: whether the last one is followed by tanh, as SAC's actor has it.

    Raises:
        OptionError: without layers, or for a variance that is not finite and >= 0.
    """

    mean: Float
    variance: Float
    layers: tuple[tuple[Float, Float], ...]
    squashed: bool = False

    def __post_init__(self) -> None:
        if not self.layers:
            raise OptionError("layers", self.layers, "at least one")
        if not (np.isfinite(self.variance) & (self.variance >= 0.0)).all():
            raise OptionError("smallest variance", float(self.variance.min()), "finite numbers >= 0")

    @functools.cached_property
    def _scale(self) -> Float:
        return (1.0 / np.sqrt(self.variance.astype(np.float64) + EPSILON)).astype("f4")

    def __call__(self, features: Array) -> Float:
        """Return the action (..., n_actions) for features (..., n_features)."""
        x = (features.astype(np.float32) - self.mean) * self._scale
        x = np.minimum(np.maximum(x, -CLIP), CLIP)[..., None, :]  # one product a row: a batch rounds differently
        last = len(self.layers) - 1
        for i, (weight, bias) in enumerate(self.layers):
            x = np.matmul(x, weight) + bias
            if i < last or self.squashed:
                x = np.tanh(x)
        return np.minimum(np.maximum(x[..., 0, :], -1.0), 1.0)
