"""Print and draw the design of an arm over its workspace."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from rich.console import Console
from rich.markup import escape

from artde_gym.cli.display import terminal
from artde_gym.errors import OptionError
from artde_gym.evaluation.fitting_table import FittingTable
from artde_gym.files import write_atomically
from artde_gym.palette import STYLES
from artde_gym.report.chart import Axis, Chart
from controllers.design import delayed
from controllers.drive import DRIVES
from controllers.workspace_design import WorkspaceDesign


def show_workspace(
    env_id: str, env_kwargs: dict[str, Any], law: str, gains: dict[str, Any], period: float | None, figure: Path | None,
    as_json: bool,
) -> None:  # fmt: skip
    """Print the design for an environment's arm; see `artde_gym.cli.design.design` for the arguments.

    Raises:
        OptionError: for a law without a time-delay estimate.
    """
    if law not in delayed():
        raise OptionError("law", law, ", ".join(delayed()))
    found, left_out = _designed(env_id, env_kwargs, gains, period)
    if figure is not None:
        drawing = draw(found).encode()
        write_atomically(figure, lambda file: file.write(drawing))
    if as_json:
        told = {"robot": found.spec.name, "law": law, "env": env_id, "left_out": left_out, **found.to_dict()}
        print(json.dumps(told, indent=2))
        return
    console = terminal()
    _print(found, console)
    if left_out:
        words = f"Left out, since a design is that of the nominal model: {', '.join(left_out)}."
        console.print(words, markup=False, highlight=False)


def _designed(
    env_id: str, env_kwargs: dict[str, Any], gains: dict[str, Any], period: float | None
) -> tuple[WorkspaceDesign, list[str]]:
    """Return the design for the arm of an environment, and the kinds of its disturbances that have no part in it."""
    env: Any = gym.make(env_id, disable_env_checker=True, **env_kwargs).unwrapped
    try:
        env.reset(seed=0)
        sampled = dict(env.sampled_disturbances)
        bits = sampled.pop("encoder_bits", {}).get("bits")
        workspace = DRIVES[env.robot_name].workspace
        if workspace is None:
            raise OptionError("env", env_id, "an environment of an arm")
        found = workspace(env.nominal_robot, env.control_period if period is None else period, gains, bits)
        return found, list(sampled)
    finally:
        env.close()


def draw(found: WorkspaceDesign) -> str:
    """Draw each eigenvalue of M^-1 m_bar over the poses, sorted, with one m_bar for all joints to compare; as SVG."""
    share = np.linspace(0.0, 100.0, len(found.eigenvalues))
    x = Axis("share of the poses (%)", 0.0, 100.0)
    y = Axis.of("eigenvalues of M⁻¹ m̄", found.eigenvalues, found.scalar_eigenvalues, [2.0], log=True)
    chart = Chart("Eigenvalues over the workspace", x, y, 480, 320)
    for values, look in ((found.scalar_eigenvalues, STYLES["pid"]), (found.eigenvalues, STYLES["artde"])):
        for column in np.sort(values, axis=0).T:
            chart.line(share, column, look)
    chart.level(2.0, "edge 2", STYLES["tde+kd"])
    chart.legend({"one m̄ a joint": STYLES["artde"], f"one for all, {found.scalar:.3g}": STYLES["pid"]})
    return chart.file()


def _print(found: WorkspaceDesign, console: Console) -> None:
    told = found.to_dict()
    model = _table("As read from the model (rad or m, Nm or N)", "from", "to", "speed", "effort", "damping",
                   "dry friction", "rotor inertia")  # fmt: skip
    design = _table(f"Design, L = {1e3 * found.period:g} ms", "m_bar", "K_d m_bar/L", "weight", "reversal", "chatter")
    for joint in told["joints"]:
        read = (*joint["limits"], *(joint[key] for key in ("speed", "effort", "damping", "dry_friction", "armature")))
        model.add_row(escape(joint["name"]), *("none" if value is None else f"{value:.4g}" for value in read))
        unit, scale = ("mm", 1e3) if joint["prismatic"] else ("deg", 180 / np.pi)
        chatter = "unstable" if joint["chatter"] is None else f"{100 * joint['chatter']:.2g} %"
        design.add_row(
            escape(joint["name"]),
            f"{joint['m_bar']:.4g}",
            f"{joint['stiffness']:.4g}",
            f"{100 * joint['weight']:.0f} %",
            f"{scale * joint['friction_error']:.2g} {unit}",
            "" if found.bits is None else chatter,
        )
    console.print(model)
    console.print(design)
    for line in (*_summary(found), *told["advice"]):
        console.print(line, markup=False, highlight=False)


def _table(title: str, *columns: str) -> FittingTable:
    table = FittingTable("joint", title=title)
    for column in columns:
        table.add_column(column, justify="right")
    return table


def _summary(found: WorkspaceDesign) -> list[str]:
    low, high = found.eigenvalues.min(), found.eigenvalues.max()
    first, last = found.scalar_eigenvalues.min(), found.scalar_eigenvalues.max()
    gains, room = found.gains, min(found.factors)
    verdict = f"margin of a factor {found.margin:.3g} to the edge 2" if high < 2 else "OUTSIDE (0, 2)"
    stable = f"{100 / room:.0f} % of what is stable" if room > 0 else "UNSTABLE"
    return [
        "Weight: largest share of the effort. Reversal: largest error when dry friction reverses. Chatter: of torques "
        "behind encoders, rms, as a share of the effort.",
        f"Eigenvalues of M^-1 m_bar over {len(found.eigenvalues)} poses: {low:.3g} to {high:.3g}, {verdict}.",
        f"One m_bar for all joints: {found.scalar:.4g}, eigenvalues {first:.2g} to {last:.3g}.",
        f"Bandwidth {found.omega:.4g} rad/s (k_p {gains.k_p:.4g}, k_d {gains.k_d:.4g}), {stable}.",
    ]
