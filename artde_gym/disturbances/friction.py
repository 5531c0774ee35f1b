"""Friction of joints: viscous, Coulomb and Stribeck, as a smooth torque that both engines get alike.

    F(qd) = viscous qd + (coulomb + stribeck exp(-(qd / v_s)^2)) tanh(qd / slip)

Source: B. Armstrong-Helouvry, P. Dupont and others, "A survey of models, analysis tools and compensation methods for
the control of machines with friction", Automatica 30 (1994) 1083-1138, the Stribeck curve with exponent 2.
tanh takes the place of the sign: a joint at rest creeps instead of sticking.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances.loads import Load, RobotStates
from artde_gym.errors import DisturbanceError

KIND = "joint_friction"
TERMS = ("viscous", "coulomb", "stribeck")
"""Parameters that are torques by their size; without any there is nothing to add."""


def friction(values: Mapping[str, Array], states: RobotStates) -> Load:
    """Return the torques of friction on all joints."""
    viscous, coulomb, stribeck, velocity, slip = (
        values[name][:, None] for name in (*TERMS, "stribeck_velocity", "slip")
    )
    dry = coulomb + stribeck * np.exp(-np.square(states.qd / velocity))
    return Load(tau=-(viscous * states.qd + dry * np.tanh(states.qd / slip)))


def check_friction(entries: Iterable[tuple[str, Mapping[str, Any]]], inertia: float, time_step: float) -> None:
    """Raise DisturbanceError for friction whose slope at rest an explicit time step cannot resolve.

    Args:
        entries: of `artde_gym.disturbances.Disturbances`.
        inertia: the smallest that a joint meets (kg m^2).
        time_step: of the physics (s).
    """
    for kind, entry in entries:
        if kind != KIND:
            continue
        viscous, coulomb, stribeck = (_largest(entry[name]) for name in TERMS)
        slope, most = viscous + (coulomb + stribeck) / _smallest(entry["slip"]), inertia / time_step
        if slope > most:
            allowed = f"viscous + (coulomb + stribeck) / slip at most {most:.3g}, the smallest inertia over a time step"
            raise DisturbanceError(f"{KIND}.coulomb", dict(entry), allowed)


def _largest(value: Any) -> float:
    return max(_ends(value))


def _smallest(value: Any) -> float:
    return min(_ends(value))


def _ends(value: Any) -> list[float]:
    """Return numbers that bound a number or, for a normal distribution up to four deviations, a distribution."""
    if not isinstance(value, Mapping):
        return [float(value)]
    ((kind, numbers),) = value.items()
    if kind == "normal":
        mean, deviation = numbers
        return [max(mean - 4 * deviation, 1e-9), mean + 4 * deviation]
    return [float(number) for number in numbers]
