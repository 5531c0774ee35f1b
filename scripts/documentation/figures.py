"""A figure for each law: what it does on a plant of one degree of freedom, computed whenever the site is built."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from artde_gym.arrays import Array
from artde_gym.palette import styles
from artde_gym.report.chart import Axis, Chart
from artde_gym.report.html import figure
from artde_gym.robots.ojas.report import loop as joint_loop
from artde_gym.robots.q450.report import loop as cascade_loop
from controllers.drive import DRIVES
from controllers.law_table import LAWS
from controllers.laws.attitude import attitude_error
from controllers.laws.computed_torque import ComputedTorqueGains
from controllers.laws.positional_pid import PositionalPidGains
from controllers.laws.rigid_attitude import rigid_attitude
from controllers.laws.tde import ConstantGains, equivalent_gains
from controllers.laws.tracking import JointInput, components
from controllers.laws.vectors import joined
from controllers.presets import law_presets
from documentation.architecture import rooms
from documentation.plant import ARM, DURATION, LIFT, LOADED, PUSHED, Plant, Run, modeled, simulate
from documentation.sling import swing
from documentation.support import switched

ARM_PERIOD, LIFT_PERIOD = 0.004, 0.015  # s
NOISE = 0.02  # m/s, of a measured velocity
RATIOS = np.linspace(0.05, 2.5, 50)  # m_bar / M
STARTS = (30, 90, 150, 175)  # deg, of tilt
Signal = tuple[Array, Array]
"""Time, and values over it."""


def tde() -> str:
    feedback = PositionalPidGains(0.042, 25.0, 10.0, k_i=0.0, integral_limit=0.0)
    runs = {"tde": arm("tde"), "feedback alone": simulate(LAWS["positional-pid"].law, feedback, ARM, ARM_PERIOD)}
    periods = {f"L = {1e3 * period:g} ms": arm("tde", period=period) for period in (0.001, 0.002, 0.004)}
    charts = {
        "with and without the estimate": errors(runs, log=True),
        "error and sampling period": errors(periods),
        "when it converges": _validity(),
    }
    caption = (
        f"{_arm()} Feedback alone is m_bar u on top of the torque that held the arm at the start. RMS error "
        f"{_values(runs)}; {_values(periods)}. Last chart: the inertia varied, with a torque limit that keeps what "
        "diverges finite; from m_bar / M = 2 on the estimate of one sample contradicts that of the next."
    )
    return figure(caption, charts, styles([*runs, *periods])) + joint_loop()


def atde() -> str:
    runs = {name: arm(name) for name in ("tde", "atde")}
    charts = {
        "error": errors(runs),
        "gain c": over_time("c (rad/s^2)", {"atde": inside(runs["atde"], "c")}),
        "sliding variable": over_time("|s| (1)", {"atde": inside(runs["atde"], "s")}),
    }
    caption = f"{_arm()} RMS error {_values(runs)}. The gain moves by gamma_0 L |s| a sample, up while |s| grows."
    return figure(caption, charts, styles(runs))


def artde() -> str:
    runs = {name: arm(name) for name in ("tde", "atde", "artde")}
    runs["artde-robust"] = arm("artde", preset="robust")
    gain = float(np.mean(runs["artde"].inside["c"]))
    constant = dataclasses.replace(gains_of("ojas", "tde+c"), c=gain)
    runs["tde+kd"] = simulate(LAWS["tde"].law, equivalent_gains(constant), ARM, ARM_PERIOD)
    robust = {name: runs[name] for name in ("artde", "artde-robust")}
    charts = {
        "error": errors(runs),
        "b0": over_time("b0 (rad/s^2)", {name: inside(run, "beta_0") for name, run in robust.items()}),
        "b1": over_time("b1 (rad/s^2 per |xi|)", {name: inside(run, "beta_1") for name, run in robust.items()}),
    }
    caption = (
        f"{_arm()} RMS error {_values(runs)}. tde+kd is plain TDE with the stiffness that ARTDE had on average "
        f"(gain {gain:.3f} rad/s^2): what is left between the two is adaptation."
    )
    return figure(caption, charts, styles(runs))


def constant_gain() -> str:
    runs = {name: arm(name) for name in ("tde", "tde+c", "tde+kd")}
    constant: ConstantGains = gains_of("ojas", "tde+c")
    s = np.linspace(-0.03, 0.03, 301)
    sign = constant.alpha * constant.c * s / np.sqrt(s * s + constant.eps)
    line = constant.alpha * constant.c * s / math.sqrt(constant.eps)
    shape = Chart("Robust term over the sliding variable", Axis.of("s (1)", s), Axis.of("du (rad/s^2)", sign, line))
    for name, values in (("tde+c", sign), ("tde+kd", line)):
        shape.line(s, values, styles([name])[name], text=name)
    charts = {
        "error": errors(runs),
        "robust term": shape.svg(),
    }
    caption = f"{_arm()} RMS error {_values(runs)}. Right: the robust term of constant gain, and its slope at s = 0."
    return figure(caption, charts, styles(runs))


def pid() -> str:
    runs = {name: arm(name) for name in ("tde", "pid")}
    apart = (runs["tde"].tau - runs["pid"].tau)[:, 0]
    charts = {
        "error": errors(runs),
        "torque of TDE minus torque of PID": over_time(
            "difference (1e-15 Nm)", {"pid": (runs["pid"].time, 1e15 * apart)}
        ),
    }
    caption = (
        f"{_arm()} The two errors lie on each other: at most {np.abs(apart).max():.1e} Nm are between the torques."
    )
    return figure(caption, charts, styles(runs))


def positional_pid() -> str:
    runs = {"pid": lift("positional-pid", "pid", "tuned"), "tde": lift("tde")}
    needed = LIFT.load_weight / float(LIFT.inertia)
    learned, time = runs["pid"].inside["integral"][:, 0], runs["pid"].time
    charts = {
        "error": errors(runs),
        "what the integral has learned": over_time(
            "integral (m/s^2)", {"pid": (time, learned - learned[0])}, level=needed
        ),
    }
    caption = (
        f"{_lift()} RMS error {_values(runs)}; PID at its tuned gains, TDE at the thesis'. What the integral has to "
        f"learn is the load's weight over the nominal mass, {needed:.2f} m/s^2 (dashed)."
    )
    return figure(caption, charts, styles(runs))


def asmc() -> str:
    runs = {"asmc": lift("asmc"), "tde": lift("tde")}
    ratio = inside(runs["asmc"], "r")
    true = 1.0 + LIFT.load / float(LIFT.inertia)
    charts = {
        "error": errors(runs),
        "switching gain c": over_time("c (m/s^2)", {"asmc": inside(runs["asmc"], "c")}),
        "learned mass over nominal mass": over_time("r (1)", {"asmc": ratio}, level=true),
    }
    caption = f"{_lift()} RMS error {_values(runs)}. Dashed: the true ratio of masses with the load, {true:.3f}."
    return figure(caption, charts, styles(runs))


def indi() -> str:
    runs = {name: lift(name, noise=NOISE) for name in ("tde", "indi")}
    calm = {name: lift(name) for name in ("tde", "indi")}
    rough = ", ".join(f"{name} {np.std(np.diff(run.tau[:, 0])):.2f} N" for name, run in runs.items())
    charts = {
        "error": errors(runs),
        "force": over_time("force (N)", {name: (run.time, run.tau[:, 0]) for name, run in runs.items()}),
    }
    caption = (
        f"{_lift()} The measured velocity has noise of {100 * NOISE:g} cm/s. RMS error {_values(runs)}, and without "
        f"noise {_values(calm)}; standard deviation of the force's change from sample to sample: {rough}."
    )
    return figure(caption, charts, styles(runs))


def computed() -> str:
    gains = ComputedTorqueGains(25.0, 10.0)
    runs = {"computed-torque": simulate(modeled(ARM), gains, ARM, ARM_PERIOD), "tde": arm("tde")}
    charts = {"error": errors(runs, log=True)}
    before = {name: _rms(run, run.time < LOADED) for name, run in runs.items()}
    after = {name: _rms(run, run.time >= LOADED) for name, run in runs.items()}
    caption = (
        f"{_arm()} RMS error before the load: {_listed(before, 'deg')}; with it: {_listed(after, 'deg')}. The model "
        "that is exact without the load does not know it."
    )
    return figure(caption, charts, styles(runs))


def geometric() -> str:
    """Turn a rigid body back from a tilt about a skew axis."""
    gains = DRIVES["q450"].presets["geometric", "hand"].gains.attitude
    period, count = LIFT_PERIOD, round(2.0 / LIFT_PERIOD)
    time = period * np.arange(count)
    names = {f"{start} deg": start for start in STARTS}
    axis = np.array([1.0, 1.0, 0.3])
    axis /= np.linalg.norm(axis)
    angles, starts = np.empty((count, len(STARTS))), np.radians(STARTS)
    rotation = _turned(starts[:, None] * axis)
    rates = np.zeros((len(STARTS), 3))
    inertia = np.asarray(gains.inertia)
    for k in range(count):
        angles[k] = np.degrees(np.arccos(np.clip((np.trace(rotation, axis1=1, axis2=2) - 1) / 2, -1, 1)))
        e = _attitude_error(rotation)
        torque = rigid_attitude(gains, JointInput(-e, rates, 0 * e, 0 * e, 0 * e, 0 * e))
        for _ in range(10):
            rates = rates + (period / 10) * (torque - np.cross(rates, inertia * rates)) / inertia
            rotation = rotation @ _turned((period / 10) * rates)
    shown = styles(names)
    fall = Chart("Angle to the desired attitude over time", Axis("time (s)", 0.0, float(time[-1])),
                 Axis("angle (deg)", 0.0, 180.0))  # fmt: skip
    for name, column in zip(names, angles.T, strict=True):
        fall.line(time, column, shown[name], text=name)
    sweep = np.linspace(0.0, math.pi, 181)
    sizes = np.linalg.norm(_attitude_error(_turned(sweep[:, None] * axis)), axis=-1)
    law = Chart(
        "Size of the attitude error over the angle", Axis("angle (deg)", 0.0, 180.0), Axis("|e_q| (rad)", 0.0, 1.1)
    )
    law.line(np.degrees(sweep), sizes, styles(["geometric"])["geometric"])
    caption = (
        "A rigid body with the quadrotor's inertia and the geometric controller's attitude gains turns back to level "
        "from four tilts about a skew axis. The error is the sine of the angle: it is largest at 90 degrees and "
        "vanishes upside down, where the body therefore lingers."
    )
    return figure(caption, {"angle": fall.svg(), "error": law.svg()}, shown) + cascade_loop()


FIGURES: dict[str, Callable[[], str]] = {
    "rooms": rooms,
    "tde": tde,
    "atde": atde,
    "artde": artde,
    "constant-gain": constant_gain,
    "pid": pid,
    "positional-pid": positional_pid,
    "asmc": asmc,
    "indi": indi,
    "computed-torque": computed,
    "geometric": geometric,
    "swing": swing,
    "switched": switched,
}
"""Name on a page -> the figure as HTML."""


def gains_of(robot: str, law: str, preset: str | None = None) -> Any:
    """Gains of a preset; a law's first one by default."""
    return next(entry.gains for name, entry in law_presets(DRIVES[robot], law).items() if preset in (None, name))


@functools.cache
def arm(law: str, *, preset: str | None = None, period: float = ARM_PERIOD) -> Run:
    """Simulate the arm at the biped's gains."""
    return _run(law, gains_of("ojas", law, preset), ARM, period)


@functools.cache
def lift(law: str, gains: str | None = None, preset: str | None = None, noise: float = 0.0) -> Run:
    """Simulate the vertical axis at the position loop's gains, by default those of the law's own name."""
    return _run(law, gains_of("q450", gains or law, preset).position, LIFT, LIFT_PERIOD, noise)


def over_time(label: str, columns: Mapping[str, Signal], *, log: bool = False, level: float | None = None) -> str:
    """Signals over the run, with load and push marked."""
    values = [values for _, values in columns.values()] + ([] if level is None else [np.array([level])])
    chart = Chart(f"{label} over time: {', '.join(columns)}", Axis("time (s)", 0.0, DURATION),
                  Axis.of(label, *values, log=log, zero=not log))  # fmt: skip
    chart.event(LOADED, LOADED, "load")
    chart.event(*PUSHED, "push")
    for name, look in styles(columns).items():
        chart.line(*columns[name], look, text=name)
    if level is not None:
        chart.level(level, "")
    return chart.svg()


def errors(runs: Mapping[str, Run], *, log: bool = False) -> str:
    """Tracking errors, of an arm in degrees, of a lift in millimeters; their sizes on a logarithmic axis."""
    columns = {}
    for name, run in runs.items():
        e = _scale(run)[0] * run.e[:, 0]
        columns[name] = run.time, np.maximum(np.abs(e), 1e-4) if log else e
    unit = _scale(next(iter(runs.values())))[1]
    return over_time(f"|e| ({unit})" if log else f"e ({unit})", columns, log=log)


def inside(run: Run, name: str) -> Signal:
    """Return a scalar of the law's state, or the magnitude of its one component."""
    return run.time, np.abs(run.inside[name]).reshape(len(run.time))


def _run(law: str, gains: Any, plant: Plant, period: float, noise: float = 0.0) -> Run:
    entry = LAWS[law]
    return simulate(entry.law, entry.convert(gains, period), plant, period, noise=noise)


def _validity() -> str:
    plants = dataclasses.replace(ARM, inertia=(0.042 / RATIOS)[:, None], load=0.0, load_weight=0.0)
    run = simulate(LAWS["tde"].law, gains_of("ojas", "tde"), plants, ARM_PERIOD)
    rms = np.degrees(np.sqrt(np.mean(run.e[..., 0] ** 2, axis=0)))
    chart = Chart(
        "RMS error over m_bar / M", Axis("m_bar / M (1)", 0.0, 2.5), Axis.of("RMS error (deg)", rms, log=True)
    )
    chart.event(2.0, 2.5, "diverges")
    chart.line(RATIOS, rms, styles(["tde"])["tde"])
    return chart.svg()


def _attitude_error(rotation: Array) -> Array:
    """e_q (..., 3) from a rotation (..., 3, 3) to level."""
    columns = [components(rotation[..., :, i]) for i in range(3)]
    level = [components(np.broadcast_to(axis, rotation.shape[:-1])) for axis in np.eye(3)]
    return joined(attitude_error((columns[0], columns[1], columns[2]), (level[0], level[1], level[2])))


def _turned(vector: Array) -> Array:
    """Rotation matrices (..., 3, 3) of rotation vectors (rad)."""
    return Rotation.from_rotvec(vector).as_matrix()


def _scale(run: Run) -> tuple[float, str]:
    return (180.0 / math.pi, "deg") if run.plant.arm else (1e3, "mm")


def _rms(run: Run, part: Any = slice(None)) -> float:
    return _scale(run)[0] * float(np.sqrt(np.mean(run.e[part] ** 2)))


def _values(runs: Mapping[str, Run]) -> str:
    return _listed({name: _rms(run) for name, run in runs.items()}, _scale(next(iter(runs.values())))[1])


def _listed(values: Mapping[str, float], unit: str) -> str:
    return ", ".join(f"{name} {value:.3g} {unit}" for name, value in values.items())


def _arm() -> str:
    return (
        f"An arm at the biped's gains, L = {1e3 * ARM_PERIOD:g} ms. At {LOADED:g} s it is given a load, at "
        f"{PUSHED[0]:g} s a push; the law is told of neither."
    )


def _lift() -> str:
    return (
        f"The quadrotor's vertical axis at the gains of its position loop, L = {1e3 * LIFT_PERIOD:g} ms. At "
        f"{LOADED:g} s it is given a load, at {PUSHED[0]:g} s a push; the law is told of neither."
    )
