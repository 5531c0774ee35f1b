"""Figures of the walk: references of the feet and joints, ground reaction forces, and the tilt."""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.multibody.dynamics import RigidBodyTree
from artde_gym.palette import OTHERS, Style, styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.diagram import Block, diagram
from artde_gym.report.html import figure, paragraph
from artde_gym.report.run import NO_STRIP, Band, Episode, Signals, Strip
from artde_gym.report.signals import add, add_strip, over_time
from artde_gym.robots.ojas.model import ojas
from artde_gym.robots.ojas.walking import walking_pattern

SHOWN_DURATION = 10.0  # s of the walk, from its start
SIDES: dict[str, Style] = {"left": OTHERS[3], "right": OTHERS[4]}
BODY = {"center of mass": OTHERS[2], **{f"{side} foot": look for side, look in SIDES.items()}}
SUPPORT = {"left foot": SIDES["left"], "both feet": Style("#7F7F7F", "s"), "right foot": SIDES["right"]}
"""Support phase -> its style in the strip below every chart."""
_NAMES = "support on the left foot, both (gray), the right foot"
_LOADED = 0.001  # share of the weight from which a foot stands
PERIOD = 0.001  # s, sampling period of the pattern


_JOINTS: tuple[Block, ...] = (
    (6, 30, 84, ("walking", "pattern")),
    (140, 30, 140, ("u = qdd_ref + Kd ed", "+ Kp e + du")),
    (330, 30, 84, ("Ojas,", "12 joints")),
    (140, 120, 140, ("adaptation by |s|, |xi|", "of b0, b1 (or c)")),
    (330, 120, 84, ("delay L:", "tau, a")),
)
_JOINT_WIRES = (
    ("M90 53H140", "q_ref", 115, 47),
    ("M280 53H330", "tau", 305, 47),
    ("M190 120V76", "du", 178, 102),
    ("M372 76V120", "q, qd", 390, 102),
    ("M330 152H280", "xi", 305, 147),
    ("M330 134H305V100H250V76", "tau - m_bar a", 268, 113),
)


def figures(episode: Episode) -> list[str]:
    """Return figures of the ground's force and the tilt in one episode."""
    return [_ground(episode), _tilt(episode)]


def strip(episode: Episode) -> Strip:
    """Return the support phase, as the feet's contact shows it, under the first controller of an episode."""
    name, signals = next(iter(episode.signals.items()))
    if "contact" not in signals.fields:
        return NO_STRIP
    return Strip(f" Strip below: {_NAMES}, under {name}.", _bands(signals.fields["contact"] > 0.5, signals.time))


def pattern_of(kwargs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of the walking pattern among those of an environment."""
    known = inspect.signature(walking_pattern).parameters
    return {name: value for name, value in kwargs.items() if name in known}


def loop() -> str:
    """Return the block diagram of one loop for all joints."""
    name = "Block diagram: reference, law with adaptation, robot, and the estimate of one step ago"
    return diagram(name, 190, _JOINTS, _JOINT_WIRES)


def reference(kwargs: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return figures of the loop and of the walking pattern for an environment's arguments."""
    arguments = pattern_of(kwargs)
    return {"ojas": [loop()], f"pattern {json.dumps(arguments)}": _pattern(arguments)}


def _bands(standing: NDArray[np.bool_], time: Array) -> list[Band]:
    """Return where each support phase lasts, from which feet stand (samples, 2); on no foot, there is none."""
    left, right = standing.T
    phases = dict(zip(SUPPORT, (left & ~right, left & right, right & ~left), strict=True))
    return [Band(text, SUPPORT[text], _spans(holds, time)) for text, holds in phases.items()]


def _spans(holds: NDArray[np.bool_], time: Array) -> list[tuple[float, float]]:
    """Return beginnings and ends of the parts of the time in which something holds."""
    change = np.diff(np.concatenate([[False], holds, [False]]).astype(int))
    first, stop = np.flatnonzero(change > 0), np.flatnonzero(change < 0)
    return [(float(time[i]), float(time[min(k, len(time) - 1)])) for i, k in zip(first, stop, strict=True)]


def _pattern(arguments: Mapping[str, Any]) -> list[str]:
    """Return figures of the reference of the center of mass, the feet and the joints."""
    pattern = walking_pattern(**arguments, period=PERIOD)
    part = slice(0, round(SHOWN_DURATION / PERIOD), 10)
    time = PERIOD * np.arange(len(pattern.q))[part]
    com = pattern.base[part] + RigidBodyTree(ojas("none")).center_of_mass(pattern.q[part])
    paths = {"center of mass": com, "left foot": pattern.feet[part, 0], "right foot": pattern.feet[part, 1]}
    load = pattern.load_left[part]
    planned = Strip("", _bands(np.stack([load > _LOADED, load < 1 - _LOADED], axis=-1), time))
    trajectories = {}
    for i, axis in enumerate("xyz"):
        chart = _chart(
            f"Desired {axis} of center of mass and feet", f"{axis} (m)", time, [p[:, i] for p in paths.values()]
        )
        for name, path in paths.items():
            chart.line(time, path[:, i], BODY[name], text=name)
        add_strip(chart, planned)
        trajectories[axis] = chart.svg()
    joints = {}
    for i in range(6):
        columns = {side: np.degrees(pattern.q[part, i + 6 * j]) for j, side in enumerate(SIDES)}
        chart = _chart(f"Desired trajectory of q{i + 1}", "angle (deg)", time, list(columns.values()))
        for side, column in columns.items():
            chart.line(time, column, SIDES[side], text=side)
        add_strip(chart, planned)
        joints[f"q{i + 1}"] = chart.svg()
    first = f"the first {min(SHOWN_DURATION, float(time[-1])):.0f} s; strip below: {_NAMES}"
    return [
        figure(f"Desired trajectories of the center of mass and the ankles, {first}.", trajectories, BODY),
        figure(f"Desired joint trajectories of both legs, {first}.", joints, SIDES),
    ]


def _ground(episode: Episode) -> str:
    """Return a figure of the ground's vertical force on each foot, one chart per controller."""
    charts = {}
    for name, signals in episode.signals.items():
        loads = _loads(signals)
        if loads is None:
            continue
        time = signals.time[: len(loads)]
        chosen = time <= SHOWN_DURATION
        chart = _chart(f"Ground reaction force under {name}", "force (N)", time[chosen], [loads[chosen]])
        for i, side in enumerate(SIDES):
            chart.line(time[chosen], loads[chosen, i], SIDES[side], text=side)
        if "contact" in signals.fields:
            add_strip(chart, Strip("", _bands(signals.fields["contact"] > 0.5, signals.time)))
        charts[name] = chart.svg()
    if not charts:
        return paragraph("Ground reaction forces are not among the stored signals of this run.", "soft")
    caption = f"Ground reaction force on each leg, vertical, the first {SHOWN_DURATION:.0f} s; strip below: {_NAMES}."
    return figure(caption, charts, SIDES)


def _loads(signals: Signals) -> Array | None:
    if "foot_loads" in signals.fields:
        return signals.fields["foot_loads"]
    if "ground_force" in signals.fields:
        return signals.fields["ground_force"][:, [2, 5]]
    return None


def _tilt(episode: Episode) -> str:
    """Return a figure of the torso's tilt, the first sign of a fall."""
    tilts = {name: np.degrees(np.linalg.norm(s.fields["tilt"], axis=-1)) for name, s in episode.signals.items()}
    chart = over_time(episode, "Tilt of the torso", "tilt (deg)", list(tilts.values()), zero=True)
    for name, tilt in tilts.items():
        add(chart, episode.signals[name], tilt, name)
    caption = f"Tilt of the torso, episode {episode.number}.{episode.strip.caption}"
    return figure(caption, {"": chart.svg()}, styles(episode.signals))


def _chart(name: str, label: str, time: Array, columns: list[Array]) -> Chart:
    return Chart(f"{name} over time", Axis("time (s)", 0.0, float(time[-1])), Axis.of(label, *columns))
