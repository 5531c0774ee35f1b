"""One degree of freedom under a law: what the figures of the laws' pages are drawn with.

    (M + M_load) qdd = tau + push - D qd - (G + G_load) f(q),     f(q) = sin q for an arm, 1 for a lift

The load is there from `LOADED` on, the push acts during `PUSHED`; the law is told of neither.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np

from artde_gym.arrays import Array
from controllers.law_table import Nothing
from controllers.laws.computed_torque import ComputedTorqueGains, computed_torque
from controllers.laws.tracking import JointInput, Law
from controllers.policies import flatten

DURATION = 6.0  # s
LOADED = 2.0  # s
PUSHED = (4.0, 4.2)  # s
SUBSTEPS = 10  # a control period
GRAVITY = 9.81  # m/s^2


@dataclasses.dataclass(frozen=True)
class Plant:
    """A joint or an axis, in SI units.

    Attributes:
        inertia: M, a number, or an array (..., 1) for many plants at once.
        load: M_load.
        weight, load_weight: G and G_load.
        damping: D.
        push: force or torque.
        limit: largest force or torque of the actuator.
        stroke: of the reference, which goes to and fro once in `turn` (s).
        arm: whether the weight turns with the joint.
    """

    inertia: float | Array
    load: float
    weight: float
    load_weight: float
    damping: float
    push: float
    limit: float
    stroke: float
    turn: float
    arm: bool


ARM = Plant(0.06, 0.04, 3.0, 2.0, 0.05, 4.0, 40.0, stroke=0.6, turn=2.0, arm=True)
"""A joint of the biped's size."""
LIFT = Plant(1.48, 0.35, 1.48 * GRAVITY, 0.35 * GRAVITY, 0.35, 3.0, 34.0, stroke=0.5, turn=3.0, arm=False)
"""The quadrotor's vertical axis, without the lag of its rotors."""


class Run(NamedTuple):
    """Signals at the samples: time (s) (samples,), the error e and the force (samples, ..., 1), the law's inside."""

    plant: Plant
    time: Array
    e: Array
    tau: Array
    inside: dict[str, Array]


def simulate(law: Law, gains: Any, plant: Plant, period: float, *, duration: float = DURATION, noise: float = 0) -> Run:
    """Drive a plant with a law; `noise` is the standard deviation of the measured velocity."""
    count = round(duration / period)
    time = period * np.arange(count)
    ones = np.ones(np.shape(plant.inertia) or (1,))
    generator = np.random.default_rng(0)
    q, qd = 0.0 * ones, 0.0 * ones
    tau = _weight(plant, q, 0.0)
    errors, forces, inside, memory = [], [], [], None
    for t in time.tolist():
        q_ref, qd_ref, qdd_ref = (value * ones for value in _reference(plant, t))
        seen = qd + noise * generator.standard_normal(qd.shape)
        signals = JointInput(q, seen, q_ref, qd_ref, qdd_ref, tau)
        if memory is None:
            memory = law.start(gains, signals, period)
        tau, memory = law.step(gains, memory, signals, period)
        tau = np.clip(tau, -plant.limit, plant.limit)
        errors.append(signals.q_ref - q)
        forces.append(tau)
        inside.append(flatten(memory))
        for part in range(SUBSTEPS):
            now = t + part * period / SUBSTEPS
            push = plant.push if PUSHED[0] <= now < PUSHED[1] else 0.0
            inertia = plant.inertia + (plant.load if now >= LOADED else 0.0)
            qd = qd + (period / SUBSTEPS) * (tau + push - plant.damping * qd - _weight(plant, q, now)) / inertia
            q = q + (period / SUBSTEPS) * qd
    names = {name: np.array([sample[name] for sample in inside]) for name in inside[0]}
    return Run(plant, time, np.array(errors), np.array(forces), names)


def modelled(plant: Plant) -> Law:
    """Computed torque with the plant's own equation, but for the load, which it does not know."""

    def start(_gains: Any, _signals: JointInput, _period: float) -> Nothing:
        return Nothing()

    def step(gains: ComputedTorqueGains, memory: Any, signals: JointInput, _period: float) -> tuple[Array, Any]:
        def inverse_dynamics(q: Array, qd: Array, qdd: Array) -> Array:
            return plant.inertia * qdd + plant.damping * qd + _weight(plant, q, 0.0)

        return computed_torque(gains, signals, inverse_dynamics), memory

    return Law(start, step)


def _reference(plant: Plant, time: float) -> tuple[float, float, float]:
    """stroke / 4 (1 - cos w t)^2, its velocity and its acceleration, which is zero at the start."""
    rate = 2 * math.pi / plant.turn
    sin, cos = math.sin(rate * time), math.cos(rate * time)
    half = 0.5 * plant.stroke
    return 0.5 * half * (1 - cos) ** 2, half * rate * sin * (1 - cos), half * rate**2 * (cos + sin**2 - cos**2)


def _weight(plant: Plant, q: Array, time: float) -> Array:
    weight = plant.weight + (plant.load_weight if time >= LOADED else 0.0)
    return weight * (np.sin(q) if plant.arm else np.ones_like(q))
