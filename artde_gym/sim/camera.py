"""A camera, and where it shows what: the same for every engine."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from artde_gym.arrays import Array
from artde_gym.multibody.spec import Vector

FIELD_OF_VIEW = 40.0  # degrees, from the lower to the upper edge
NEAR = 0.05  # m, before the eye, where a picture begins


class Camera(NamedTuple):
    """A camera that looks at `target` (m) from `distance` (m), `yaw_deg` about z and `pitch_deg` above the horizon."""

    target: Vector
    distance: float = 1.9
    yaw_deg: float = 55.0
    pitch_deg: float = 12.0
    width: int = 640
    height: int = 480

    @property
    def axes(self) -> Array:
        """Unit vectors to the right, up and away from the eye, one a row, in world axes."""
        yaw, pitch = math.radians(self.yaw_deg), math.radians(self.pitch_deg)
        right = (math.cos(yaw), math.sin(yaw), 0.0)
        away = (-math.sin(yaw) * math.cos(pitch), math.cos(yaw) * math.cos(pitch), -math.sin(pitch))
        return np.array([right, np.cross(right, away), away])

    @property
    def eye(self) -> Array:
        """Where the camera is (m)."""
        return np.asarray(self.target) - self.distance * self.axes[2]

    @property
    def focal_length(self) -> float:
        """In pixels: what is as far away as it is long fills so many."""
        return self.height / 2 / math.tan(math.radians(FIELD_OF_VIEW / 2))

    def pixels(self, points: ArrayLike) -> Array:
        """Column and row (n, 2), from the upper left corner, of points (n, 3) (m); NaN for what is behind the eye."""
        right, up, away = self.axes @ (np.asarray(points, dtype=np.float64) - self.eye).T
        away = np.where(away > NEAR, away, np.nan)
        scale = self.focal_length / away
        return np.stack([self.width / 2 + scale * right, self.height / 2 - scale * up], axis=-1)
