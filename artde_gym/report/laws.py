"""Gains of a run's controllers, and the conditions that follow from them."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from scipy.linalg import eigh

from artde_gym.arrays import Array
from artde_gym.evaluation.console import REFERENCE
from artde_gym.evaluation.environments import single, single_arguments
from artde_gym.multibody.dynamics import RigidBodyTree, joint_space_inertia
from artde_gym.multibody.spec import RobotSpec
from artde_gym.palette import OTHERS
from artde_gym.registration import make_controller, registered_controllers
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import Cell, details, figure, paragraph, table
from artde_gym.report.run import Run

SAMPLES = 200  # of the reference, at which the inertia is computed
LOOP = {"position": "_p", "attitude": "_q"}

Gains = Mapping[str, Any]


class Laws:
    """The gains of a run's controllers, rebuilt by name; an unregistered name has none."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self.gains = functools.cache(self._find_gains)  # scenario -> the same dict, found once per report

    def robot(self, scenario: str) -> Any:
        """Return the nominal robot: a `RobotSpec`, or a plug-in's own model."""
        return self._environment(scenario).unwrapped.nominal_robot

    def _find_gains(self, scenario: str) -> dict[str, Gains]:
        """Return controller -> gain -> value; names of a cascade's gains end in _p and _q."""
        env, found, given = self._environment(scenario), {}, self._run.gains(scenario)
        for name in self._run.result.controllers:
            if name in registered_controllers():
                policy = make_controller(name, env, **given.get(name, {}))
                found[name] = dict(_flat(getattr(policy, "gains", None)))
        return found

    def lyapunov_matrix(self, scenario: str) -> tuple[str, Array, Array, Array] | None:
        """Return (controller, p11, p12, p22) of P in A^T P + P A = -I for one controller's Kp and Kd; None without any.

        With scalar gains, p12 = 1 / (2 Kp), p22 = (1 + Kp) / (2 Kp Kd), p11 = Kd p12 + Kp p22.
        """
        gains = self.gains(scenario)
        for name in sorted(gains, key=lambda name: name != REFERENCE):
            for suffix in ("", "_p"):
                if f"k_p{suffix}" in gains[name] and f"k_d{suffix}" in gains[name]:
                    k_p, k_d = (np.asarray(gains[name][f"{gain}{suffix}"], dtype=np.float64) for gain in ("k_p", "k_d"))
                    p12, p22 = 1 / (2 * k_p), (1 + k_p) / (2 * k_p * k_d)
                    return name, k_d * p12 + k_p * p22, p12, p22
        return None

    def section(self, scenario: str) -> list[str]:
        """Return the gains as a table, and the convergence condition of time-delay estimation."""
        gains = self.gains(scenario)
        names = list(dict.fromkeys(gain for own in gains.values() for gain in own))
        rows = [[gain, *(_shown(own.get(gain)) for own in gains.values())] for gain in names]
        parts = [details("Gains", table("Gains of the controllers (SI units)", ["gain", *gains], rows))] if rows else []
        return parts + self._validity(scenario)

    def _validity(self, scenario: str) -> list[str]:
        """Return charts of the eigenvalues of M^-1 m_bar, which must lie in (0, 2)."""
        nominal = {}
        for name, own in self.gains(scenario).items():
            for gain in ("m_bar", "m_bar_left", "m_bar_right", "m_bar_p", "m_bar_q"):
                if gain in own:
                    nominal.setdefault(json.dumps([gain, np.asarray(own[gain]).tolist()]), []).append(name)
        if not nominal:
            return []
        robot = self.robot(scenario)
        if isinstance(robot, RobotSpec) and not robot.actuated:
            return [self._rigid_body(robot, nominal)]
        inertia_at = inertia_of(robot)
        if inertia_at is None:
            return []
        episode = self._run.episode(scenario)
        if episode is None:
            return []
        signals = next(iter(episode.signals.values()))
        q = signals.fields["q_ref"][:: max(1, len(signals.time) // SAMPLES)].astype(np.float64)
        time = signals.time[:: max(1, len(signals.time) // SAMPLES)]
        inertia = inertia_at(q)
        charts = {}
        for key, names in nominal.items():
            gain, m_bar = json.loads(key)
            given = np.asarray(m_bar, dtype=np.float64)
            weight = given if given.ndim == 2 else np.diag(np.broadcast_to(given, q.shape[1]))
            values = np.array([eigh(weight, one, eigvals_only=True) for one in inertia])
            title = f"{gain} = {_text(m_bar)}: {', '.join(names)}"
            chart = Chart(f"Eigenvalues of M^-1 m_bar for {title}", Axis("time (s)", 0, float(time[-1])),
                          Axis.of("eigenvalue (1)", values, [2.0], zero=True))  # fmt: skip
            for column in values.T:
                chart.line(time, column, OTHERS[2])
            chart.level(2.0, "limit: 2")
            verdict = "inside (0, 2)" if values.min() > 0 and values.max() < 2 else "outside (0, 2): it may diverge"
            charts[f"{title}; {values.min():.3f} to {values.max():.3f}, {verdict}"] = chart.svg()
        caption = (
            "Time-delay estimation converges where every eigenvalue of M^-1 m_bar lies in (0, 2). M is the joint-space "
            "inertia of the free robot along the reference, without payload."
        )
        return [figure(caption, charts)]

    def _rigid_body(self, robot: Any, nominal: Mapping[str, list[str]]) -> str:
        mass, inertia = robot.mass, np.asarray(robot.base.inertia)
        rows = []
        for key, names in nominal.items():
            gain, m_bar = json.loads(key)
            values = np.asarray(m_bar) / (inertia if gain.endswith("_q") else mass)
            low, high = float(np.min(values)), float(np.max(values))
            loop = "attitude" if gain.endswith("_q") else "position"
            inside = low > 0 and high < 2
            rows.append([
                loop, Cell(", ".join(names), kind="text"), _text(m_bar), f"{low:.3f} to {high:.3f}",
                Cell("inside (0, 2)" if inside else "outside (0, 2)", kind="holds" if inside else "fails"),
            ])  # fmt: skip
        caption = "Eigenvalues of M^-1 m_bar, without payload: time-delay estimation converges inside (0, 2)"
        return table(caption, ["loop", "controllers", "m_bar (kg, kg m^2)", "eigenvalues", "verdict"], rows)

    def _environment(self, scenario: str) -> Any:
        cell = self._run.cell(scenario)
        return single(cell["env_id"], json.dumps(single_arguments(cell["env_id"], cell["kwargs"])))


def inertia_of(robot: Any) -> Callable[[Array], Array] | None:
    """Return the joint-space inertia (..., n, n) of a nominal robot as a function of q (..., n); None without one.

    A plug-in's own model may provide it as `joint_inertia`.
    """
    if isinstance(robot, RobotSpec):
        tree = RigidBodyTree(robot)
        return lambda q: joint_space_inertia(tree.mass_matrix(q))
    return getattr(robot, "joint_inertia", None)


def unavailable(error: Exception) -> str:
    """Return the text for a controller or an environment that can no longer be built."""
    return paragraph(f"Gains are not shown: {error}.", "soft")


def _flat(gains: Any) -> Iterator[tuple[str, Any]]:
    if not dataclasses.is_dataclass(gains):
        return
    for field in dataclasses.fields(gains):
        value = getattr(gains, field.name)
        if dataclasses.is_dataclass(value):
            yield from ((f"{name}{LOOP.get(field.name, '')}", inner) for name, inner in _flat(value))
        else:
            yield field.name, value


def _shown(value: Any) -> str | Cell:
    if value is None or isinstance(value, (str, bool)):
        return "" if value is None else str(value)
    return Cell(_text(value), float(value) if np.ndim(value) == 0 else None)


def _text(value: Any) -> str:
    if np.ndim(value) == 2:
        values = np.linalg.eigvalsh(np.asarray(value))
        return f"{len(values)} x {len(values)}, eigenvalues {values[0]:.4g} to {values[-1]:.4g}"
    return ", ".join(f"{number:.4g}" for number in np.ravel(value))
