"""The laws against their equations: by hand, against SciPy, and in closed loop on plants with a known answer."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import solve_continuous_lyapunov
from scipy.signal import cont2discrete

from controllers.laws.artde import ArtdeGains, artde, artde_init
from controllers.laws.asmc import AsmcGains, asmc, asmc_init
from controllers.laws.atde import AtdeGains, atde, atde_init
from controllers.laws.computed_torque import ComputedTorqueGains, computed_torque
from controllers.laws.errors import GainError
from controllers.laws.indi import IndiGains, indi, indi_init
from controllers.laws.pid import PidGains, identity_gains, pid, pid_init
from controllers.laws.positional_pid import PositionalPidGains, positional_pid, positional_pid_init
from controllers.laws.rigid_attitude import RigidAttitudeGains, rigid_attitude
from controllers.laws.second_order import FilterState, second_order
from controllers.laws.stability import tde_eigenvalues, tde_is_valid
from controllers.laws.tde import (
    ConstantGains,
    TdeGains,
    constant_gain_tde,
    equivalent_gains,
    inertia_times,
    tde,
    tde_init,
)
from controllers.laws.tracking import JointInput, sliding_variable, smooth_sign

pytestmark = pytest.mark.once

PERIOD = 0.004
FEEDBACK: dict[str, dict[str, Any]] = {
    "scalar": {"m_bar": 0.042, "k_p": 25.0, "k_d": 10.0},
    "jointwise": {"m_bar": (0.03, 0.04, 0.06), "k_p": (25.0, 16.0, 36.0), "k_d": (10.0, 8.0, 12.0)},
    "matrix": {
        "m_bar": ((0.05, 0.01, 0.0), (0.01, 0.04, 0.02), (0.0, 0.02, 0.06)),
        "k_p": 25.0,
        "k_d": (9.0, 8.0, 7.0),
    },
}
ADAPTIVE = {"alpha": 4.0, "eps": 5e-5}
ARTDE: dict[str, Any] = {**ADAPTIVE, "gamma_0": 500.0, "gamma_1": 500.0, "beta_floor": 0.01, "beta_start": 0.01}
ROBUST: dict[str, Any] = {"growth": "midpoint", "clamp": True, "leakage": 0.1, "cap": 1.0}
FILTER = {"filter_rate": 50.0, "filter_damping": 0.55}
SLIDING: dict[str, Any] = {
    "slope": 2.0,
    "k_s": 3.0,
    "c_floor": 0.5,
    "gamma_c": 2.0,
    "leakage_c": 0.1,
    "eps": 0.01,
    "gamma_r": 0.3,
    "leakage_r": 0.05,
    "r_max": 2.0,
    "gravity": 9.81,
}


class Law(NamedTuple):
    gains: Callable[[dict[str, Any]], Any]
    start: Callable[..., Any]
    step: Callable[..., Any]


def pendulums(q, qd, qdd):
    """Inverse dynamics of uncoupled pendulums."""
    return 0.04 * qdd + 0.1 * qd + 2.0 * np.sin(q)


def without_gains(start: Callable[[JointInput, float], Any]) -> Callable[..., Any]:
    return lambda gains, signals, period: start(signals, period)


LAWS = {
    "tde": Law(lambda feedback: TdeGains(**feedback), without_gains(tde_init), tde),
    "tde+c": Law(
        lambda feedback: ConstantGains(**feedback, **ADAPTIVE, c=0.3), without_gains(tde_init), constant_gain_tde
    ),
    "atde": Law(
        lambda feedback: AtdeGains(**feedback, **ADAPTIVE, gamma_0=500.0, c_floor=0.01, c_start=0.01), atde_init, atde
    ),
    "artde": Law(lambda feedback: ArtdeGains(**feedback, **ARTDE), artde_init, artde),
    "artde-robust": Law(lambda feedback: ArtdeGains(**feedback, **{**ARTDE, **ROBUST}), artde_init, artde),
    "pid": Law(lambda feedback: identity_gains(TdeGains(**feedback), PERIOD), without_gains(pid_init), pid),
    "computed-torque": Law(
        lambda feedback: ComputedTorqueGains(feedback["k_p"], feedback["k_d"]),
        lambda gains, signals, period: (),
        lambda gains, memory, signals, period: (computed_torque(gains, signals, pendulums), memory),
    ),
    "indi": Law(lambda feedback: IndiGains(**feedback, **FILTER), without_gains(indi_init), indi),
    "asmc": Law(
        lambda feedback: AsmcGains(feedback["m_bar"], **SLIDING),
        lambda gains, signals, period: asmc_init(gains, signals),
        asmc,
    ),
    "positional-pid": Law(
        lambda feedback: PositionalPidGains(**feedback, k_i=3.0, integral_limit=20.0),
        lambda gains, signals, period: positional_pid_init(gains, signals),
        positional_pid,
    ),
    "rigid-attitude": Law(
        lambda feedback: RigidAttitudeGains(feedback["k_p"], feedback["k_d"], feedback["m_bar"]),
        lambda gains, signals, period: (),
        lambda gains, memory, signals, period: (rigid_attitude(gains, signals), memory),
    ),
}
WITHOUT_MATRIX = ("pid", "asmc", "positional-pid", "rigid-attitude")
CASES = [
    (name, feedback) for name in LAWS for feedback in FEEDBACK if name not in WITHOUT_MATRIX or feedback != "matrix"
]
every_law = pytest.mark.parametrize(("name", "feedback"), CASES)


def run(law: Law, gains: Any, samples: np.ndarray, period: float = PERIOD) -> list[tuple[np.ndarray, ...]]:
    """Command and all arrays of the memory after each of `samples` (time, signal, ..., n)."""
    memory, results = law.start(gains, JointInput(*samples[0]), period), []
    for sample in samples:
        tau, memory = law.step(gains, memory, JointInput(*sample), period)
        results.append((tau, *leaves(memory)))
    return results


def leaves(memory: Any) -> list[np.ndarray]:
    """The arrays of nested tuples."""
    return [leaf for part in memory for leaf in leaves(part)] if isinstance(memory, tuple) else [memory]


def signals(e: Any, ed: Any, tau_applied: Any = 0.0) -> JointInput:
    """Signals of a robot at rest at q = 0 with errors `e` and `ed`."""
    e, ed, tau_applied = (np.array(value, dtype=np.float64) for value in np.broadcast_arrays(e, ed, tau_applied))
    zero = np.zeros_like(e)
    return JointInput(zero, zero, e, ed, zero, tau_applied)


# --------------------------------------------------------------------------------------------------- batches, precision


@every_law
@settings(max_examples=10)
@given(
    seed=st.integers(0, 2**32 - 1),
    batch=st.sampled_from([(1,), (4,), (2, 3), (2, 1, 3)]),
    scale=st.sampled_from([1e-3, 1.0, 1e3]),
)
def test_batch_equals_loop_bit_for_bit(name, feedback, seed, batch, scale):
    law = LAWS[name]
    gains = law.gains(FEEDBACK[feedback])
    samples = np.random.default_rng(seed).normal(scale=scale, size=(4, 6, *batch, 3))
    together = run(law, gains, samples)
    for index in np.ndindex(*batch):
        alone = run(law, gains, samples[(slice(None), slice(None), *index)])
        for sample_together, sample_alone in zip(together, alone, strict=True):
            for many, one in zip(sample_together, sample_alone, strict=True):
                np.testing.assert_array_equal(many[index], one, strict=True)


@pytest.mark.parametrize("name", sorted(LAWS.keys() - {"rigid-attitude"}))
def test_batch_equals_loop_for_twelve_joints_in_slices_of_observations(name):
    law, feedback = LAWS[name], FEEDBACK["scalar"]
    if name not in WITHOUT_MATRIX:
        root = np.random.default_rng(1).normal(size=(12, 12))
        feedback = {**feedback, "m_bar": 0.01 * root @ root.T + 0.04 * np.eye(12)}
    gains = law.gains(feedback)
    observations = np.random.default_rng(2).normal(size=(5, 7, 80))  # time, environment, observation

    def samples(rows: np.ndarray) -> Any:
        return [[row[..., 12 * i : 12 * (i + 1)] for i in range(6)] for row in rows]

    def results(rows: np.ndarray) -> list[tuple[np.ndarray, ...]]:
        memory, out = law.start(gains, JointInput(*samples(rows)[0]), PERIOD), []
        for sample in samples(rows):
            tau, memory = law.step(gains, memory, JointInput(*sample), PERIOD)
            out.append((tau, *leaves(memory)))
        return out

    together = results(observations)
    for i in range(observations.shape[1]):
        for sample_together, sample_alone in zip(together, results(observations[:, i]), strict=True):
            for many, one in zip(sample_together, sample_alone, strict=True):
                np.testing.assert_array_equal(many[i], one, strict=True)


def smooth_samples() -> np.ndarray:
    time, phase = PERIOD * np.arange(200), np.random.default_rng(3).uniform(0, 6, size=(6, 1, 4, 3))
    wave = np.sin(5 * time[:, None, None] + phase)  # (signal, time, batch, joint)
    return np.moveaxis(wave, 0, 1)


def numpy_numbers(value: Any) -> Any:
    """The same gain as NumPy would give it, say from np.linspace."""
    return np.asarray(value) if isinstance(value, tuple) else np.float64(value)


@every_law
@pytest.mark.parametrize("convert", [lambda value: value, numpy_numbers], ids=["python", "numpy"])
def test_float32_stays_float32_and_means_the_same(name, feedback, convert):
    law = LAWS[name]
    gains = law.gains({key: convert(value) for key, value in FEEDBACK[feedback].items()})
    plain = {f.name: getattr(gains, f.name) for f in dataclasses.fields(gains)}
    scalars = {key: convert(value) for key, value in plain.items() if type(value) is float and math.isfinite(value)}
    gains = dataclasses.replace(gains, **scalars)
    samples = smooth_samples()
    for wide, narrow in zip(run(law, gains, samples), run(law, gains, samples.astype(np.float32)), strict=True):
        for precise, coarse in zip(wide, narrow, strict=True):
            assert coarse.dtype == (bool if precise.dtype == bool else np.float32)
            np.testing.assert_allclose(coarse, precise, rtol=1e-3, atol=2e-3)
    for alone in run(law, gains, samples[:3, :, 0].astype(np.float32)):
        assert {leaf.dtype for leaf in alone} <= {np.dtype(np.float32), np.dtype(bool)}


@every_law
def test_inputs_are_left_alone(name, feedback):
    law = LAWS[name]
    gains = law.gains(FEEDBACK[feedback])
    samples = smooth_samples()[:3]
    before = samples.copy()
    samples.setflags(write=False)
    memory = law.start(gains, JointInput(*samples[0]), PERIOD)
    _, memory = law.step(gains, memory, JointInput(*samples[0]), PERIOD)
    kept = [leaf.copy() for leaf in leaves(memory)]
    law.step(gains, memory, JointInput(*samples[1]), PERIOD)
    np.testing.assert_array_equal(samples, before)
    for leaf, copy in zip(leaves(memory), kept, strict=True):
        np.testing.assert_array_equal(leaf, copy)


# -------------------------------------------------------------------------------------------------------------- by hand


def test_tde_by_hand():
    gains = TdeGains(m_bar=2.0, k_p=4.0, k_d=3.0)
    # u = 0.5 + 3 * 1 + 4 * 1 = 7.5; a = qdd_ref = 0.5; tau = 10 + 2 * 7 = 24; no sigma yet
    first = JointInput(*np.array([[1.0], [0.0], [2.0], [1.0], [0.5], [10.0]]))
    tau, memory = tde(gains, tde_init(first, 0.5), first, 0.5)
    assert (tau, memory.sigma) == (24.0, 0.0)
    # u = 1 + 3 * 0.5 + 4 * 0.5 = 4.5; a = (1 - 0) / 0.5 = 2; sigma = 7.5 - 2;
    # of the 24 only 20 were applied: tau = 20 + 2 * 2.5 = 25
    second = JointInput(*np.array([[1.5], [1.0], [2.0], [1.5], [1.0], [20.0]]))
    tau, memory = tde(gains, memory, second, 0.5)
    assert (tau, memory.sigma) == (25.0, 5.5)


def test_pid_by_hand():
    gains = PidGains(proportional=3.0, integral=4.0, derivative=5.0)
    # 10 + 3 * 0.5 * 1 + 4 * 0.5 * 1, no derivative yet
    first = JointInput(*np.array([[1.0], [0.0], [2.0], [1.0], [0.5], [10.0]]))
    tau, memory = pid(gains, pid_init(first, 0.5), first, 0.5)
    assert tau == 13.5
    # 20 + 3 * 0.5 * 0.5 + 4 * 0.5 * 0.5 + 5 * (0.5 * 1 - (1 - 0)) = 20 + 0.75 + 1 - 2.5
    tau, _ = pid(gains, memory, JointInput(*np.array([[1.5], [1.0], [2.0], [1.5], [1.0], [20.0]])), 0.5)
    assert tau == 19.25


def test_indi_with_an_instant_filter_is_tde():
    gains = IndiGains(2.0, 4.0, 3.0, filter_rate=1e4, filter_damping=1.0)
    samples = np.random.default_rng(10).normal(size=(9, 6, 3))
    slow = run(LAWS["indi"], gains, samples, 0.5)
    fast = run(LAWS["tde"], TdeGains(2.0, 4.0, 3.0), samples, 0.5)
    for row, same in zip(slow, fast, strict=True):
        np.testing.assert_allclose(row[0], same[0], rtol=1e-12)


def test_indi_delays_acceleration_and_force_alike():
    # a plant without disturbance, inertia qdd = tau: what the filters lose cancels, whatever moved before
    gains, period = IndiGains(2.0, 4.0, 3.0, **FILTER), 0.01
    rng = np.random.default_rng(11)
    qd, memory = np.zeros(3), None
    for _ in range(50):
        force = rng.normal(size=3)
        q_ref, qd_ref, zero = *rng.normal(size=(2, 3)), np.zeros(3)
        before = JointInput(zero, qd, q_ref, qd_ref, zero, zero)
        memory = indi_init(before, period) if memory is None else memory
        qd = qd + period / 2.0 * force
        sample = before._replace(qd=qd, tau_applied=force)
        tau, memory = indi(gains, memory, sample, period)
        u = 3.0 * (sample.qd_ref - qd) + 4.0 * sample.q_ref
        np.testing.assert_allclose(tau, 2.0 * u, rtol=1e-9, atol=1e-9)


def test_positional_pid_by_hand():
    gains = PositionalPidGains(m_bar=2.0, k_p=4.0, k_d=3.0, k_i=8.0, integral_limit=9.0)
    # the integral starts at 10 / 2 - 0.5 = 4.5: 2 (0.5 + 4 + 3 + 4.5)
    first = JointInput(*np.array([[1.0], [0.0], [2.0], [1.0], [0.5], [10.0]]))
    tau, memory = positional_pid(gains, positional_pid_init(gains, first), first, 0.5)
    assert tau == 24.0
    # 4.5 + 0.5 * 8 * 1: 2 (1 + 2 + 1.5 + 8.5), whatever was applied
    second = JointInput(*np.array([[1.5], [1.0], [2.0], [1.5], [1.0], [99.0]]))
    tau, memory = positional_pid(gains, memory, second, 0.5)
    assert tau == 26.0
    assert memory.integral == 9.0  # 8.5 + 2, clamped
    tau, memory = positional_pid(gains, memory, second._replace(q_ref=np.array([-100.0])), 0.5)
    assert memory.integral == -9.0


def test_asmc_by_hand():
    gains = AsmcGains(
        m_bar=2.0,
        slope=2.0,
        k_s=3.0,
        c_floor=1.0,
        gamma_c=0.5,
        leakage_c=0.25,
        eps=24.0,
        gamma_r=0.01,
        leakage_r=0.5,
        r_max=4.0,
        gravity=10.0,
    )
    # s = ed + 2 e = (3, 4), sqrt(25 + 24) = 7; the weight 20 is held by 30: r = 1.5
    sample = signals((1.0, 0.0), (1.0, 4.0), tau_applied=(5.0, 30.0))
    memory = asmc_init(gains, sample)
    assert (memory.c, memory.r) == (1.0, 1.5)
    # u - g = 2 ed + 3 s + s / 7, plus 10 upward
    lifted = np.array([2.0 + 9.0 + 3 / 7, 8.0 + 12.0 + 4 / 7 + 10.0])
    tau, memory = asmc(gains, memory, sample, 0.5)
    np.testing.assert_allclose(tau, 1.5 * 2.0 * lifted, rtol=1e-14)
    assert memory.c == 1.0 + 0.5 * 0.5 * 5.0
    np.testing.assert_allclose(memory.r, 1.5 + 0.5 * (0.01 * (3 * lifted[0] + 4 * lifted[1]) - 0.5 * 0.5), rtol=1e-14)
    # the gain leaks back to its floor
    _, after = asmc(gains, memory._replace(c=np.array(2.0)), signals((0.0, 0.0), (0.0, 0.0)), 0.5)
    assert after.c == 2.0 - 0.5 * 0.25 * 1.0
    # the ratio stays within a factor of 4: weight too light, too heavy
    quick = dataclasses.replace(gains, gamma_r=1e3)
    for rising, bound in ((0.5, 4.0), (-0.5, 0.25)):
        assert asmc(quick, memory, signals((0.0, 0.0), (0.0, rising)), 0.5)[1].r == bound


# With Kp = Kd = 1, s = e / 2 + ed. |s| is 1 or 5 throughout: with eps = 24, sqrt(|s|^2 + eps) is 5 or 7.
# The robot rests at q = 0, so that a = 0 and tau = tau_applied + 3 (ed + e + du).
ONES = {"m_bar": 3.0, "k_p": 1.0, "k_d": 1.0}


def test_atde_by_hand():
    gains = AtdeGains(**ONES, alpha=2.0, gamma_0=0.5, c_floor=1.0, c_start=1.0, eps=24.0)
    steps = [  # s = ed, and c after a step of L gamma_0 |s| = |s| / 4
        ((3.0, 4.0), 2.25),  # at the floor it grows, though s before the first sample counts as equal
        ((0.0, 1.0), 2.0),  # |s| fell
        ((4.0, 3.0), 3.25),  # |s| rose
        ((-3.0, -4.0), 2.0),  # |s| did not rise, though s^T (s - s_before) = 49 > 0
        ((0.0, 5.0), 0.75),  # nor here: it falls below the floor, as printed
        ((1.0, 0.0), 1.0),  # and grows from there, though |s| fell
        ((1.0, 0.0), 1.25),
    ]
    memory = atde_init(gains, signals((0.0, 0.0), steps[0][0]), 0.5)
    for ed, c in steps:
        used = float(memory.c)
        tau, memory = atde(gains, memory, signals((0.0, 0.0), ed, tau_applied=(7.0, -7.0)), 0.5)
        assert memory.c == c
        root = 7.0 if np.linalg.norm(ed) > 2 else 5.0
        expected = np.array([7.0, -7.0]) + 3.0 * np.array(ed) * (1.0 + 2.0 * used / root)
        np.testing.assert_allclose(tau, expected, rtol=1e-14)


# e, ed -> s, |xi|; each step changes b_0 by |s| / 4 and b_1 by |xi| |s| / 16
A = ((4.0, 0.0), (3.0, 0.0))  # s = (5, 0), |xi| = 5
B = ((-4.0, 0.0), (3.0, 0.0))  # s = (1, 0), |xi| = 5
C = ((4.0, 0.0), (-3.0, 0.0))  # s = (-1, 0), |xi| = 5
D = ((0.0, 0.0), (0.0, 1.0))  # s = (0, 1), |xi| = 1
E = ((0.0, 4.0), (0.0, 3.0))  # s = (0, 5), |xi| = 5
ARTDE_BY_HAND: dict[str, tuple[dict[str, Any], list[Any]]] = {
    "printed": (
        {},
        [
            (B, (1.75, 1.6875)),  # s before the first sample counts as equal: ds = 0
            (C, (2.0, 2.0)),  # s^T ds = 2 > 0, though |s| is the same
            (D, (2.25, 2.0625)),  # s^T ds = 1 > 0, though |s| is the same
            (D, (2.0, 2.0)),  # ds = 0
            (E, (3.25, 3.5625)),  # s^T ds = 20 > 0
            (D, (3.0, 3.5)),  # s^T ds = -4 < 0
        ],
    ),
    "from the floor": ({"beta_start": 1.0}, [(B, (1.25, 1.3125)), (B, (1.0, 1.0)), (B, (1.25, 1.3125))]),
    "b_1 at the floor makes both grow": ({"gamma_1": 0.4}, [(B, (1.75, 1.0)), (B, (2.0, 2.0))]),
    "b_0 at the floor makes both grow": (
        {"gamma_0": 2.0},  # |s| a step for b_0
        [(B, (1.0, 1.6875)), (B, (2.0, 2.0)), (B, (1.0, 1.6875)), (B, (2.0, 2.0))],
    ),
    "the floor is no clamp": (
        {"gamma_0": 4.0},  # 2 |s| a step for b_0
        [(B, (0.0, 1.6875)), (B, (2.0, 2.0))],
    ),
    "clamp": (
        {"gamma_0": 2.0, "clamp": True},
        [
            (B, (1.0, 1.6875)),
            (B, (1.0, 1.375)),  # b_0 at its floor no longer makes b_1 grow
            (B, (1.0, 1.0625)),
            (B, (1.0, 1.0)),  # 0.75 without the clamp
            (E, (6.0, 2.5625)),
        ],
    ),
    "midpoint": (
        {"growth": "midpoint"},
        [
            (B, (1.75, 1.6875)),  # |s| counts as equal
            (A, (2.5, 2.625)),  # |s| from 1 to 5: up with weight 3
            (B, (1.75, 1.6875)),  # |s| from 5 to 1: down with weight 3
            (C, (1.5, 1.375)),  # |s| stays 1: down, where the printed test grows
            (C, (1.25, 1.0625)),
            (C, (1.0, 0.75)),
            (C, (1.25, 1.0625)),  # up: gains at and below their floors
        ],
    ),
    "leakage": (
        {"leakage": 0.5},  # b loses another quarter of what it has above the floor
        [(B, (1.5, 1.4375)), (C, (1.625, 1.640625))],
    ),
    "cap": (
        {"cap": 2.125},
        [(B, (1.75, 1.6875)), (E, (2.125, 2.125)), (D, (1.875, 2.0625))],
    ),
}


@pytest.mark.parametrize("case", ARTDE_BY_HAND)
def test_artde_by_hand(case):
    options, steps = ARTDE_BY_HAND[case]
    options = {"gamma_0": 0.5, "gamma_1": 0.125, "beta_floor": 1.0, "beta_start": 2.0, **options}
    gains = ArtdeGains(**ONES, alpha=2.0, eps=24.0, **options)
    memory = artde_init(gains, signals(*steps[0][0]), 0.5)
    for (e, ed), after in steps:
        b0, b1 = float(memory.beta_0), float(memory.beta_1)
        tau, memory = artde(gains, memory, signals(e, ed, tau_applied=(7.0, -7.0)), 0.5)
        assert (memory.beta_0, memory.beta_1) == after
        s = np.array(e) / 2 + np.array(ed)
        xi, root = (1.0 if (e, ed) == D else 5.0), (7.0 if (e, ed) in (A, E) else 5.0)
        assert memory.c == b0 + b1 * xi
        du = 2.0 * (b0 + b1 * xi) * s / root
        expected = np.array([7.0, -7.0]) + 3.0 * (np.array(ed) + np.array(e) + du)
        np.testing.assert_allclose(tau, expected, rtol=1e-14)


@pytest.mark.parametrize("name", ["tde", "tde+c", "atde", "artde"])
def test_du_adds_to_the_desired_acceleration(name):
    law = LAWS[name]
    gains, sample = law.gains(FEEDBACK["matrix"]), JointInput(*smooth_samples()[0])
    memory = law.start(gains, sample, PERIOD)
    extra = np.random.default_rng(4).normal(size=sample.q.shape)
    with_du, _ = law.step(gains, memory, sample, PERIOD, extra)
    without, _ = law.step(gains, memory, sample, PERIOD)
    np.testing.assert_allclose(with_du - without, extra @ np.array(gains.m_bar).T, rtol=1e-9, atol=1e-13)


# ------------------------------------------------------------------------------------------------- the sliding variable


gain_values = st.floats(0.1, 200.0)


@given(k_p=st.lists(gain_values, min_size=3, max_size=3), k_d=st.lists(gain_values, min_size=3, max_size=3))
@pytest.mark.parametrize("jointwise", [True, False])
def test_sliding_variable_solves_the_lyapunov_equation(jointwise, k_p, k_d):
    stiffness, damping = (k_p, k_d) if jointwise else ([k_p[0]] * 3, [k_d[0]] * 3)
    zero, one = np.zeros((3, 3)), np.eye(3)
    a = np.block([[zero, one], [-np.diag(stiffness), -np.diag(damping)]])
    b = np.vstack([zero, one])
    p = solve_continuous_lyapunov(a.T, -np.eye(6))  # A^T P + P A = -I
    e, ed = np.random.default_rng(5).normal(size=(2, 3))
    arguments = (stiffness, damping) if jointwise else (k_p[0], k_d[0])
    s = sliding_variable(e, ed, *arguments)
    np.testing.assert_allclose(s, b.T @ p @ np.concatenate([e, ed]), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize(
    ("k_p", "k_d", "p12", "p22"), [(25.0, 10.0, 0.02, 0.052), (10.0, 5.0, 0.05, 0.11)], ids=["biped", "quadrotor"]
)
def test_sliding_variable_of_the_thesis_gains(k_p, k_d, p12, p22):
    e, ed = np.eye(2)
    np.testing.assert_allclose(sliding_variable(e, ed, k_p, k_d), [p12, p22], rtol=1e-14)


@given(s=arrays(np.float64, (4, 3), elements=st.floats(-1e3, 1e3)), eps=st.floats(1e-6, 1e2))
def test_smooth_sign_stays_inside_the_unit_ball_and_points_along_s(s, eps):
    sign = smooth_sign(s, eps)
    length, size = (np.linalg.norm(v, axis=-1, keepdims=True) for v in (sign, s))
    assert np.all(length < 1)
    np.testing.assert_allclose(sign * size, s * length, atol=1e-9)


def test_equivalent_gains_are_the_slope_of_the_robust_term():
    gains = ConstantGains(**FEEDBACK["jointwise"], **ADAPTIVE, c=0.3)
    total = equivalent_gains(gains)

    def acceleration(e: np.ndarray, ed: np.ndarray) -> np.ndarray:  # u of the first sample
        sample = signals(e, ed)
        return constant_gain_tde(gains, tde_init(sample, PERIOD), sample, PERIOD)[1].u

    step = 1e-6
    for joint in range(3):
        unit = step * np.eye(3)[joint]
        slope_p = (acceleration(unit, 0.0 * unit) - acceleration(-unit, 0.0 * unit)) / (2 * step)
        slope_d = (acceleration(0.0 * unit, unit) - acceleration(0.0 * unit, -unit)) / (2 * step)
        np.testing.assert_allclose(slope_p, np.asarray(total.k_p)[joint] * unit / step, rtol=1e-6)
        np.testing.assert_allclose(slope_d, np.asarray(total.k_d)[joint] * unit / step, rtol=1e-6)
    assert total.m_bar == gains.m_bar


# ------------------------------------------------------------------------------------------------------------- inertias


@pytest.mark.parametrize(
    ("one", "other"),
    [(0.042, (0.042,) * 3), (0.042, np.diag([0.042] * 3)), ((0.03, 0.04, 0.05), np.diag([0.03, 0.04, 0.05]))],
    ids=["scalar-vector", "scalar-matrix", "vector-matrix"],
)
@pytest.mark.parametrize("name", ["tde", "tde+c", "atde", "artde"])
def test_descriptions_of_the_same_inertia_agree(name, one, other):
    law, rest = LAWS[name], {"k_p": 25.0, "k_d": 10.0}
    first, second = (run(law, law.gains({"m_bar": m_bar, **rest}), smooth_samples()) for m_bar in (one, other))
    for row, same in zip(first, second, strict=True):
        np.testing.assert_allclose(row[0], same[0], rtol=1e-13, atol=1e-13)


def test_full_inertia_multiplies_from_the_left():
    matrix = np.array(FEEDBACK["matrix"]["m_bar"])
    v = np.random.default_rng(6).normal(size=(4, 3))
    np.testing.assert_allclose(inertia_times(matrix.tolist(), v), [matrix @ row for row in v], rtol=1e-14)


def plant(ratio: float) -> tuple[np.ndarray, float]:
    """A coupled inertia M and an m_bar for which the largest eigenvalue of M^-1 m_bar is `ratio`."""
    inertia = np.array([[0.5, 0.2], [0.2, 0.3]])
    return inertia, ratio * float(np.linalg.eigvalsh(inertia)[0])


def follow(inertia: np.ndarray, gains: TdeGains, samples: int, period: float) -> tuple[np.ndarray, ...]:
    """e, ed, u, sigma and the true acceleration, each (samples, 2), of inertia qdd = tau - load, exactly sampled."""
    load, memory = np.array([3.0, -2.0]), None
    q, qd, tau = np.array([0.1, -0.2]), np.zeros(2), np.zeros(2)
    history = []
    for k in range(samples):
        q_ref, qd_ref, qdd_ref = (np.full(2, f(k * period)) for f in (np.sin, np.cos, lambda t: -np.sin(t)))
        sample = JointInput(q, qd, q_ref, qd_ref, qdd_ref, tau)
        tau, memory = tde(gains, memory or tde_init(sample, period), sample, period)
        qdd = np.linalg.solve(inertia, tau - load)
        history.append((q_ref - q, qd_ref - qd, memory.u, memory.sigma, qdd, qdd_ref))
        q, qd = q + period * qd + 0.5 * period**2 * qdd, qd + period * qdd
    return tuple(np.array(column) for column in zip(*history, strict=True))


@pytest.mark.parametrize("ratio", [0.2, 1.0, 1.9, 2.1, 3.0])
def test_tde_converges_where_the_eigenvalues_say_so(ratio):
    inertia, m_bar = plant(ratio)
    np.testing.assert_allclose(tde_eigenvalues(inertia, m_bar)[-1], ratio, rtol=1e-12)
    assert tde_is_valid(inertia, m_bar) == (ratio < 2)
    e, *_ = follow(inertia, TdeGains(m_bar, 25.0, 10.0), 5000 if ratio < 2 else 400, 0.001)
    if ratio < 2:
        assert np.abs(e[-1000:]).max() < 0.005 < np.abs(e[0]).max()
    else:
        assert np.abs(e[-1]).max() > 1e3


def test_tde_error_drives_the_tracking_error():
    inertia, m_bar = plant(0.7)
    gains = TdeGains(m_bar, 25.0, 10.0)
    e, ed, u, sigma, qdd, qdd_ref = follow(inertia, gains, 500, 0.001)
    edd = qdd_ref - qdd
    # e.. + Kd e. + Kp e = u - qdd, which the law reports one sample later as sigma
    np.testing.assert_allclose((edd + 10.0 * ed + 25.0 * e)[:-1], sigma[1:], rtol=1e-9, atol=1e-9)
    # sigma_k+1 = (1 - M^-1 m_bar) (sigma_k + u_k - u_k-1)
    contraction = np.eye(2) - m_bar * np.linalg.inv(inertia)
    predicted = (sigma[1:-1] + u[1:-1] - u[:-2]) @ contraction.T
    np.testing.assert_allclose(predicted[1:], sigma[2:][1:], rtol=1e-8, atol=1e-8)


def test_eigenvalues_of_any_description_of_m_bar():
    root = np.random.default_rng(7).normal(size=(5, 3, 3))
    inertia = root @ np.swapaxes(root, -1, -2) + np.eye(3)
    nominal = FEEDBACK["matrix"]["m_bar"]
    for m_bar, matrix in [(0.4, 0.4 * np.eye(3)), ((0.1, 0.2, 0.3), np.diag([0.1, 0.2, 0.3])), (nominal, nominal)]:
        expected = np.sort(np.linalg.eigvals(np.linalg.solve(inertia, np.broadcast_to(matrix, inertia.shape))).real)
        np.testing.assert_allclose(tde_eigenvalues(inertia, m_bar), expected, rtol=1e-9)
        assert tde_is_valid(inertia, m_bar).tolist() == [bool(row[-1] < 2) for row in expected]
    for wrong in [(1.0, 2.0), np.eye(2).tolist()]:
        with pytest.raises(GainError, match="m_bar"):
            tde_eigenvalues(inertia, wrong)


# --------------------------------------------------------------------------------------------------------- the low-pass


@pytest.mark.parametrize("damping", [1.0, 0.999, 0.55, 0.05])
@pytest.mark.parametrize(("natural", "period"), [(30.0, 0.015), (50.0, 0.001), (2.0, 1.0)])
def test_second_order_is_exact_for_a_held_input(damping, natural, period):
    a = np.array([[0.0, 1.0], [-(natural**2), -2 * damping * natural]])
    b, c, d = np.array([[0.0], [natural**2]]), np.eye(2), np.zeros((2, 1))
    system: Any = cont2discrete((a, b, c, d), period, method="zoh")
    state, memory = np.array([0.3, -1.0]), FilterState(np.array(0.3), np.array(-1.0))
    for u in np.random.default_rng(12).normal(size=20):
        state = system[0] @ state + system[1][:, 0] * u
        memory = second_order(memory, np.array(u), natural, damping, period)
        np.testing.assert_allclose([memory.value, memory.rate], state, rtol=1e-9, atol=1e-9)


@given(inputs=st.lists(st.floats(-1, 1), min_size=5, max_size=40), natural=st.floats(0.1, 300.0))
def test_critically_damped_output_stays_among_its_inputs(inputs, natural):
    memory = FilterState(np.array(inputs[0]), np.array(0.0))
    for u in inputs:
        memory = second_order(memory, np.array(u), natural, 1.0, 0.015)
        assert min(inputs) - 1e-12 <= memory.value <= max(inputs) + 1e-12


# --------------------------------------------------------------------------------------------------------------- errors

GAINS: list[tuple[type, dict[str, Any]]] = [
    (TdeGains, FEEDBACK["scalar"]),
    (ConstantGains, {**FEEDBACK["scalar"], **ADAPTIVE, "c": 0.3}),
    (AtdeGains, {**FEEDBACK["scalar"], **ADAPTIVE, "gamma_0": 500.0, "c_floor": 0.01, "c_start": 0.01}),
    (ArtdeGains, {**FEEDBACK["scalar"], **ARTDE, **ROBUST}),
    (PidGains, {"proportional": 420.0, "integral": 1050.0, "derivative": 42.0}),
    (ComputedTorqueGains, {"k_p": 25.0, "k_d": 10.0}),
    (RigidAttitudeGains, {"k_p": 25.0, "k_d": 10.0, "inertia": 0.04}),
    (IndiGains, {**FEEDBACK["scalar"], **FILTER}),
    (AsmcGains, {"m_bar": 0.042, **SLIDING}),
    (PositionalPidGains, {**FEEDBACK["scalar"], "k_i": 3.0, "integral_limit": 20.0}),
]
MAY_BE_ZERO = {"c", "gamma_0", "gamma_1", "leakage", "k_i", "integral_limit"}
MAY_BE_ZERO |= {"k_s", "c_floor", "gamma_c", "leakage_c", "gamma_r", "leakage_r", "gravity"}
NEVER_ALLOWED: list[Any] = [-1.0, math.nan, -math.inf, "25", None, [], [1.0, 0.0], [1.0, math.nan], [[1.0], [2.0]]]


@pytest.mark.parametrize(("kind", "good"), GAINS, ids=lambda value: getattr(value, "__name__", ""))
def test_gain_errors_name_field_and_value(kind, good):
    kind(**good)
    for field in good.keys() - {"clamp"}:
        zero = [] if field in MAY_BE_ZERO else [0.0]
        infinite = [] if field == "cap" else [math.inf]
        for value in NEVER_ALLOWED + zero + infinite:
            with pytest.raises(GainError) as caught:
                kind(**{**good, field: value})
            assert caught.value.field == field
            assert caught.value.value is value
            assert field in str(caught.value)
            assert repr(value) in str(caught.value)


@pytest.mark.parametrize(
    "matrix",
    [
        [[1.0, 0.5], [0.0, 1.0]],
        [[1.0, 2.0], [2.0, 1.0]],
        [[0.0, 0.0], [0.0, 1.0]],
        [[math.nan, 0.0], [0.0, 1.0]],
        [[math.inf, 0.0], [0.0, 1.0]],
        [[1.0, 0.0]],
        [[1.0, 0.0], [1.0]],
    ],
    ids=["unsymmetric", "indefinite", "singular", "nan", "inf", "not square", "ragged"],
)
def test_nominal_inertia_must_be_positive_definite(matrix):
    with pytest.raises(GainError, match="m_bar"):
        TdeGains(matrix, 25.0, 10.0)


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        (AtdeGains, "c_start", 0.009),
        (ArtdeGains, "beta_start", 0.009),
        (ArtdeGains, "cap", 0.009),
        (ArtdeGains, "growth", "both"),
        (IndiGains, "filter_damping", 1.01),
        (AsmcGains, "r_max", 0.99),
    ],
)
def test_gains_that_contradict_each_other(kind, field, value):
    good = dict(GAINS)[kind]
    with pytest.raises(GainError, match=field):
        kind(**{**good, field: value})
