"""A pinhole camera with the same projection in every engine."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from artde_gym.arrays import Array
from artde_gym.multibody.spec import Vector

FIELD_OF_VIEW = 40.0  # degrees, vertical
NEAR = 0.05  # m, distance of the near clipping plane


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
        """Unit vectors to the right, up and forward in the rows, in world axes."""
        yaw, pitch = math.radians(self.yaw_deg), math.radians(self.pitch_deg)
        right = (math.cos(yaw), math.sin(yaw), 0.0)
        away = (-math.sin(yaw) * math.cos(pitch), math.cos(yaw) * math.cos(pitch), -math.sin(pitch))
        return np.array([right, np.cross(right, away), away])

    @property
    def eye(self) -> Array:
        """Position of the camera (m)."""
        return np.asarray(self.target) - self.distance * self.axes[2]

    @property
    def focal_length(self) -> float:
        """Focal length (pixels): the size in the image of an object as long as it is far away."""
        return self.height / 2 / math.tan(math.radians(FIELD_OF_VIEW / 2))

    def pixels(self, points: ArrayLike) -> Array:
        """Return column and row (n, 2), from the upper left corner, of points (n, 3) (m); NaN behind the camera."""
        right, up, away = self.axes @ (np.asarray(points, dtype=np.float64) - self.eye).T
        away = np.where(away > NEAR, away, np.nan)
        scale = self.focal_length / away
        return np.stack([self.width / 2 + scale * right, self.height / 2 - scale * up], axis=-1)
