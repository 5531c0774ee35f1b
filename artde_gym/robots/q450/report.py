"""Figures of the flight: flown and reference path in space and in two planes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.palette import styles
from artde_gym.report.chart import Axis, Chart, height_of
from artde_gym.report.diagram import Block, diagram
from artde_gym.report.html import figure
from artde_gym.report.run import Episode
from artde_gym.report.signals import over_time

PLANES = {"XZ": (0, 2), "YZ": (1, 2), "XY": (0, 1)}
WIDTH = 400
AZIMUTH, ELEVATION = math.radians(-60.0), math.radians(28.0)  # rad, of the camera
GRID = 0.5  # m, spacing of the floor's grid
LOAD = {
    "swing": ("swing (deg)", 180.0 / math.pi),
    "load_error": ("load's error (mm)", 1e3),
    "cable_impulse": ("cable's impulse (Ns)", 1.0),
}
"""Signal -> title of its chart, and factor."""
SAMPLE_STRIDE = 4  # stored samples per drawn point: a path needs fewer than a signal


_CASCADE: tuple[Block, ...] = (
    (6, 20, 84, ("infinity", "path")),
    (140, 20, 140, ("position loop: tau_p =", "applied + m_bar (u - a)")),
    (330, 20, 84, ("filter: R_d,", "w_d, alpha_d")),
    (330, 120, 84, ("attitude", "loop: tau_q")),
    (140, 120, 140, ("allocation to 4 rotors,", "with their limits")),
    (6, 120, 84, ("Q450, load,", "wind")),
)
_CASCADE_WIRES = (
    ("M90 43H140", "p_ref", 115, 37),
    ("M280 43H330", "tau_p", 305, 37),
    ("M385 66V120", "R_d", 400, 97),
    ("M330 143H280", "u2..u4", 305, 137),
    ("M140 143H90", "thrusts", 115, 137),
    ("M345 66V94H235V120", "u1 = tau_p . R e3", 292, 88),
    ("M48 166V200H372V166", "R, w, and the torques applied one L ago", 210, 195),
    ("M48 120V94H185V66", "p, v, force one L ago", 112, 88),
)


def loop() -> str:
    """Return the block diagram of an outer position loop and an inner attitude loop."""
    name = "Block diagram of the cascade: position loop, desired attitude, attitude loop, allocation, vehicle"
    return diagram(name, 205, _CASCADE, _CASCADE_WIRES)


def reference(_kwargs: Mapping[str, Any]) -> dict[str, list[str]]:
    """Return the figure of the loop, the same for all arguments."""
    return {"q450": [loop()]}


def figures(episode: Episode) -> list[str]:
    """Return figures of the infinity path in three dimensions and of its projections."""
    shown = styles(episode.signals)
    paths = {name: signals.fields["position"][::SAMPLE_STRIDE] for name, signals in episode.signals.items()}
    longest = max(episode.signals.values(), key=lambda signals: len(signals.time))
    wanted = longest.fields["position_ref"][::SAMPLE_STRIDE]
    charts = {"3D": _space(paths, wanted)}
    for plane, (i, j) in PLANES.items():
        everything = np.concatenate([wanted, *paths.values()])
        x, y = (Axis.of(f"{'xyz'[k]} (m)", everything[:, k]) for k in (i, j))
        height = height_of(x, y, WIDTH)
        chart = Chart(f"Flown and desired path in the {plane} plane", x, y, WIDTH, height)
        for name, path in paths.items():
            chart.line(path[:, i], path[:, j], shown[name], text=name, kind="path")
        chart.reference(wanted[:, i], wanted[:, j])
        charts[f"{plane} plane"] = chart.svg()
    caption = f"The infinity path, episode {episode.number} (seed {episode.seed}); dashed: the reference. Equal scales."
    return [figure(caption, charts, shown), *_load(episode)]


def _load(episode: Episode) -> list[str]:
    """Swing, error and impulses of a load on a cable, where there is one."""
    shown = styles(episode.signals)
    charts: dict[str, str] = {}
    for field, (title, scale) in LOAD.items():
        lines = {
            name: (signals.time, scale * signals.fields[field].ravel())
            for name, signals in episode.signals.items()
            if field in signals.fields
        }
        if not lines:
            return []
        chart = over_time(episode, title, title, [values for _, values in lines.values()], zero=True)
        for name, (time, values) in lines.items():
            chart.line(time, values, shown[name], text=name)
        charts[title.rpartition(" (")[0]] = chart.svg()
    caption = f"The load on the cable, episode {episode.number} (seed {episode.seed}); zero while nothing hangs. "
    caption += "The impulse is that of a control period."
    return [figure(caption, charts, shown)]


def _space(paths: dict[str, Array], wanted: Array) -> str:
    everything = np.concatenate([wanted, *paths.values()])
    low, high = np.floor(everything.min(0) / GRID) * GRID, np.ceil(everything.max(0) / GRID) * GRID
    low[2] = 0.0
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (0.0, high[2])])
    seen = _seen(np.concatenate([corners, everything]))
    x, y = Axis.of("", seen[:, 0]), Axis.of("", seen[:, 1])
    height = height_of(x, y, WIDTH)
    chart = Chart("Flown and desired path in three dimensions, with its shadow", x, y, WIDTH, height, frame=False)

    def segment(start: list[float], end: list[float]) -> None:
        x, y = _seen(np.array([start, end])).T
        chart.guide(x, y)

    def label(point: list[float], text: str) -> None:
        ((x, y),) = _seen(np.array([point]))
        chart.text(x, y, text)

    for value in np.arange(low[0], high[0] + GRID / 2, GRID):
        segment([value, low[1], 0], [value, high[1], 0])
        label([value, low[1] - 0.18, 0], f"{value:g}")
    for value in np.arange(low[1], high[1] + GRID / 2, GRID):
        segment([low[0], value, 0], [high[0], value, 0])
        label([high[0] + 0.18, value, 0], f"{value:g}")
    for value in np.arange(GRID, high[2] + GRID / 2, GRID):
        segment([low[0], low[1], value], [low[0] + 0.06, low[1], value])
        label([low[0] - 0.16, low[1], value], f"{value:g}")
    segment([low[0], low[1], 0], [low[0], low[1], high[2]])
    label([(low[0] + high[0]) / 2, low[1] - 0.5, 0], "x (m)")
    label([high[0] + 0.5, (low[1] + high[1]) / 2, 0], "y (m)")
    label([low[0] - 0.16, low[1], high[2] + 0.2], "z (m)")
    shadow = wanted * [1.0, 1.0, 0.0]
    across, up = _seen(shadow).T
    chart.guide(across, up)
    shown = styles(paths)
    for name, path in paths.items():
        across, up = _seen(path).T
        chart.line(across, up, shown[name], text=name, kind="path")
    across, up = _seen(wanted).T
    chart.reference(across, up)
    return chart.svg()


def _seen(points: Array) -> Array:
    """Return the parallel projection (n, 2) of points (n, 3)."""
    x, y, z = points.T
    right = -math.sin(AZIMUTH) * x + math.cos(AZIMUTH) * y
    away = math.cos(AZIMUTH) * x + math.sin(AZIMUTH) * y
    return np.stack([right, math.cos(ELEVATION) * z - math.sin(ELEVATION) * away], axis=-1)
