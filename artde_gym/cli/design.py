"""`artde-gym design`: valid range of m_bar and the resulting joint stiffness."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from artde_gym.cli.arguments import WALK, joined, json_object


def design(
    robot: Annotated[str | None, typer.Option(help=f"Name of the robot. Default: that of {WALK}.")] = None,
    env: Annotated[str | None, typer.Option(help="Environment id, in place of the robot.")] = None,
    env_kwargs: Annotated[
        str | None,
        typer.Option(
            help="JSON; arguments of an arm's environment, of whose disturbances encoder_bits alone has a part; of any "
            "other robot those of its motion."
        ),
    ] = None,
    law: Annotated[str, typer.Option(help="Law with a time-delay estimate; see `list controllers`.")] = "tde",
    preset: Annotated[str | None, typer.Option(help="Preset of the law's gains; see `list controllers`.")] = None,
    gains: Annotated[str | None, typer.Option(help='JSON; override gains of the preset, e.g. {"m_bar": 0.08}.')] = None,
    period: Annotated[float | None, typer.Option(help="Control period L (s). Default: the robot's.")] = None,
    actuator_inertia: Annotated[
        str | None, typer.Option(help="Biped only: rotor, lumped or none. Default: rotor.")
    ] = None,
    speed: Annotated[float | None, typer.Option(help="Biped only: walking speed (m/s). Default: 0.1.")] = None,
    step_duration: Annotated[float | None, typer.Option(help="Biped only: duration of a step (s). Default: 1.")] = None,
    motion: Annotated[str | None, typer.Option(help="JSON; arguments of another robot's motion.")] = None,
    cap: Annotated[
        float | None,
        typer.Option(help="Laws that switch: bound of the derived inertias' eigenvalues (kg m^2). Default: 0.09."),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            help="SVG file for the limit along the reference, one per loop; of an arm for the eigenvalues over its "
            "workspace."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print the valid range of m_bar and the joint stiffness.

    The stiffness is K_d m_bar / L; the margin to the limit stands beside it.

    Of a law that switches with the support phase, print the range of each phase; --json holds, as "gains", the nominal
    inertias that follow from the robot's spec and gait.
    """
    from artde_gym.cli.joint_design import show_design  # with all laws behind it: only when the command runs

    walk = {"actuator_inertia": actuator_inertia, "speed": speed, "step_duration": step_duration}
    given = joined("--motion", json_object("--motion", motion), {k: v for k, v in walk.items() if v is not None})
    given = joined("--env-kwargs", json_object("--env-kwargs", env_kwargs), given)
    chosen = json_object("gains", gains)
    show_design(robot, env, given, law, preset, chosen, period=period, cap=cap, figure=figure, as_json=as_json)
