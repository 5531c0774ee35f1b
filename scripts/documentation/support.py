"""The figure of the laws that switch: what the joints feel along a stride, and how the law follows the contact."""

from __future__ import annotations

from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.palette import OTHERS
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import figure
from controllers.drive import DRIVES
from controllers.drives.ojas import supports
from controllers.laws.stability import support_eigenvalues
from controllers.laws.switched import SupportState, SwitchedTdeGains, support_phase
from controllers.laws.tde import Inertia

PERIOD = 0.004  # s
LOOKS = {"m_bar 0.042": OTHERS[0], "m_bar 0.077": OTHERS[4], "switched": OTHERS[3]}
FOLLOWED = {"contact": OTHERS[2], "phase": OTHERS[1], "b": OTHERS[5]}


def switched() -> str:
    gains: SwitchedTdeGains = DRIVES["ojas"].presets["tde-switched", "support"].gains
    own: dict[str, Inertia] = {"left": gains.m_bar_left, "both": gains.m_bar, "right": gains.m_bar_right}
    chosen: dict[str, dict[str, Inertia]] = {f"m_bar {m}": dict.fromkeys(own, m) for m in (0.042, 0.077)}
    caption = (
        "Left: largest eigenvalue of A m_bar along a stride, whose limit is 2. Right: a foot that bounces on landing, "
        "the phase that the law makes of its contact, and b."
    )
    charts = {"what the joints feel": _stride({**chosen, "switched": own}), "phase and blend": _bounce(gains)}
    return figure(caption, charts, LOOKS | FOLLOWED)


def _stride(chosen: dict[str, dict[str, Inertia]]) -> str:
    phases = supports()
    time = np.concatenate([phase.time for phase in phases])
    order = np.argsort(time)
    lines: dict[str, Array] = {}
    for name, m_bar in chosen.items():
        found: list[Any] = [support_eigenvalues(phase.inverse_inertia, m_bar[phase.name])[:, -1] for phase in phases]
        lines[name] = np.concatenate(found)[order]
    shown = time[order] - time.min()
    y = Axis.of("largest eigenvalue (1)", *lines.values(), [2.0], zero=True)
    chart = Chart("Largest eigenvalue of A m_bar along a stride", Axis("time (s)", 0.0, float(shown[-1])), y)
    for name, values in lines.items():
        chart.line(shown, values, LOOKS[name], text=name)
    chart.level(2.0, "limit: 2")
    return chart.svg()


def _bounce(gains: SwitchedTdeGains) -> str:
    time = PERIOD * np.arange(150)
    left = (time > 0.1) & ~((time > 0.108) & (time < 0.118)) & ~((time > 0.128) & (time < 0.134))
    right = time < 0.3
    zero = np.zeros(())
    state, seen = SupportState(zero, zero, zero, zero), []
    for contact in np.stack([left, right], axis=-1).astype(float):
        state = support_phase(gains, state, contact, PERIOD)
        seen.append((contact[0] - contact[1], state.phase, state.blend))
    chart = Chart("Contact, phase and blend over time", Axis("time (s)", 0.0, float(time[-1])),
                  Axis("1 left, 0 both, -1 right", -1.1, 1.1))  # fmt: skip
    for (name, look), values in zip(FOLLOWED.items(), np.array(seen).T, strict=True):
        chart.line(time, values, look, text=name)
    return chart.svg()
