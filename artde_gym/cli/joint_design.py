"""Print and draw the range of m_bar of each joint, for `artde-gym design`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from artde_gym.arguments import check_number
from artde_gym.cli.arguments import WALK
from artde_gym.cli.display import terminal
from artde_gym.cli.workspace_design import show_workspace
from artde_gym.errors import OptionError, UnknownNameError, suggest_names
from artde_gym.evaluation.environments import robot_of
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.files import check_figure, write_atomically
from artde_gym.kit import ROBOTS, find_robot
from artde_gym.palette import STYLES
from artde_gym.report.chart import Axis, Chart
from controllers.design import Design, delayed, designed
from controllers.design import design as work_out
from controllers.drive import DRIVES
from controllers.motion import check_motion
from controllers.support_design import SupportDesign, derived_gains, design_supports, switched

NAMES = [robot for robot in designed() if robot in ROBOTS]
"""Robots whose m_bar can be judged."""


def show_design(
    robot: str | None,
    env: str | None,
    given: dict[str, Any],
    law: str,
    preset: str | None,
    gains: dict[str, Any],
    *,
    period: float | None,
    cap: float | None,
    figure: Path | None,
    as_json: bool,
) -> None:
    """Print the design for a robot, or for an environment's; see `artde_gym.cli.design.design` for the arguments.

    Raises:
        OptionError: for an option that is not allowed, or that would do nothing.
        UnknownNameError: for a law without a time-delay estimate.
    """
    name = _robot(robot, env)
    if law not in (able := [*delayed(), *switched()]):
        raise UnknownNameError("law with a time-delay estimate", law, suggest_names(law, able))
    switches = law in switched()
    _refuse_idle(switches, period, cap, figure)
    if period is not None:
        check_number("period", period, 1e-6, 10.0, "1e-6 to 10 s")
    if figure is not None:
        check_figure("figure", figure)
    if env is not None and DRIVES[name].workspace is not None:
        if preset is not None:
            raise OptionError("preset", preset, "leave it out", "does not go with an arm, whose gains are derived")
        show_workspace(env, given, law, gains, period, figure, as_json)
        return
    check_motion(name, _motion(name, switches), given)
    if switches:
        limit = {} if cap is None else {"cap": cap}
        _show_supports(name, law, design_supports(name, law, preset, **limit, gains=gains, **given), as_json)
        return
    found = work_out(name, law, preset, period, gains=gains, **given)
    if figure is not None:
        for one in found:
            drawing = draw(one).encode()
            write_atomically(_file(figure, one, len(found) > 1), lambda file, drawing=drawing: file.write(drawing))
    if as_json:
        print(json.dumps({"robot": name, "law": law, "loops": [one.to_dict() for one in found]}, indent=2))
        return
    for one in found:
        _print(f"{name} under {law}", one, terminal())


def _robot(robot: str | None, env: str | None) -> str:
    """Return the name of the robot that is given as such or by an environment.

    Raises:
        OptionError: for an unknown one, or both.
    """
    if robot is not None and env is not None:
        raise OptionError("robot", robot, "none with an environment")
    if robot is not None:
        return find_robot(robot, NAMES).name
    env = WALK if env is None else env
    if (name := robot_of(env)) not in NAMES:
        raise OptionError("env", env, f"an environment of {' or '.join(NAMES)}")
    return name


def _motion(name: str, switches: bool) -> Callable[..., Any]:
    """Return the function that has the arguments of a robot's motion.

    Raises:
        OptionError: if the law switches and the robot has no phases of support.
    """
    drive = DRIVES[name]
    if switches and drive.supports is None:
        walkers = [one for one in NAMES if DRIVES[one].supports is not None]
        raise OptionError("robot of a law that switches", name, ", ".join(map(repr, walkers)))
    function = drive.supports if switches else drive.loops
    assert function is not None
    return function


def _refuse_idle(switches: bool, period: float | None, cap: float | None, figure: Path | None) -> None:
    """Raise OptionError for an option that would do nothing with such a law."""
    for name, value in (("figure", None if figure is None else str(figure)), ("period", period)):
        if switches and value is not None:
            raise OptionError(name, value, f"a law with one m_bar: {', '.join(delayed())}")
    if not switches and cap is not None:
        raise OptionError("cap", cap, f"a law that switches: {', '.join(switched())}")


def draw(one: Design) -> str:
    """Draw the largest valid and the chosen m_bar along the reference, as SVG."""
    unit, time = one.loop.unit, one.loop.time
    still = len(time) == 1
    x = Axis("time (s)", 0.0, 1.0 if still else float(time[-1]))
    y = Axis.of(f"m_bar ({unit})", one.limit, one.m_bar, zero=True)
    chart = Chart(f"Largest valid m_bar of the {one.loop.name} along the reference", x, y, 480, 280)
    chart.line([0.0, 1.0] if still else time, np.repeat(one.limit, 2) if still else one.limit, STYLES["tde"])
    chosen = sorted(set(one.m_bar.tolist()))
    single = len(chosen) == 1
    chart.level(one.largest, f"valid below {one.largest:.4g}" if single else "", STYLES["tde"])
    for value in chosen:
        chart.level(value, f"chosen {value:.4g}" if single else "", STYLES["artde"])
    if not single:  # labels of many lines would hide each other
        limit = f"limit of one for all joints, {one.largest:.4g}"
        chart.legend({limit: STYLES["tde"], f"chosen, {chosen[0]:.4g} to {chosen[-1]:.4g}": STYLES["artde"]})
    return chart.file()


def _file(path: Path, one: Design, several: bool) -> Path:
    return path.with_stem(f"{path.stem}-{one.loop.name}") if several else path


def _print(judged: str, one: Design, console: Console) -> None:
    loop = one.loop
    newton = "N" if loop.unit == "kg" else "Nm"
    length = "m" if loop.unit == "kg" else "rad"
    table = FittingTable("joint")
    table.title = (
        f"{judged}: {loop.name}, L = {1e3 * one.period:g} ms ({loop.unit}, {newton}/{length}, {newton} s/{length})"
    )
    for title in ("m_bar", "valid below", "K_d m_bar/L", "m_bar/L"):
        table.add_column(title, justify="right")
    for joint in one.to_dict()["joints"]:
        numbers = (joint["m_bar"], joint["largest_m_bar"], joint["stiffness"], joint["damping"])
        table.add_row(joint["name"], *("" if number is None else f"{number:.4g}" for number in numbers))
    console.print(table)
    console.print(
        f"Valid below: limit of a joint with the others as chosen. One m_bar for all: {one.largest:.4g} {loop.unit}."
    )
    low, high = one.eigenvalues.min(), one.eigenvalues.max()
    edge = f"{100 * one.used:.0f} % of the limit 2, margin of a factor {one.room:.3g}"
    verdict = edge if one.valid else "OUTSIDE (0, 2): time-delay estimation diverges"
    console.print(f"Eigenvalues of M^-1 m_bar: {low:.3g} to {high:.3g}, {verdict}.")


def _show_supports(robot: str, law: str, found: list[SupportDesign], as_json: bool) -> None:
    if as_json:
        phases = [one.to_dict() for one in found]
        print(json.dumps({"robot": robot, "law": law, "phases": phases, "gains": derived_gains(found)}, indent=2))
        return
    table = FittingTable("support")
    for title in ("time", "blocked", "m_bar below", "eigenvalues of A m_bar", "in any phase", "of the derived m_bar"):
        table.add_column(title, justify="right")
    for one in found:
        low, high = one.felt
        derived = "" if one.derived is None else _range(one.derived)
        table.add_row(one.phase.name, f"{100 * one.phase.share:.1f} %", f"{one.blocked} of {len(one.phase.joints)}",
                      f"{one.limit:.4g}", f"{low:.3g} to {high:.3g}", f"{one.largest:.3g}", derived)  # fmt: skip
    console = terminal()
    console.print(table)
    verdict = "valid in every phase" if all(one.valid for one in found) else "OUTSIDE: time-delay estimation diverges"
    console.print(f"Chosen nominal inertias, eigenvalues below 2: {verdict}. --json prints what is derived.")


def _range(matrix: np.ndarray) -> str:
    values = np.linalg.eigvalsh(matrix)
    return f"{values[0]:.3g} to {values[-1]:.3g}"
