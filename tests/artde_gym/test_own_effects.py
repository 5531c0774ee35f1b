"""A kind of this project may be an effect alone: its entry in `kinds.py` names a function beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.disturbances import DisturbanceSpec, Load, Parameter, RobotStates
from artde_gym.disturbances.kinds import DISTURBANCES


def lift(values: Mapping[str, Any], states: RobotStates) -> Load:
    return Load(force=values["force"][:, None] * np.array([0.0, 0.0, 1.0]))


def test_an_entry_of_the_table_with_an_effect_acts(monkeypatch: pytest.MonkeyPatch) -> None:
    force = Parameter("force", "N", 0.0, 5.0, None, "upward force")
    kind = DisturbanceSpec("lift", "A lift.", (force,), requires="flight", shorthand="force", effect=lift)
    DISTURBANCES.find("payload")  # loads plug-ins
    monkeypatch.setitem(DISTURBANCES._entries, "lift", kind)
    heights = {}
    for disturbances in ({}, {"lift": 5.0}):
        env: Any = gym.make("QuadInfinity-Payload-v0", engine="mujoco", duration=0.2, disturbances=disturbances)
        observation, _ = env.reset(seed=0)
        hover = np.array([17.66, 0.0, 0.0, 0.0])
        for _ in range(5):
            observation, *_ = env.step(hover)
        heights[len(disturbances)] = env.unwrapped.observation_layout.split(observation)["position"][2]
    assert heights[1] > heights[0]
