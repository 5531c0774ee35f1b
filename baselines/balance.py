"""A linear balance law for the biped: 28 gains from what the body does to where feet, body and ankles are shifted.

    [swing_x, body_x, stance_pitch, lean_pitch] = K_1 [pitch, pitch rate, velocity error x, displacement x]
    [swing_out, body_y, stance_roll]            = K_2 [roll, roll rate, velocity error y, displacement y]

in the mirror, under the gate, and clipped to [-1, 1], as in `baselines.ojas`. A classical rival of learned residuals:
it acts through the same channel, on the same features, and is written as a network of one layer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from artde_gym.layout import Layout
from baselines.network import Network

_TILT, _RATE, _SPEED, _SHIFT = 0.2, 1.0, 0.4, 0.05  # rad, rad/s, m/s, m: what is large of each
_PLANES = (
    (("swing_x", "body_x", "stance_pitch", "lean_pitch"), 1, 1, 0),
    (("swing_out", "body_y", "stance_roll"), 0, 0, 1),
)
"""Outputs, and the component of tilt, angular velocity, and of velocity error and displacement."""
GAINS = 4 * sum(len(outputs) for outputs, *_ in _PLANES)


def balance_network(gains: NDArray[np.float64], features: Layout, actions: tuple[str, ...]) -> Network:
    """Compute the law from its 28 gains, each the share of an action's range for a large input."""
    weight = np.zeros((features.size, len(actions)), np.float32)
    rows = iter(gains.reshape(-1, 4))
    for outputs, tilt, rate, axis in _PLANES:
        inputs = [
            features["tilt"].start + tilt,
            features["angular_velocity"].start + rate,
            features["velocity_error"].start + axis,
            features["displacement"].start + axis,
        ]
        for output in outputs:
            weight[inputs, actions.index(output)] = next(rows) / (_TILT, _RATE, _SPEED, _SHIFT)
    nothing = np.zeros(features.size, np.float32)
    return Network(nothing, nothing + np.float32(1.0), ((weight, np.zeros(len(actions), np.float32)),))
