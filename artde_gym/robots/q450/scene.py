"""The Q450 as replays show it: its body and the path that it is meant to fly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from artde_gym.motion.scene import Outlook, Scene
from artde_gym.robots.q450.infinity import infinity_path
from artde_gym.robots.q450.model import q450

PERIOD = 0.015  # s, of the path
DURATION = 70.0  # s, the environment's own


def scene(kwargs: Mapping[str, Any]) -> Scene:
    """Return what is drawn of a flight with these arguments of the environment."""
    spec = q450()
    path = infinity_path(kwargs.get("duration", DURATION), PERIOD).position
    outlook = Outlook(distance=3.8, yaw_deg=35.0, pitch_deg=24.0, height=0.55, reach=2.6, follows=False)
    return Scene.of(spec, outlook=outlook, tint=spec.base.visuals[2].color, path=path)
