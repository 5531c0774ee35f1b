"""Nominal inertia of Ojas on one foot, as `artde-gym design --law tde-switched` derives it from spec and gait.

mean(A)^-1 over the time on the left foot in a stride at 0.1 m/s with steps of 1 s and rotors; A is the constrained
inverse inertia, and the eigenvalues are at most 0.09 kg m^2.
"""

from __future__ import annotations

import numpy as np

CAP = 0.09  # kg m^2; 22 CAP = 1.98: valid in every phase of support
_LOWER = (
    (0.08746,),
    (0.00025, 0.08632),
    (-0.00177, 0.00262, 0.07825),
    (0.00201, -0.00582, 0.00899, 0.07759),
    (-0.00047, 0.00298, -0.00201, 0.00509, 0.08735),
    (-0.00002, 0.00114, -0.0007, 0.00174, -0.00092, 0.08965),
    (-0.0041, -0.00096, 0.00014, -0.00093, 0.00104, 0.00045, 0.05038),
    (0.00008, -0.00507, 0.00273, -0.00745, 0.00403, 0.00157, 0.00136, 0.08261),
    (0.00086, -0.00138, -0.00816, 0.00247, 0.0009, 0.00048, -0.00325, -0.0019, 0.07425),
    (-0.00156, 0.00124, -0.00052, -0.00139, 0.00112, -0.0003, -0.00118, 0.0013, 0.01238, 0.05837),
    (-0.00029, -0.00012, -0.00004, 0.0003, -0.00018, 0.00004, -0.00018, -0.00019, 0.00149, 0.00131, 0.04629),
    (0.00013, 0.00004, 0.00018, -0.00033, 0.00015, -0.00005, -0.0001, 0.00168, -0.00013, 0.00013, -0.00004, 0.04557),
)
_SIGNS = (-1.0, -1.0, 1.0, 1.0, 1.0, -1.0)
"""Of a leg's joints in a mirror: yaw and rolls turn the other way."""


def _left() -> np.ndarray:
    matrix = np.zeros((len(_LOWER), len(_LOWER)))
    for i, row in enumerate(_LOWER):
        matrix[i, : i + 1] = matrix[: i + 1, i] = row
    return matrix


def _mirrored(matrix: np.ndarray) -> np.ndarray:
    """Exchange the legs."""
    legs = np.roll(np.arange(len(matrix)), len(matrix) // 2)
    signs = np.tile(_SIGNS, 2)
    return signs[:, None] * matrix[np.ix_(legs, legs)] * signs


M_BAR_LEFT: list[list[float]] = _left().tolist()
M_BAR_RIGHT: list[list[float]] = _mirrored(_left()).tolist()
"""On the right foot: that on the left one with the legs exchanged, since the gait is symmetric."""
