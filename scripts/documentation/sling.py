"""The figure of a load on a cable: three laws after a kick."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

import controllers
from artde_gym.arrays import Array
from artde_gym.palette import styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import figure

KICK = 1.0  # s
DURATION = 7.0  # s
LAWS: dict[str, dict[str, Any]] = {"tde": {"preset": "tuned"}, "tde+swing": {}, "geometric-load": {}}


def swing() -> str:
    """Swing and load error over time."""
    runs = {name: _flown(name, gains) for name, gains in LAWS.items()}
    shown = styles(runs)
    charts: dict[str, str] = {}
    for number, label in enumerate(("swing (deg)", "load's error (mm)")):
        values = [run[number] for run in runs.values()]
        chart = Chart(f"{label} over time", Axis("time (s)", 0.0, DURATION), Axis.of(label, *values, zero=True))
        chart.event(KICK, KICK + 0.2, "kick")
        for (name, run), value in zip(runs.items(), values, strict=True):
            chart.line(run[2], value, shown[name], text=name)
        charts[label.split(" (")[0]] = chart.svg()
    caption = (
        f"0.35 kg on 0.5 m, no wind; the load is kicked by 0.8 m/s at {KICK:g} s. TDE at its tuned gains tracks best "
        "and leaves the load swinging."
    )
    return figure(caption, charts, shown)


def _flown(name: str, gains: dict[str, Any]) -> tuple[Array, Array, Array]:
    """Swing (deg), load error (mm), time (s)."""
    push = {"body": "payload", "magnitude": 1.4, "direction": [1, 1, 0], "start": KICK, "duration": 0.2}
    given = {"payload": {"mass": 0.35, "cable": 0.5}, "push": push}
    env: Any = gym.make_vec(
        "QuadSling-Payload-v0", 1, "vector_entry_point", engine="numpy", disturbances=given, duration=DURATION
    )
    policy = controllers.make(name, env, **gains)
    observation, info = env.reset(seed=0)
    state, seen = None, []
    while not seen or seen[-1][2] < DURATION - env.unwrapped.control_period:
        action, state = policy.predict(observation, state)
        observation, _, _, _, info = env.step(action)
        seen.append((np.degrees(info["swing"][0]), 1e3 * info["load_error"][0], info["time_s"][0]))
    angle, error, time = np.array(seen).T
    return angle, error, time
