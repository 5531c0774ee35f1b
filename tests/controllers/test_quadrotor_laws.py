"""The quadrotor's geometry and cascade: against SciPy's rotations, by hand, and in a simulation of its own."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from controllers.law_table import LAWS
from controllers.laws import cascade as cascade_module
from controllers.laws.attitude import attitude_error, desired_axes, desired_rates, heading
from controllers.laws.cascade import CascadeGains, QuadrotorInput, cascade, cascade_init
from controllers.laws.errors import GainError
from controllers.laws.positional_pid import PositionalPidGains
from controllers.laws.rigid_attitude import RigidAttitudeGains, rigid_attitude
from controllers.laws.tde import TdeGains
from controllers.laws.tracking import Array, JointInput, Law, LawState, components
from controllers.laws.vectors import joined, to_body, to_world

pytestmark = pytest.mark.once

PERIOD = 0.015
THESIS: dict[str, Any] = {"k_p": 10.0, "k_d": 5.0}
LIMITS: dict[str, Any] = {"command_rate": 30.0, "tilt_max_deg": 45.0, "lift_min": 2.0, "lift_max": 24.0}
TDE = LAWS["tde"].law


def axes_of(rotation: Any) -> Any:
    """Body axes of a matrix (..., 3, 3): its columns, each by components."""
    matrix = np.asarray(rotation)
    return tuple(components(matrix[..., :, i]) for i in range(3))


def matrix_of(axes: Any) -> np.ndarray:
    return np.stack([np.stack(axis, axis=-1) for axis in axes], axis=-1)


def vee(matrix: np.ndarray) -> np.ndarray:
    return np.stack([matrix[..., 2, 1], matrix[..., 0, 2], matrix[..., 1, 0]], axis=-1)


def random_rotations(seed: int, count: int, scale: float = 1.0) -> Rotation:
    return Rotation.from_rotvec(np.random.default_rng(seed).normal(scale=scale, size=(count, 3)))


# ------------------------------------------------------------------------------------------------------------ rotations


def test_vectors_turn_as_scipy_turns_them():
    rotation, vector = random_rotations(0, 20), np.random.default_rng(1).normal(size=(20, 3))
    axes = axes_of(rotation.as_matrix())
    np.testing.assert_allclose(joined(to_world(axes, components(vector))), rotation.apply(vector), atol=1e-14)
    np.testing.assert_allclose(joined(to_body(axes, components(vector))), rotation.inv().apply(vector), atol=1e-14)


def test_attitude_error_is_the_printed_product_desired_minus_actual():
    actual, desired = random_rotations(2, 50).as_matrix(), random_rotations(3, 50).as_matrix()
    r, d = actual.swapaxes(-1, -2), desired.swapaxes(-1, -2)
    expected = 0.5 * vee(r @ desired - d @ actual)
    np.testing.assert_allclose(joined(attitude_error(axes_of(actual), axes_of(desired))), expected, atol=1e-14)


def test_attitude_error_is_the_sine_of_the_angle_along_the_axis_of_turning():
    actual, turn = random_rotations(4, 50), random_rotations(5, 50, scale=0.7)
    e = joined(attitude_error(axes_of(actual.as_matrix()), axes_of((actual * turn).as_matrix())))
    angle = turn.magnitude()
    np.testing.assert_allclose(e, turn.as_rotvec() * (np.sin(angle) / angle)[:, None], atol=1e-14)


def test_attitude_error_changes_at_the_rate_error():
    # for small errors e_q. = e_w: here to first order in the error's size
    actual, error = random_rotations(6, 20), random_rotations(7, 20, scale=1e-4)
    rates, rates_ref = np.random.default_rng(8).normal(size=(2, 20, 3))
    step = 1e-6

    def error_at(time: float) -> np.ndarray:
        now = actual * Rotation.from_rotvec(time * rates)
        desired = actual * error * Rotation.from_rotvec(time * rates_ref)
        return joined(attitude_error(axes_of(now.as_matrix()), axes_of(desired.as_matrix())))

    slope = (error_at(step) - error_at(-step)) / (2 * step)
    carried = error.apply(rates_ref)  # R^T R_d w_d
    np.testing.assert_allclose(slope, carried - rates, atol=1e-3)


forces = arrays(np.float64, (4, 3), elements=st.floats(-10, 10)).map(lambda f: f + np.array([0.0, 0.0, 12.0]))


@given(force=forces, yaw=st.floats(-math.pi, math.pi))
def test_desired_axes_are_a_rotation_with_the_thrust_and_the_yaw_asked_for(force, yaw):
    axes = desired_axes(components(force), heading(np.full(4, yaw), np.zeros(4)))
    matrix = matrix_of(axes)
    np.testing.assert_allclose(matrix @ matrix.swapaxes(-1, -2), np.broadcast_to(np.eye(3), (4, 3, 3)), atol=1e-13)
    np.testing.assert_allclose(np.linalg.det(matrix), 1.0, atol=1e-13)
    np.testing.assert_allclose(matrix[..., 2] * np.linalg.norm(force, axis=-1, keepdims=True), force, atol=1e-12)
    found = Rotation.from_matrix(matrix).as_euler("ZYX")[:, 0]
    np.testing.assert_allclose(np.remainder(found - yaw + 1, 2 * np.pi), 1.0, atol=1e-12)


def moving_command(time: float) -> tuple[Any, Any, Any]:
    """A force, its rate, and a heading, smooth in time."""
    phase = np.array([1.0, 2.0, 3.0])
    force = np.array([0.0, 0.0, 15.0]) + 5 * np.sin(2 * time + phase)
    return components(force), components(10 * np.cos(2 * time + phase)), heading(np.sin(3 * time), 3 * np.cos(3 * time))


@pytest.mark.parametrize("time", np.linspace(0.0, 3.0, 16))
def test_desired_rates_are_those_of_the_desired_axes(time):
    def rotation(at: float) -> Rotation:
        force, _, towards = moving_command(at)
        return Rotation.from_matrix(matrix_of(desired_axes(force, towards)))

    force, rate, towards = moving_command(time)
    rates = joined(desired_rates(desired_axes(force, towards), force, rate, towards))
    step = 1e-5
    turned = (rotation(time - step).inv() * rotation(time + step)).as_rotvec()
    np.testing.assert_allclose(rates, turned / (2 * step), rtol=1e-7, atol=1e-7)


def test_rigid_attitude_is_equation_16_of_lee():
    inertia = np.array([0.01, 0.02, 0.03])
    actual, desired = random_rotations(9, 1)[0].as_matrix(), random_rotations(10, 1)[0].as_matrix()
    rates, rates_ref, turning = np.random.default_rng(11).normal(size=(3, 3))
    across = actual.T @ desired
    signals = JointInput(
        -0.5 * vee(across - across.T),
        rates,
        np.zeros(3),
        across @ rates_ref,
        across @ turning - np.cross(rates, across @ rates_ref),
        np.zeros(3),
    )
    k_r, k_w = 8.0 * inertia, 3.0 * inertia
    e_r, e_w = 0.5 * vee(across.T - across), rates - across @ rates_ref  # actual minus desired, as there
    expected = -k_r * e_r - k_w * e_w + np.cross(rates, inertia * rates)
    expected -= inertia * (np.cross(rates, across @ rates_ref) - across @ turning)
    np.testing.assert_allclose(
        rigid_attitude(RigidAttitudeGains(8.0, 3.0, inertia.tolist()), signals), expected, atol=1e-14
    )


# ---------------------------------------------------------------------------------------------------------- the cascade


def tde_gains(**options: Any) -> CascadeGains:
    return CascadeGains(TdeGains(1.0, **THESIS), TdeGains(0.015, **THESIS), **{**LIMITS, **options})


def flight(*batch: int, seed: int = 12, **given: Any) -> QuadrotorInput:
    """A random but plausible sample; `given` replaces parts of it."""
    rng = np.random.default_rng(seed)
    vector = (*batch, 3)
    rotation = Rotation.from_rotvec(rng.normal(scale=0.2, size=(math.prod(batch), 3))).as_matrix()
    parts = {name: rng.normal(scale=0.1, size=vector) for name in QuadrotorInput._fields if name != "axes"}
    parts |= {name: rng.normal(scale=0.3, size=batch) for name in ("yaw_ref", "yaw_rate_ref")}
    parts["thrust_applied"] = 15.0 + rng.normal(size=batch)
    parts["axes"] = axes_of(rotation.reshape(*batch, 3, 3))
    return QuadrotorInput(**{**parts, **given})


LEVEL = axes_of(np.eye(3))


def at_rest(**given: Any) -> QuadrotorInput:
    """Hover at the origin, level, where the reference wants it."""
    zero = np.zeros(3)
    parts: dict[str, Any] = dict.fromkeys(QuadrotorInput._fields, zero)
    parts |= {"axes": LEVEL, "yaw_ref": np.float64(0), "yaw_rate_ref": np.float64(0), "thrust_applied": np.float64(15)}
    return QuadrotorInput(**{**parts, **given})


def spy(law: Law, seen: list[JointInput]) -> Law:
    """The same law, which notes what it is shown."""

    def step(gains: Any, memory: Any, signals: JointInput, period: float) -> tuple[Array, LawState]:
        seen.append(signals)
        return law.step(gains, memory, signals, period)

    return law._replace(step=step)


def test_hover_asks_for_what_acts():
    still = at_rest(torque_applied=np.array([0.1, -0.2, 0.05]))
    wrench, memory = cascade(TDE, TDE, tde_gains(), cascade_init(TDE, TDE, tde_gains(), still, PERIOD), still, PERIOD)
    np.testing.assert_allclose(wrench, [15.0, 0.1, -0.2, 0.05], atol=1e-12)
    np.testing.assert_allclose(memory.force, [0.0, 0.0, 15.0], atol=1e-12)


def test_a_step_by_hand():
    gains, period = tde_gains(), 0.1
    start = cascade_init(TDE, TDE, gains, at_rest(), period)
    # pitched by atan(3/4) with u1 = 10 N, half a meter behind, 0.2 m/s too fast
    tilted = at_rest(
        axes=axes_of([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]),
        position_ref=np.array([0.5, 0.0, 0.0]),
        velocity=np.array([0.2, 0.0, 0.0]),
        thrust_applied=np.float64(10.0),
        rates=np.array([0.0, 2.0, 0.0]),
        torque_applied=np.array([0.0, 0.03, 0.0]),
    )
    wrench, memory = cascade(TDE, TDE, gains, start, tilted, period)
    # applied: 10 N along the mean of (0, 0, 1) and (0.6, 0, 0.8); a = 0.2 / 0.1; u = 10 * 0.5 - 5 * 0.2
    force = np.array([3.0 + 4.0 - 2.0, 0.0, 9.0])
    np.testing.assert_allclose(memory.force, force, atol=1e-12)
    # the low-pass was at (0, 0, 15) at rest: still level, no rate. With x = 3 = 30 * 0.1, one period later
    decay = math.exp(-3.0)
    after = force + (np.array([0.0, 0.0, 15.0]) - force) * 4.0 * decay
    rate = -(np.array([0.0, 0.0, 15.0]) - force) * 30.0 * 3.0 * decay
    np.testing.assert_allclose(memory.command.value, after, atol=1e-12)
    np.testing.assert_allclose(memory.command.rate, rate, atol=1e-12)
    # its direction then turns about y at (z f. - ...) / |f|^2, in the plane of x and z
    alpha = (rate[0] * after[2] - rate[2] * after[0]) / (after[0] ** 2 + after[2] ** 2) / period
    # e_q = sin(-angle), e_w = -2, a = 2 / 0.1; alpha_d stays along y
    u = alpha - 5.0 * 2.0 - 10.0 * 0.6
    thrust = 0.6 * force[0] + 0.8 * force[2]
    np.testing.assert_allclose(wrench, [thrust, 0.0, 0.03 + 0.015 * (u - 20.0), 0.0], atol=1e-12)


def test_what_the_attitude_law_sees():
    seen: list[JointInput] = []
    gains, now, rng = tde_gains(), flight(4), np.random.default_rng(13)
    memory = cascade_init(TDE, TDE, gains, now, PERIOD)
    memory = memory._replace(command=memory.command._replace(rate=rng.normal(scale=20.0, size=(4, 3))))
    axes_ref, rates_ref = cascade_module._attitude_command(memory.command, now, 0.0, np)
    _, after = cascade(TDE, spy(TDE, seen), gains, memory, now, PERIOD)
    assert after.axes_ref is not memory.axes_ref
    np.testing.assert_array_equal(matrix_of(after.axes_ref), matrix_of(axes_ref))
    across = matrix_of(now.axes).swapaxes(-1, -2) @ matrix_of(axes_ref)
    carried = np.einsum("...ij,...j", across, joined(rates_ref))
    (signals,) = seen
    np.testing.assert_allclose(signals.q_ref - signals.q, 0.5 * vee(across - across.swapaxes(-1, -2)), atol=1e-14)
    np.testing.assert_allclose(signals.qd_ref, carried, atol=1e-12)
    asked = signals.qdd_ref - np.asarray(now.turning_ref)  # less what a residual adds
    turning = np.einsum("...ji,...j", across, asked + np.cross(now.rates, carried))
    later = now._replace(yaw_ref=now.yaw_ref + PERIOD * now.yaw_rate_ref)
    _, rates_after = cascade_module._attitude_command(after.command, later, 0.0, np)
    np.testing.assert_allclose(turning, (joined(rates_after) - joined(rates_ref)) / PERIOD, atol=1e-10)
    np.testing.assert_array_equal(signals.tau_applied, now.torque_applied)


@pytest.mark.parametrize("command", ["filtered", "reference"])
def test_desired_rates_and_accelerations_are_those_of_the_desired_attitude(command):
    """Along a moving reference, R_d turns at w_d, and w_d changes at alpha_d, to the order of the period."""
    period, samples = 0.001, 400
    position = PositionalPidGains(1.48, 1e-9, 1e-9, 0.0, 20.0)
    gains = CascadeGains(position, TdeGains(0.015, **THESIS), **LIMITS, command=command)
    law, seen, axes, memory = LAWS["positional-pid"].law, [], [], None
    for k in range(samples):
        t = k * period
        now = at_rest(
            acceleration_ref=np.array([2 * math.sin(3 * t), 3 * math.cos(2 * t), math.sin(t)]),
            jerk_ref=np.array([6 * math.cos(3 * t), -6 * math.sin(2 * t), math.cos(t)]),
            yaw_ref=np.float64(0.7 * t),  # its acceleration is in no observation, and taken for zero
            yaw_rate_ref=np.float64(0.7),
            thrust_applied=np.float64(1.48 * 9.81),
        )
        if memory is None:
            memory = cascade_init(law, TDE, gains, now, period)
        _, memory = cascade(law, spy(TDE, seen), gains, memory, now, period)
        axes.append(matrix_of(memory.axes_ref))
    desired = Rotation.from_matrix(np.array(axes))
    # level and not turning: R^T R_d w_d and R^T R_d alpha_d are world vectors
    rates = desired.inv().apply([s.qd_ref for s in seen])
    accelerations = desired.inv().apply([s.qdd_ref for s in seen])
    later = slice(250, 398)  # the low-pass has caught up with the start
    turned = (desired[:-1].inv() * desired[1:]).as_rotvec() / period
    np.testing.assert_allclose(turned[later], 0.5 * (rates[:-1] + rates[1:])[later], atol=1e-4)
    change = np.diff(rates, axis=0) / period
    shift = 0 if command == "filtered" else 1
    np.testing.assert_allclose(accelerations[250 + shift : 398 + shift], change[later], atol=1e-9)
    assert np.abs(rates[later]).max() > 0.3


@pytest.mark.parametrize("wish", [(1e3, 0.0, 0.0), (0.0, 0.0, -1e3), (-1e3, 1e3, 1e3), (3.0, -1e3, 0.0)])
def test_the_force_stays_within_reach(wish):
    gains = tde_gains()
    now = at_rest(position_ref=np.array(wish))
    memory = cascade_init(TDE, TDE, gains, now, PERIOD)
    for _ in range(100):
        wrench, memory = cascade(TDE, TDE, gains, memory, now, PERIOD)
        x, y, lift = memory.force
        assert 2.0 <= lift <= 24.0
        assert math.hypot(x, y) <= lift * (1 + 1e-12)
        assert np.all(np.isfinite(wrench))
        tilt = math.degrees(math.acos(matrix_of(memory.axes_ref)[2, 2]))
        assert tilt <= 45.0 + 1e-9
    np.testing.assert_allclose(memory.command.value, memory.force, rtol=1e-6)
    assert np.sign(memory.force[0]) == np.sign(wish[0])


def test_a_force_within_reach_is_left_alone():
    now = at_rest(position_ref=np.array([0.2, -0.1, 0.1]))
    _, memory = cascade(TDE, TDE, tde_gains(), cascade_init(TDE, TDE, tde_gains(), now, PERIOD), now, PERIOD)
    np.testing.assert_allclose(memory.force, [2.0, -1.0, 16.0], rtol=1e-14)


def test_the_printed_error_is_that_of_the_thesis():
    actual = random_rotations(14, 1, scale=0.3)[0].as_matrix()
    now = flight(axes=axes_of(actual), rates=np.array([0.3, -0.2, 0.1]))
    memory = cascade_init(TDE, TDE, tde_gains(), now, PERIOD)
    memory = memory._replace(command=memory.command._replace(rate=np.array([5.0, -3.0, 1.0])))
    axes_ref, rates_ref = cascade_module._attitude_command(memory.command, now, 0.0, np)
    desired = matrix_of(axes_ref)
    seen: list[JointInput] = []
    for sign in ("desired", "printed"):
        cascade(TDE, spy(TDE, seen), tde_gains(attitude_error=sign), memory, now, PERIOD)
    ours, printed = seen
    np.testing.assert_allclose(printed.q_ref - printed.q, vee(desired.T @ actual - actual.T @ desired), atol=1e-14)
    expected = now.rates - desired.T @ actual @ np.array(rates_ref)
    np.testing.assert_allclose(printed.qd_ref - printed.qd, expected, atol=1e-14)
    np.testing.assert_array_equal(printed.qdd_ref, ours.qdd_ref)


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("command_rate", [0.0, -1.0, math.inf, "30"]),
        ("tilt_max_deg", [0.0, 90.0, math.nan]),
        ("lift_min", [0.0, -1.0]),
        ("lift_max", [1.9, math.inf]),
        ("command", ["raw"]),
        ("remembered_force", ["desired"]),
        ("attitude_error", ["actual"]),
    ],
)
def test_gains_between_the_loops_are_checked(field, values):
    for value in values:
        with pytest.raises(GainError, match=f"{field} is {value!r}"):
            dataclasses.replace(tde_gains(), **{field: value})
