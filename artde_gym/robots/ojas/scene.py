"""Ojas as replays show it: its bodies, the path that it is meant to walk, and its footholds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.motion.scene import Outlook, Scene
from artde_gym.robots.ojas.model import FOOT_CENTER_AHEAD, FOOT_SIZE, ojas
from artde_gym.robots.ojas.report import PERIOD, pattern_of
from artde_gym.robots.ojas.walking import walking_pattern

GROUNDED = 1e-6  # m, that an ankle may be above its lowest
STRIDE = 20  # samples of the pattern


def scene(kwargs: Mapping[str, Any], env_id: str | None = None) -> Scene:
    """Return the scene of a walk with these arguments of the environment, the same for all its ids."""
    del env_id
    spec = ojas(kwargs.get("actuator_inertia", "rotor"), arms=kwargs.get("arms", "fixed"))
    pattern = walking_pattern(**pattern_of(kwargs), period=PERIOD)
    path = pattern.base[::STRIDE] * (1.0, 1.0, 0.0) + (0.0, 0.0, 0.004)
    return Scene.of(
        spec,
        outlook=Outlook(distance=1.9, yaw_deg=55.0, pitch_deg=12.0, height=0.42, reach=1.2),
        tint=spec.base.visuals[0].color,
        path=path,
        footholds=_footholds(pattern.feet[::STRIDE]),
        sole=FOOT_SIZE[:2],
    )


def _footholds(ankles: Array) -> tuple[tuple[float, float], ...]:
    """Return the middles of the soles on the ground, of ankles (samples, 2, 3) over time."""
    standing = ankles[ankles[..., 2] <= ankles[..., 2].min() + GROUNDED]
    places = np.unique(np.round(standing[:, :2] + (FOOT_CENTER_AHEAD, 0.0), 4), axis=0)
    return tuple((x, y) for x, y in places.tolist())
