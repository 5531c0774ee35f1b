"""The built-in arm: the Panda of Franka Emika, seven joints, drawn with boxes.

Sources: masses, centers of mass, inertias and dry friction identified by C. Gaz, M. Cognetti, A. Oliva, P. Robuffo
Giordano, A. De Luca, *Dynamic Identification of the Franka Emika Panda Robot With Retrieval of Feasible Parameters
Using Penalty-Based Optimization*, IEEE RA-L 4 (2019) 4147-4154, and its supplementary material; kinematics and limits
of position, velocity and torque: Franka Control Interface, robot and interface specifications. Reflected rotor inertia:
the values that the manufacturer gives for its successor, the Research 3, as quoted with the model of the arm in Drake
(`drake_models`, `franka_description`). Friction phi_1 / (1 + exp(-phi_2 qd)) - phi_1 / 2 is
phi_1 / 2 tanh(phi_2 qd / 2); its offset phi_3 is left out.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

from artde_gym.multibody.manipulator import GEAR_RATIO, TOOL
from artde_gym.multibody.spec import Link, RobotSpec, Rotation, Vector
from artde_gym.robots.arm.drawing import drawn

HOME = (0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.785)  # rad
FLANGE: Vector = (0.0, 0.0, 0.107)  # m, from the frame of the last link
NAMES = tuple(f"joint{i}" for i in range(1, 8))

_LEFT: Rotation = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))  # by -90 degrees about x
_RIGHT: Rotation = ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))


class _Row(NamedTuple):
    """A link: place and rotation of its joint, mass (kg), center of mass (m), tensor (kg m^2), limits and friction."""

    origin: Vector
    rotation: Rotation | None
    mass: float
    com: Vector
    moments: Vector
    products: Vector
    limits: tuple[float, float]
    effort: float
    speed: float
    friction: tuple[float, float]
    armature: float


_ROWS = (
    _Row((0.0, 0.0, 0.333), None, 4.970684, (3.875e-3, 2.081e-3, 0.0), (0.70337, 0.70661, 9.117e-3),
         (-1.39e-4, 6.772e-3, 1.9169e-2), (-2.8973, 2.8973), 87.0, 2.175, (0.54615, 5.1181), 0.605721456),
    _Row((0.0, 0.0, 0.0), _LEFT, 0.646926, (-3.141e-3, -2.872e-2, 3.495e-3), (7.962e-3, 2.811e-2, 2.5995e-2),
         (-3.925e-3, 1.0254e-2, 7.04e-4), (-1.7628, 1.7628), 87.0, 2.175, (0.87224, 9.0657), 0.605721456),
    _Row((0.0, -0.316, 0.0), _RIGHT, 3.228604, (2.7518e-2, 3.9252e-2, -6.6502e-2), (3.7242e-2, 3.6155e-2, 1.083e-2),
         (-4.761e-3, -1.1396e-2, -1.2805e-2), (-2.8973, 2.8973), 87.0, 2.175, (0.64068, 10.136), 0.462474144),
    _Row((0.0825, 0.0, 0.0), _RIGHT, 3.587895, (-5.317e-2, 0.104419, 2.7454e-2), (2.5853e-2, 1.9552e-2, 2.8323e-2),
         (7.796e-3, -1.332e-3, 8.641e-3), (-3.0718, -0.0698), 87.0, 2.175, (1.2794, 5.5903), 0.462474144),
    _Row((-0.0825, 0.384, 0.0), _LEFT, 1.225946, (-1.1953e-2, 4.1065e-2, -3.8437e-2), (3.5549e-2, 2.9474e-2, 8.627e-3),
         (-2.117e-3, -4.037e-3, 2.29e-4), (-2.8973, 2.8973), 12.0, 2.61, (0.83904, 8.3469), 0.205544064),
    _Row((0.0, 0.0, 0.0), _RIGHT, 1.666555, (6.0149e-2, -1.4117e-2, -1.0517e-2), (1.964e-3, 4.354e-3, 5.433e-3),
         (1.09e-4, -1.158e-3, 3.41e-4), (-0.0175, 3.7525), 12.0, 2.61, (0.30301, 17.133), 0.205544064),
    _Row((0.088, 0.0, 0.0), _RIGHT, 0.735522, (1.0517e-2, -4.252e-3, 6.1597e-2), (1.2516e-2, 1.0027e-2, 4.815e-3),
         (-4.28e-4, -1.196e-3, -7.41e-4), (-2.8973, 2.8973), 12.0, 2.61, (0.56489, 10.336), 0.205544064),
)  # fmt: skip


@functools.cache
def panda() -> RobotSpec:
    """Return the arm without a hand; its tool is the flange."""
    base = Link("base", 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    links = [base, *(_link(number, row) for number, row in enumerate(_ROWS))]
    sites = tuple((f"link{number}", name, (0.0, 0.0, 0.0)) for number, name in enumerate(NAMES, 1))
    spec = RobotSpec(
        name="arm",
        links=tuple(links),
        actuated=NAMES,
        torque_limit=max(row.effort for row in _ROWS),
        armature=tuple(row.armature for row in _ROWS),
        gear_ratio=GEAR_RATIO,
        sites=((TOOL, NAMES[-1], FLANGE), *sites),
        fixed=True,
        carrier=NAMES[-1],
    )
    return drawn(spec)


def _link(number: int, row: _Row) -> Link:
    level, rate = row.friction
    return Link(
        NAMES[number],
        row.mass,
        row.com,
        row.moments,
        NAMES[number - 1] if number else "base",
        row.origin,
        axis=(0.0, 0.0, 1.0),
        limits=row.limits,
        products=row.products,
        rotation=row.rotation,
        effort=row.effort,
        speed=row.speed,
        coulomb=level / 2,
        slip=2 / rate,
    )
