"""All laws with inputs and gains, and what must hold for them under an array library other than NumPy."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from controllers.drive import DRIVES
from controllers.law_table import LAWS
from controllers.laws.array_gains import with_arrays
from controllers.laws.artde import ArtdeGains
from controllers.laws.asmc import AsmcGains
from controllers.laws.atde import AtdeGains
from controllers.laws.cascade import CascadeGains, QuadrotorInput, cascade, cascade_init
from controllers.laws.computed_torque import ComputedTorqueGains, computed_torque
from controllers.laws.indi import IndiGains
from controllers.laws.load import LoadGains, load_control, load_start
from controllers.laws.pid import PidGains
from controllers.laws.positional_pid import PositionalPidGains
from controllers.laws.rigid_attitude import RigidAttitudeGains
from controllers.laws.swing import Cable, swing_term
from controllers.laws.tde import ConstantGains, TdeGains
from controllers.laws.tracking import JointInput
from controllers.laws.velocity_estimate import estimate, estimate_init

PERIOD = 0.004
SAMPLES = 5
FEEDBACK: dict[str, Any] = {"m_bar": 0.042, "k_p": 25.0, "k_d": 10.0}
JOINTWISE: dict[str, Any] = {"m_bar": (0.03, 0.04, 0.06), "k_p": (25.0, 16.0, 36.0), "k_d": (10.0, 8.0, 12.0)}
MATRIX = ((0.05, 0.01, 0.0), (0.01, 0.04, 0.02), (0.0, 0.02, 0.06))
ROBUST: dict[str, Any] = {"alpha": 4.0, "eps": 5e-3}
BETA: dict[str, Any] = {"gamma_0": 50.0, "gamma_1": 50.0, "beta_floor": 0.01, "beta_start": 0.1}
MENDED: dict[str, Any] = {"growth": "midpoint", "clamp": True, "leakage": 0.1, "cap": 1.0}
ASMC: dict[str, Any] = {
    "slope": 2.0, "k_s": 3.0, "c_floor": 0.5, "gamma_c": 2.0, "leakage_c": 0.1, "eps": 0.01, "gamma_r": 0.3,
    "leakage_r": 0.05, "r_max": 2.0, "gravity": 9.81,
}  # fmt: skip
FILTER: dict[str, Any] = {"filter_rate": 50.0, "filter_damping": 0.55}


class LawCase(NamedTuple):
    """A law by (gains, inputs) -> state and (gains, state, inputs) -> force, state, with its gains and inputs.

    `varied` names gains by which it is differentiated, those of a loop as "position.k_p".
    """

    gains: Any
    varied: tuple[str, ...]
    start: Callable[[Any, Any], Any]
    step: Callable[[Any, Any, Any], tuple[Any, Any]]
    inputs: list[Any]


def mapped(function: Callable[[Any], Any], tree: Any) -> Any:
    """Apply a function to all arrays in nested tuples."""
    if isinstance(tree, tuple):
        made: Any = [mapped(function, part) for part in tree]
        return type(tree)(*made) if hasattr(tree, "_fields") else tuple(made)
    return tree if tree is None else function(tree)


def leaves(tree: Any) -> list[Any]:
    return [leaf for part in tree for leaf in leaves(part)] if isinstance(tree, tuple) else [tree]


def joint_inputs(*batch: int, joints: int) -> list[JointInput]:
    rng = np.random.default_rng(7)
    return [JointInput(*rng.normal(size=(6, *batch, joints))) for _ in range(SAMPLES)]


def flights(*batch: int) -> list[tuple[QuadrotorInput, Cable]]:
    rng = np.random.default_rng(12)

    def one() -> tuple[QuadrotorInput, Cable]:
        parts = {name: rng.normal(scale=0.1, size=(*batch, 3)) for name in QuadrotorInput._fields}
        parts |= {name: rng.normal(scale=0.3, size=batch) for name in ("yaw_ref", "yaw_rate_ref")}
        parts["thrust_applied"] = 15.0 + rng.normal(size=batch)
        turn = Rotation.from_rotvec(rng.normal(scale=0.2, size=(*batch, 3)))
        columns = np.moveaxis(turn.as_matrix(), (-1, -2), (0, 1))
        axes = tuple(tuple(np.asarray(part) for part in axis) for axis in columns)
        cable = rng.normal(scale=0.1, size=(*batch, 3)) - (0.0, 0.0, 0.6)
        held = np.asarray(rng.random(batch) > 0.3)
        return QuadrotorInput(**{**parts, "axes": axes}), Cable(cable, rng.normal(size=(*batch, 3)), held)

    return [one() for _ in range(SAMPLES)]


def of_joints(name: str, gains: Any, *varied: str, joints: int = 4) -> LawCase:
    law = LAWS[name].law
    return LawCase(
        gains,
        varied,
        lambda own, given: law.start(own, given, PERIOD),
        lambda own, state, given: law.step(own, state, given, PERIOD),
        joint_inputs(2, joints=joints),
    )


def of_phases(name: str, *varied: str) -> LawCase:
    law = LAWS[name].law
    contacts = ((1.0, 1.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, 1.0))
    gains = dataclasses.replace(DRIVES["ojas"].presets[name, "support"].gains, dwell=0.0, blend=3 * PERIOD)
    inputs = [
        (signals, np.array([contact, contacts[0]]))
        for signals, contact in zip(joint_inputs(2, joints=12), contacts, strict=True)
    ]
    return LawCase(
        gains,
        varied,
        lambda own, given: law.start(own, given[0], PERIOD),
        lambda own, state, given: law.step(own, state, given[0], PERIOD, given[1]),
        inputs,
    )


def of_flight(name: str, attitude: str, own: Any, turning: Any, *varied: str, **options: Any) -> LawCase:
    laws = LAWS[name].law, LAWS[attitude].law
    limits: dict[str, Any] = {"command_rate": 20.0, "tilt_max_deg": 40.0, "lift_min": 2.0, "lift_max": 30.0}
    return LawCase(
        CascadeGains(own, turning, **{**limits, **options}),
        varied,
        lambda gains, given: cascade_init(*laws, gains, given[0], PERIOD),
        lambda gains, state, given: cascade(*laws, gains, state, given[0], PERIOD),
        flights(2),
    )


def _model(q: Any, qd: Any, qdd: Any) -> Any:
    return 0.04 * qdd + 0.1 * qd + 2.0 * q


def _swing(gains: TdeGains, _state: Any, given: Any) -> Any:
    flight, cable = given
    return swing_term(gains.k_p, gains.k_d, cable, flight.acceleration_ref, flight.jerk_ref), ()


def _of_load(flight: QuadrotorInput) -> JointInput:
    return JointInput(*(getattr(flight, name) for name in ("position", "velocity", "position_ref", "velocity_ref",
                                                           "acceleration_ref", "torque_applied")))  # fmt: skip


HEAVY: dict[str, Any] = {"m_bar": 1.6, "k_p": 9.0, "k_d": 4.0}
LOAD = LoadGains(**HEAVY, k_i=1.0, integral_limit=3.0, load_mass=0.3, vehicle_mass=1.5, load_k_p=3.0, load_k_d=4.0,
                 load_k_i=0.5)  # fmt: skip
ARTDE_HEAVY = ArtdeGains(**HEAVY, **ROBUST, **BETA)
CASES: dict[str, LawCase] = {
    "tde": of_joints("tde", TdeGains(**FEEDBACK), "m_bar", "k_p", "k_d"),
    "tde-jointwise": of_joints("tde", TdeGains(**JOINTWISE), "m_bar", "k_p", "k_d", joints=3),
    "tde-matrix": of_joints("tde", TdeGains(**{**JOINTWISE, "m_bar": MATRIX}), "k_p", "k_d", joints=3),
    "tde+c": of_joints("tde+c", ConstantGains(**FEEDBACK, **ROBUST, c=0.3), "k_p", "alpha", "c", "eps"),
    "atde": of_joints(
        "atde", AtdeGains(**FEEDBACK, **ROBUST, gamma_0=50.0, c_floor=0.1, c_start=0.2), "k_d", "gamma_0", "c_start"
    ),
    "artde": of_joints("artde", ArtdeGains(**FEEDBACK, **ROBUST, **BETA), "m_bar", "k_p", "k_d", *BETA, *ROBUST),
    "artde-robust": of_joints(
        "artde", ArtdeGains(**JOINTWISE, **ROBUST, **BETA, **MENDED), "k_p", "gamma_1", "beta_start", joints=3
    ),
    "artde-mixed": of_joints(
        "artde", ArtdeGains(**{**JOINTWISE, "k_p": 25.0}, **ROBUST, **BETA), "k_p", "k_d", joints=3
    ),
    "pid": of_joints("pid", PidGains(90.0, (200.0, 210.0, 220.0), 9.0), "proportional", "integral", joints=3),
    "positional-pid": of_joints(
        "positional-pid", PositionalPidGains(**JOINTWISE, k_i=3.0, integral_limit=20.0), "m_bar", "k_i", joints=3
    ),
    "indi": of_joints("indi", IndiGains(**FEEDBACK, **FILTER), "m_bar", "k_p", "k_d"),
    "asmc": of_joints("asmc", AsmcGains(1.2, **ASMC), "m_bar", "slope", "k_s", "gamma_c", "gamma_r", joints=3),
    "asmc-jointwise": of_joints(
        "asmc", AsmcGains(JOINTWISE["m_bar"], **{**ASMC, "gravity": 0.0}), "m_bar", "slope", joints=3
    ),
    "rigid-attitude": of_joints(
        "rigid-attitude", RigidAttitudeGains(25.0, (9.0, 8.0, 7.0), (0.03, 0.04, 0.06)), "k_p", "inertia", joints=3
    ),
    "computed-torque": LawCase(
        ComputedTorqueGains(25.0, 10.0),
        ("k_p", "k_d"),
        lambda gains, given: (),
        lambda gains, state, given: (computed_torque(gains, given, _model), state),
        joint_inputs(2, joints=4),
    ),
    "velocity-estimate": LawCase(
        TdeGains(**FEEDBACK),
        (),
        lambda gains, given: estimate_init(given, PERIOD),
        lambda gains, state, given: estimate(40.0, state, given, PERIOD),
        joint_inputs(2, joints=4),
    ),
    "tde-switched": of_phases("tde-switched", "k_p", "k_d"),
    "atde-switched": of_phases("atde-switched", "k_p", "gamma_0"),
    "artde-switched": of_phases("artde-switched", "k_p", "gamma_0", "gamma_1"),
    "cascade-tde": of_flight(
        "tde", "tde", TdeGains(**HEAVY), TdeGains(**JOINTWISE), "position.k_p", "attitude.k_d", "position.m_bar"
    ),
    "cascade-reference": of_flight(
        "tde",
        "rigid-attitude",
        TdeGains(**HEAVY),
        RigidAttitudeGains(60.0, 12.0, (0.03, 0.04, 0.06)),
        "position.k_d",
        "attitude.k_p",
        command="reference",
        attitude_error="printed",
        remembered_force="commanded",
    ),
    "cascade-artde": of_flight(
        "artde",
        "artde",
        ARTDE_HEAVY,
        ArtdeGains(**FEEDBACK, **ROBUST, **BETA),
        "position.k_p",
        "position.gamma_1",
        "attitude.k_p",
    ),
    "cascade-asmc": of_flight(
        "asmc",
        "indi",
        AsmcGains(1.2, **ASMC),
        IndiGains(**FEEDBACK, **FILTER),
        "position.slope",
        "position.gamma_r",
        "attitude.k_p",
    ),
    "swing": LawCase(TdeGains(**HEAVY), ("k_p", "k_d"), lambda gains, given: (), _swing, flights(2)),
    "swing-axiswise": LawCase(
        TdeGains(**{**JOINTWISE, "k_p": (9.0, 8.0, 7.0)}), ("k_p", "k_d"), lambda gains, given: (), _swing, flights(2)
    ),
    "load": LawCase(
        LOAD,
        ("load_k_p", "load_k_d", "load_mass", "vehicle_mass", "k_p"),
        lambda gains, given: load_start(gains, _of_load(given[0])),
        lambda gains, state, given: load_control(gains, state, _of_load(given[0]), given[1], PERIOD),
        flights(2),
    ),
}
DIFFERENTIATED = [name for name, case in CASES.items() if case.varied]


def varied_gains(gains: Any, values: dict[str, Any], replace: Callable[..., Any] = with_arrays) -> Any:
    """Return gains with values in place of some, those of a loop as "position.k_p"."""
    for name, value in values.items():
        loop, _, own = name.rpartition(".")
        gains = replace(gains, **{loop: replace(getattr(gains, loop), **{own: value})} if loop else {own: value})
    return gains


def gain_values(case: LawCase) -> dict[str, Any]:
    """Return the gains by which a law is differentiated, as NumPy's arrays."""
    found: dict[str, Any] = {}
    for name in case.varied:
        value = case.gains
        for part in name.split("."):
            value = getattr(value, part)
        found[name] = np.asarray(value, dtype=np.float64)
    return found


def run(case: LawCase, gains: Any, inputs: list[Any], step: Callable[..., Any] | None = None) -> list[Any]:
    """Return force and state after each sample; the first one gives the start."""
    state, found = case.start(gains, inputs[0]), []
    for given in inputs[1:]:
        force, state = (step or case.step)(gains, state, given)
        found.append((force, state))
    return found


def cost(case: LawCase, gains: Any, inputs: list[Any]) -> Any:
    """Return the sum of the squared forces."""
    return sum((leaf * leaf).sum() for force, _ in run(case, gains, inputs) for leaf in leaves(force))


def differences(function: Callable[[dict[str, Any]], float], values: dict[str, Any]) -> dict[str, Any]:
    """Return the derivatives of a function of named arrays, by central differences."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        slopes = []
        for index in np.ndindex(value.shape):
            step = np.zeros_like(value)
            step[index] = 1e-6 * max(1.0, abs(float(value[index])))
            above, below = (function({**values, name: value + sign * step}) for sign in (1, -1))
            slopes.append((above - below) / (2 * step[index]))
        found[name] = np.array(slopes).reshape(value.shape)
    return found


def expected_slopes(case: LawCase) -> dict[str, Any]:
    """Return the derivatives of NumPy's cost, its gains checked as a user's are."""

    def of(values: dict[str, Any]) -> float:
        plain = {name: value.tolist() for name, value in values.items()}
        return float(cost(case, varied_gains(case.gains, plain, dataclasses.replace), case.inputs))

    return differences(of, gain_values(case))


# ------------------------------------------------------------------------------------------------------ a closed loop

ROLLOUT = ("tde", "atde", "artde", "artde-robust", "asmc", "positional-pid", "indi")


def tracking_cost(case: LawCase, gains: Any, zero: Any, sin: Callable[[Any], Any], samples: int = 60) -> Any:
    """Return the mean squared error of damped pendulums that start on their reference; `zero` is (n,)."""
    inertia, q, qd, tau = 0.05 if case.gains.m_bar != 1.2 else 1.4, zero, zero, zero
    state, total = None, 0.0
    for k in range(samples):
        phase = zero + 3.0 * (k * PERIOD)
        reference = 0.4 * (1.0 - sin(phase + np.pi / 2)), 1.2 * sin(phase), 3.6 * sin(phase + np.pi / 2)
        given = JointInput(q, qd, *reference, tau)
        state = case.start(gains, given) if state is None else state
        tau, state = case.step(gains, state, given)
        qd = qd + PERIOD * (tau - 0.05 * qd - 0.4 * sin(q)) / inertia
        q = q + PERIOD * qd
        total = total + ((reference[0] - q) ** 2).sum()
    return total * (1e3 / samples)


def expected_tracking_slopes(case: LawCase) -> dict[str, Any]:
    """Return the derivatives of NumPy's rollout."""
    joints = case.inputs[0].q.shape[-1]

    def of(values: dict[str, Any]) -> float:
        plain = {name: value.tolist() for name, value in values.items()}
        gains = varied_gains(case.gains, plain, dataclasses.replace)
        return float(tracking_cost(case, gains, np.zeros(joints), np.sin))

    return differences(of, gain_values(case))
