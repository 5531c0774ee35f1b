"""Rigid bodies against SciPy, conservation laws and themselves in another company."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from artde_gym.robots.q450.model import INERTIA, MASS, PAYLOAD_PLACE, q450
from artde_gym.sim.factory import EngineName, make_engine
from artde_gym.sim.rigid_bodies import (
    MassProperties,
    RigidBodies,
    composite,
    cross,
    rotate_frames,
    times,
    transposed_times,
)
from artde_gym.sim.rotation import matrix

pytestmark = pytest.mark.once

G = 9.81
BARE = MassProperties(MASS, (0.0, 0.0, 0.0), np.diag(INERTIA))
BALL = MassProperties(0.35, PAYLOAD_PLACE, 0.4 * 0.35 * 0.08**2 * np.eye(3))
BOTH = composite(BARE, BALL)
SPIN = np.array([4.0, -3.0, 5.0])


def bodies_of(*properties: MassProperties, dtype: Any = np.float64) -> RigidBodies:
    bodies = RigidBodies(len(properties), dtype)
    for i, own in enumerate(properties):
        bodies.set_properties(i, own)
        bodies.place(i, (0.1 * i, 0.2, 0.3))
    return bodies


def advance(bodies: RigidBodies, step: float, steps: int, force: Any = 0.0, torque: Any = 0.0) -> None:
    shape = bodies.rates.shape
    force, torque = (np.broadcast_to(np.asarray(x, bodies.rates.dtype), shape) for x in (force, torque))
    for _ in range(steps):
        bodies.drift(0.5 * step)
        bodies.kick(step, force, torque)
        bodies.drift(0.5 * step)


def tumble(
    properties: MassProperties, rates: np.ndarray, rot: np.ndarray, duration: float
) -> tuple[np.ndarray, np.ndarray]:
    """Euler's equations by SciPy: attitude (3, 3) and body rates (3,) at the end, without torque."""
    inertia, inverse = properties.inertia, np.linalg.inv(properties.inertia)

    def derivative(_: float, y: np.ndarray) -> np.ndarray:
        (x, y_, z, w), (p, q, r) = y[:4], y[4:]
        quat = 0.5 * np.array(
            [w * p + y_ * r - z * q, w * q + z * p - x * r, w * r + x * q - y_ * p, -x * p - y_ * q - z * r]
        )
        return np.concatenate([quat, inverse @ -np.cross(y[4:], inertia @ y[4:])])

    start = np.concatenate([Rotation.from_matrix(rot).as_quat(), rates])
    end = solve_ivp(derivative, (0.0, duration), start, rtol=1e-11, atol=1e-11).y[:, -1]
    return Rotation.from_quat(end[:4]).as_matrix(), end[4:]


def momenta(properties: MassProperties, bodies: RigidBodies, body: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Linear momentum, and angular momentum about the world's origin."""
    linear = properties.mass * bodies.com_velocity[:, body]
    own = bodies.rot[..., body] @ properties.inertia @ bodies.rates[:, body]
    return linear, own + np.cross(bodies.com[:, body], linear)


def test_composite_inertia_is_that_of_many_points() -> None:
    rng = np.random.default_rng(0)

    def cloud(mass: float) -> tuple[np.ndarray, np.ndarray, MassProperties]:
        points, masses = rng.normal(size=(50, 3)), rng.uniform(0.1, 1.0, 50)
        masses *= mass / masses.sum()
        com = masses @ points / mass
        arms = points - com
        inertia = np.sum([m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(masses, arms, strict=True)], axis=0)
        return points, masses, MassProperties(mass, tuple(com.tolist()), inertia)

    (p1, m1, a), (p2, m2, b) = cloud(1.5), cloud(0.4)
    points, masses = np.concatenate([p1, p2]), np.concatenate([m1, m2])
    both = composite(a, b)
    com = masses @ points / masses.sum()
    arms = points - com
    inertia = np.sum([m * (x @ x * np.eye(3) - np.outer(x, x)) for m, x in zip(masses, arms, strict=True)], axis=0)
    assert both.mass == pytest.approx(1.9)
    np.testing.assert_allclose(both.com, com, rtol=0, atol=1e-14)
    np.testing.assert_allclose(both.inertia, inertia, rtol=0, atol=1e-13)


def test_products() -> None:
    rng = np.random.default_rng(0)
    matrices, a, b = rng.normal(size=(3, 3, 7)), rng.normal(size=(3, 7)), rng.normal(size=(3, 7))
    np.testing.assert_allclose(times(matrices, a), np.einsum("ijn,jn->in", matrices, a), atol=1e-14)
    np.testing.assert_allclose(transposed_times(matrices, a), np.einsum("ijn,in->jn", matrices, a), atol=1e-14)
    np.testing.assert_allclose(cross(a, b), np.cross(a, b, axis=0), atol=1e-14)


def test_turning_by_small_vectors() -> None:
    rng = np.random.default_rng(0)
    rot, vectors = Rotation.from_quat(rng.normal(size=(6, 4))), rng.normal(0.0, 0.01, (6, 3))
    expected = (rot * Rotation.from_rotvec(vectors)).as_matrix()
    got = rotate_frames(np.moveaxis(rot.as_matrix(), 0, -1), vectors.T)
    np.testing.assert_allclose(np.moveaxis(got, -1, 0), expected, rtol=0, atol=1e-5)
    np.testing.assert_allclose(np.einsum("ijn,ikn->jkn", got, got), np.eye(3)[..., None].repeat(6, -1), atol=1e-14)


def test_matrix_of_a_quaternion() -> None:
    for quat in Rotation.from_quat(np.random.default_rng(0).normal(size=(5, 4))).as_quat():
        x, y, z, w = quat.tolist()
        expected = Rotation.from_quat(quat).as_matrix().ravel()
        np.testing.assert_allclose(matrix((x, y, z, w)), expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("properties", [BARE, BOTH], ids=["bare", "loaded"])
def test_tumbling_is_of_second_order(properties: MassProperties) -> None:
    rot, rates = tumble(properties, SPIN, np.eye(3), 1.0)
    errors = []
    for step in (0.01, 0.005, 0.0025):
        bodies = bodies_of(properties)
        bodies.rates[:, 0] = SPIN
        advance(bodies, step, round(1.0 / step))
        errors.append(np.abs(bodies.rot[..., 0] - rot).max() + np.abs(bodies.rates[:, 0] - rates).max())
    assert errors[1] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("loaded", [False, True], ids=["bare", "loaded"])
def test_engines_tumble_likewise(loaded: bool, engine_name: EngineName) -> None:
    engine = make_engine(engine_name, q450(), 0.001)
    engine.set_gravity((0.0, 0.0, 0.0))
    engine.reset((0.0, 0.0, 5.0), np.zeros(0))
    if loaded:
        engine.attach_payload(BALL.mass, BALL.com)
    torque = np.diag(INERTIA) @ SPIN
    for _ in range(1000):
        engine.apply_base_wrench((0.0, 0.0, 0.0), tuple(torque.tolist()))
        engine.step(np.zeros(0))
    state = engine.state()
    rot = Rotation.from_quat(state.quat_xyzw)
    rates = rot.inv().apply(state.angular_velocity)
    assert np.linalg.norm(rates) > 2.0
    for _ in range(500):
        engine.step(np.zeros(0))
    expected_rot, expected_rates = tumble(BOTH if loaded else BARE, rates, rot.as_matrix(), 0.5)
    state = engine.state()
    rot = Rotation.from_quat(state.quat_xyzw)
    np.testing.assert_allclose(rot.as_matrix(), expected_rot, rtol=0, atol=0.01)
    np.testing.assert_allclose(rot.inv().apply(state.angular_velocity), expected_rates, rtol=0, atol=0.02)
    engine.close()


def test_free_fall_is_exact() -> None:
    bodies = bodies_of(BARE, BOTH)
    bodies.rates[:] = SPIN[:, None]
    start, velocity = bodies.com.copy(), bodies.com_velocity.copy()
    advance(bodies, 0.005, 200)
    np.testing.assert_allclose(bodies.com - start - velocity, [[0.0], [0.0], [-G / 2]] * np.ones(2), rtol=0, atol=1e-11)
    np.testing.assert_allclose(bodies.com_velocity - velocity, [[0.0], [0.0], [-G]] * np.ones(2), rtol=0, atol=1e-11)


def test_energy_and_momentum_are_kept_without_forces() -> None:
    bodies = bodies_of(BOTH)
    bodies.rates[:, 0] = SPIN
    weight = np.array([[0.0], [0.0], [BOTH.mass * G]])  # at the center of mass: gravity is all that is taken away

    def energy() -> float:
        return float(0.5 * bodies.rates[:, 0] @ BOTH.inertia @ bodies.rates[:, 0])

    def spin() -> np.ndarray:
        return bodies.rot[..., 0] @ BOTH.inertia @ bodies.rates[:, 0]

    before, momentum = energy(), spin()
    for _ in range(2000):
        bodies.drift(0.0025)
        arm = transposed_times(bodies.rot, weight)
        bodies.kick(0.005, weight, np.cross(np.array(BOTH.com)[:, None], arm, axis=0))
        bodies.drift(0.0025)
    assert energy() == pytest.approx(before, rel=1e-3)
    np.testing.assert_allclose(spin(), momentum, rtol=0, atol=2e-3 * float(np.linalg.norm(momentum)))
    assert np.abs(bodies.com_velocity).max() < 1e-12
    assert np.abs(np.linalg.norm(bodies.quat_xyzw, axis=0) - 1).max() < 1e-14


def test_an_off_centre_force_turns_the_body_by_its_moment() -> None:
    bodies = bodies_of(BOTH)
    force, torque = np.array([0.3, -0.2, 0.5]), np.array([0.01, 0.02, -0.01])
    advance(bodies, 1e-4, 1, force[:, None], torque[:, None])
    moment = torque - np.cross(BOTH.com, force)
    np.testing.assert_allclose(bodies.rates[:, 0], 1e-4 * np.linalg.solve(BOTH.inertia, moment), rtol=1e-6)
    np.testing.assert_allclose(bodies.com_velocity[:, 0], 1e-4 * (force / BOTH.mass - [0, 0, G]), rtol=1e-6)


@pytest.mark.parametrize(("before", "after"), [(BOTH, BARE), (BARE, BOTH)], ids=["drop", "attach"])
def test_dropping_and_attaching_keep_momentum_and_the_motion_of_the_vehicle(
    before: MassProperties, after: MassProperties
) -> None:
    bodies = bodies_of(before)
    bodies.rates[:, 0] = SPIN
    advance(bodies, 0.005, 40, np.array([[0.5], [0.2], [10.0]]), 0.01)
    point, velocity, rates = bodies.origin()[:, 0], bodies.origin_velocity()[:, 0], bodies.rates[:, 0].copy()
    linear, angular = momenta(before, bodies)
    bodies.set_properties(0, after)
    np.testing.assert_allclose(bodies.origin()[:, 0], point, rtol=0, atol=1e-14)
    np.testing.assert_allclose(bodies.origin_velocity()[:, 0], velocity, rtol=0, atol=1e-14)
    assert np.array_equal(bodies.rates[:, 0], rates)
    # the ball moves as the place on the vehicle where it is or was
    rot = bodies.rot[..., 0]
    ball_point = point + rot @ BALL.com
    ball_velocity = velocity + rot @ np.cross(rates, BALL.com)
    sign = 1.0 if before is BOTH else -1.0
    ball_linear = sign * BALL.mass * ball_velocity
    ball_angular = sign * (rot @ BALL.inertia @ rates) + np.cross(ball_point, ball_linear)
    linear_after, angular_after = momenta(after, bodies)
    np.testing.assert_allclose(linear_after + ball_linear, linear, rtol=0, atol=1e-13)
    np.testing.assert_allclose(angular_after + ball_angular, angular, rtol=0, atol=1e-13)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_body_moves_the_same_to_the_bit_in_any_company(dtype: Any) -> None:
    rng = np.random.default_rng(3)
    n = 37
    properties = [composite(BARE, MassProperties(m, PAYLOAD_PLACE, 0.001 * np.eye(3))) for m in rng.uniform(0.1, 1, n)]
    rates, force, torque = rng.normal(size=(3, n)), rng.normal(size=(3, n)), 0.1 * rng.normal(size=(3, n))

    def fly(chosen: slice) -> bytes:
        bodies = RigidBodies(len(properties[chosen]), dtype)
        for i, own in enumerate(properties[chosen]):
            bodies.set_properties(i, own)
            bodies.place(i, (0.0, 0.0, 0.6))
        bodies.rates[:] = rates[:, chosen]
        advance(bodies, 0.005, 50, force[:, chosen], torque[:, chosen])
        parts: list[np.ndarray] = [bodies.origin(), bodies.origin_velocity(), bodies.rot.reshape(9, -1), bodies.rates]
        state = np.concatenate(parts)
        assert state.dtype == dtype
        return state.T.tobytes()

    together = fly(slice(n))
    assert together == b"".join(fly(slice(i, i + 1)) for i in range(n))
    assert together == b"".join(fly(slice(i, i + 5)) for i in range(0, n, 5))
