"""The Q450 as replays show it: its body and the path that it is meant to fly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.motion.scene import Outlook, Scene
from artde_gym.robots.q450.infinity import LIFT, infinity_path
from artde_gym.robots.q450.model import q450

PERIOD = 0.015  # s, of the path
DURATION = 70.0  # s, the environment's own
SLING = "QuadSling-Payload-v0"


def scene(kwargs: Mapping[str, Any], env_id: str | None = None) -> Scene:
    """Return the scene of a flight with these arguments of the environment, its path raised for a load on a cable."""
    spec = q450()
    lift = LIFT if env_id == SLING else 0.0
    path = np.add(infinity_path(kwargs.get("duration", DURATION), PERIOD).position, (0.0, 0.0, lift))
    outlook = Outlook(distance=3.8, yaw_deg=35.0, pitch_deg=24.0, height=0.55 + lift, reach=2.6, follows=False)
    return Scene.of(spec, outlook=outlook, tint=spec.base.visuals[2].color, path=path)
