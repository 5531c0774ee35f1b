"""The quadrotor's controllers in a simulation of its own, written here from Newton's and Euler's equations."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import controllers
from artde_gym.robots.q450 import model as q450
from controllers.law_table import LAWS, Nothing
from controllers.laws.cascade import CascadeGains, QuadrotorInput, cascade, cascade_init
from controllers.laws.tde import TdeGains
from controllers.laws.tracking import Array, JointInput, Law, LawState

pytestmark = pytest.mark.once

GRAVITY = np.array([0.0, 0.0, -9.81])
PERIOD = 0.015
INERTIA = np.array(q450.INERTIA)


class Judge:
    """One rigid quadrotor, integrated by Runge and Kutta in short steps.

    Args:
        mass, inertia, com: of the whole body, about its center of mass, which lies at `com` in the body frame.
        lag: of the rotors (s); 0 for none.
        drag: N s/m.
        force: of the world on the center of mass (N), a function of time.
        torque: likewise (Nm, body axes).
    """

    def __init__(
        self,
        mass: float = q450.MASS,
        inertia: np.ndarray | None = None,
        com: tuple[float, float, float] = (0.0, 0.0, 0.0),
        lag: float = q450.ROTOR_LAG,
        drag: float = 0.0,
        force: Callable[[float], Any] = lambda time: 0.0,
        torque: Callable[[float], Any] = lambda time: 0.0,
        substeps: int = 5,
    ) -> None:
        self.mass, self.com, self.lag, self.drag = mass, np.array(com), lag, drag
        self.inertia = np.diag(q450.INERTIA) if inertia is None else np.array(inertia)
        self.force, self.torque, self.substeps = force, torque, substeps
        self.time = 0.0
        weight = np.array([0.0, 0.0, mass * 9.81])  # hover: the thrust's line passes through the center of mass
        self.rotors = q450.ALLOCATION @ np.array([weight[2], *np.cross(self.com, weight)])
        self.position, self.velocity = np.zeros(3), np.zeros(3)  # of the center of mass
        self.rot, self.rates = np.eye(3), np.zeros(3)

    def place(
        self, position: Any, velocity: Any = (0.0, 0.0, 0.0), rot: Any = None, rates: Any = (0.0, 0.0, 0.0)
    ) -> None:
        """Put the body's origin somewhere."""
        self.rot = np.eye(3) if rot is None else np.array(rot)
        self.rates = np.array(rates)
        self.position = np.array(position) + self.rot @ self.com
        self.velocity = np.array(velocity) + self.rot @ np.cross(self.rates, self.com)

    @property
    def origin(self) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity of the body's origin."""
        return (
            self.position - self.rot @ self.com,
            self.velocity - self.rot @ np.cross(self.rates, self.com),
        )

    def hold(self, wrench: np.ndarray, period: float = PERIOD) -> np.ndarray:
        """Let a commanded wrench act for one period; returns the mean wrench of the rotors."""
        target = np.clip(q450.ALLOCATION @ wrench, 0.0, q450.MAX_THRUST)
        before, step = self.rotors.copy(), period / self.substeps

        def rotors(time: float) -> np.ndarray:
            return target + (before - target) * math.exp(-time / self.lag) if self.lag else target

        for i in range(self.substeps):
            self._advance(i * step, step, rotors)
        self.time += period
        self.rotors = rotors(period)
        share = self.lag / period * (1 - math.exp(-period / self.lag)) if self.lag else 0.0
        return q450.MIXER @ (target + (before - target) * share)

    def _advance(self, time: float, step: float, rotors: Callable[[float], np.ndarray]) -> None:
        def slope(ahead: float, velocity: np.ndarray, turned: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, ...]:
            wrench = q450.MIXER @ rotors(time + ahead)
            rot = self.rot @ Rotation.from_rotvec(turned).as_matrix()
            thrust = np.array([0.0, 0.0, wrench[0]])
            now = self.time + time + ahead
            force = rot @ thrust + self.mass * GRAVITY - self.drag * velocity + self.force(now)
            torque = wrench[1:] + np.cross(-self.com, thrust) + self.torque(now)
            angular = np.linalg.solve(self.inertia, torque - np.cross(rates, self.inertia @ rates))
            # the rate of a rotation vector: w + 1/2 v x w + ..., exact to the order of the integration in a short step
            turning = rates + 0.5 * np.cross(turned, rates) + np.cross(turned, np.cross(turned, rates)) / 12
            return velocity, force / self.mass, turning, angular

        start = (self.position, self.velocity, np.zeros(3), self.rates)
        k1 = slope(0.0, *start[1:])
        k2 = slope(step / 2, *(x + step / 2 * k for x, k in zip(start[1:], k1[1:], strict=True)))
        k3 = slope(step / 2, *(x + step / 2 * k for x, k in zip(start[1:], k2[1:], strict=True)))
        k4 = slope(step, *(x + step * k for x, k in zip(start[1:], k3[1:], strict=True)))
        total = [x + step / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(start, k1, k2, k3, k4, strict=True)]
        self.position, self.velocity, turned, self.rates = total
        self.rot = self.rot @ Rotation.from_rotvec(turned).as_matrix()


Reference = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Flown(NamedTuple):
    """Position errors (samples, 3) (m), diagnostics after the last sample, and when it crashed (s), or None."""

    error: np.ndarray
    inside: dict[str, np.ndarray]
    crashed: float | None


def fly(judge: Judge, policy: Any, reference: Callable[[float], Reference], duration: float) -> Flown:
    """From where the judge is until the end or a crash: upside down, below the ground, or 10 m away."""
    wrench, state, errors, crashed = q450.MIXER @ judge.rotors, None, [], None
    for k in range(round(duration / PERIOD)):
        position, velocity = judge.origin
        wanted = reference(k * PERIOD)
        parts = (position, velocity, judge.rot.ravel(), judge.rates, *wanted, [0.0, 0.0], wrench, judge.rotors, [0.0])
        errors.append(wanted[0] - position)
        if judge.rot[2, 2] < 0 or position[2] < 0 or not np.abs(position).max() < 10:
            crashed = k * PERIOD
            break
        action, state = policy.predict(np.concatenate(parts), state)
        wrench = judge.hold(action)
    return Flown(np.array(errors), policy.diagnostics(state), crashed)


def eight(time: float) -> Reference:
    """A figure of eight that starts from rest: x = 1.2 sin th, y = 0.6 sin 2 th, z = 0.6 + 0.2 sin th.

    th = rate (t - T tanh(t / T)), and its derivatives.
    """
    rate, ramp = 0.22, 2.0
    h = math.tanh(time / ramp)
    g = 1 - h * h
    angle, first, second = rate * (time - ramp * h), rate * (1 - g), rate * 2 * h * g / ramp
    third = rate * 2 * (g * g - 2 * h * h * g) / ramp**2
    rows = []
    for size, frequency, offset in ((1.2, 1, 0.0), (0.6, 2, 0.0), (0.2, 1, 0.6)):
        sin, cos = math.sin(frequency * angle), math.cos(frequency * angle)
        a, b, c = frequency * first, frequency * second, frequency * third
        acceleration = size * (cos * b - sin * a * a)
        jerk = size * (cos * (c - a**3) - 3 * sin * a * b)
        rows.append((offset + size * sin, size * cos * a, acceleration, jerk))
    position, velocity, acceleration, jerk = np.array(rows).T
    return position, velocity, acceleration, jerk


# ------------------------------------------------------------------------------------------------------------ the judge


def test_the_judge_conserves_momentum_and_energy_when_nothing_acts():
    judge = Judge(lag=0.0)
    judge.rotors = np.zeros(4)
    judge.place((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), rates=(3.0, -2.0, 4.0))

    def momentum() -> np.ndarray:
        return judge.rot @ (INERTIA * judge.rates)

    def energy() -> float:
        return 0.5 * float(INERTIA @ judge.rates**2)

    before, turning = momentum(), energy()
    for _ in range(200):
        judge.hold(np.zeros(4))
    np.testing.assert_allclose(momentum(), before, atol=1e-9)
    np.testing.assert_allclose(energy(), turning, rtol=1e-8)
    np.testing.assert_allclose(judge.rot @ judge.rot.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(judge.velocity, [1.0, 2.0, 3.0 - 9.81 * 3.0], rtol=1e-12)
    np.testing.assert_allclose(judge.position, [3.0, 6.0, 9.0 - 9.81 * 4.5], rtol=1e-12)


def test_the_judge_hovers_with_a_payload_off_center():
    judge = Judge(mass=1.83, com=(0.002, -0.001, -0.02))
    judge.place((0.0, 0.0, 1.0))
    for _ in range(100):
        judge.hold(q450.MIXER @ judge.rotors)
    np.testing.assert_allclose(judge.origin[0], [0.0, 0.0, 1.0], atol=1e-9)


# ------------------------------------------------------------------------------------------------------- error dynamics


def hover_law(force: Any) -> Law:
    """A position law that always wants the same force."""

    def step(gains: Any, memory: LawState, signals: JointInput, period: float) -> tuple[Array, LawState]:
        return np.array(force), memory

    return Law(lambda gains, signals, period: Nothing(), step)


def constant(vector: Any) -> Callable[[float], np.ndarray]:
    return lambda time: np.array(vector)


class Sample(NamedTuple):
    """What the law saw and left."""

    signals: JointInput
    memory: Any


def loop(judge: Judge, position: Law, gains: CascadeGains, samples: int, which: str, place: Any) -> list[Sample]:
    """Samples of the position or attitude loop around a judge that is wanted at `place`, at rest."""
    seen: list[Sample] = []

    def noting(law: Law) -> Law:
        def step(gains: Any, memory: Any, signals: JointInput, period: float) -> tuple[Array, LawState]:
            force, memory = law.step(gains, memory, signals, period)
            seen.append(Sample(signals, memory))
            return force, memory

        return law._replace(step=step)

    outer, inner = (noting(position), TDE) if which == "position" else (position, noting(TDE))
    wrench, memory, zero = q450.MIXER @ judge.rotors, None, np.zeros(3)
    for _ in range(samples):
        axes: Any = tuple(tuple(judge.rot[:, i]) for i in range(3))
        now = QuadrotorInput(
            *judge.origin[:2],
            axes,
            judge.rates,
            np.array(place),
            zero,
            zero,
            zero,
            np.array(0.0),
            np.array(0.0),
            wrench[0],
            wrench[1:],
        )
        if memory is None:
            memory = cascade_init(outer, inner, gains, now, PERIOD)
        command, memory = cascade(outer, inner, gains, memory, now, PERIOD)
        wrench = judge.hold(command)
    return seen


TDE = LAWS["tde"].law
LIMITS: dict[str, Any] = {"command_rate": 30.0, "tilt_max_deg": 45.0, "lift_min": 2.0, "lift_max": 24.0}


def gains(m_bar: float, j_bar: Any) -> CascadeGains:
    return CascadeGains(TdeGains(m_bar, 10.0, 5.0), TdeGains(j_bar, 10.0, 5.0), **LIMITS)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_attitude_errors_decay_as_the_gains_say(axis):
    """e.. + K1 e. + K2 e = 0, exactly, about one axis: known inertia, constant disturbance, no lag."""
    unit = np.eye(3)[axis]
    judge = Judge(lag=0.0, torque=constant(0.02 * unit))
    judge.place((0.0, 0.0, 1.0), rot=Rotation.from_rotvec(0.3 * unit).as_matrix(), rates=0.5 * unit)
    seen = loop(judge, hover_law((0.0, 0.0, 14.0)), gains(1.0, q450.INERTIA), 200, "attitude", (0, 0, 1))
    e = np.array([sample.signals.q_ref - sample.signals.q for sample in seen])
    ed = np.array([sample.signals.qd_ref - sample.signals.qd for sample in seen])
    assert np.abs(e[:, axis]).max() > 0.05
    change = np.diff(ed, axis=0) / PERIOD
    # the first sample has no estimate yet; afterwards the law knows the disturbance
    np.testing.assert_allclose(change[2:], (-5.0 * ed - 10.0 * e)[2:-1], atol=1e-9)
    np.testing.assert_allclose(e[-1], 0.0, atol=2e-3)
    np.testing.assert_allclose(np.delete(e, axis, axis=1), 0.0, atol=1e-9)


@pytest.mark.parametrize("ratio", [0.7, 1.2])
def test_time_delay_errors_contract_by_the_ratio_of_inertias(ratio):
    """sigma_k+1 = (1 - J_bar / J) (sigma_k + u_k - u_k-1) about one axis."""
    judge = Judge(lag=0.0, torque=constant((0.02, 0.0, 0.0)))
    judge.place((0.0, 0.0, 1.0), rot=Rotation.from_rotvec((0.3, 0.0, 0.0)).as_matrix())
    j_bar = tuple((ratio * INERTIA).tolist())
    seen = loop(judge, hover_law((0.0, 0.0, 14.0)), gains(1.0, j_bar), 100, "attitude", (0, 0, 1))
    sigma = np.array([sample.memory.sigma[0] for sample in seen])
    u = np.array([sample.memory.u[0] for sample in seen])
    expected = (1 - ratio) * (sigma[1:-1] + u[1:-1] - u[:-2])
    np.testing.assert_allclose(sigma[3:], expected[1:], atol=1e-9)
    assert np.abs(sigma).max() > 0.1


def test_height_errors_decay_as_the_gains_say():
    judge = Judge(lag=0.0, force=constant((0.0, 0.0, -1.5)))
    judge.place((0.0, 0.0, 1.0))
    seen = loop(judge, TDE, gains(q450.MASS, q450.INERTIA), 200, "position", (0.0, 0.0, 1.1))
    e = np.array([sample.signals.q_ref - sample.signals.q for sample in seen])
    ed = np.array([sample.signals.qd_ref - sample.signals.qd for sample in seen])
    np.testing.assert_allclose((np.diff(ed, axis=0) / PERIOD)[2:], (-5.0 * ed - 10.0 * e)[2:-1], atol=1e-9)
    assert abs(e[-1, 2]) < 1e-3 < abs(e[0, 2])


def test_mean_force_follows_the_turning_thrust():
    """1/2 (R_k-1 + R_k) e3 u1 is the mean force up to the square of the angle turned; R_k e3 u1 up to the angle."""
    judge = Judge(lag=0.0)
    judge.place((0.0, 0.0, 1.0), rates=(3.0, -2.0, 1.0))
    wrench = np.array([20.0, 0.05, 0.03, -0.01])
    worst = {"trapezoid": 0.0, "end": 0.0}
    for _ in range(20):
        before, velocity = judge.rot[:, 2].copy(), judge.velocity.copy()
        mean = judge.hold(wrench)
        truth = judge.mass * ((judge.velocity - velocity) / PERIOD - GRAVITY)
        for name, axis in (("trapezoid", 0.5 * (before + judge.rot[:, 2])), ("end", judge.rot[:, 2])):
            worst[name] = max(worst[name], float(np.abs(mean[0] * axis - truth).max()))
    assert worst["trapezoid"] < 0.01 < 0.3 < worst["end"]


# -------------------------------------------------------------------------------------------------------- whole flights

NAMES = ["tde", "atde", "artde", "artde-robust", "tde+c", "tde+kd", "pid", "asmc", "geometric", "indi"]


@pytest.fixture(scope="module")
def env():
    with gym.make("QuadInfinity-Payload-v0") as env:
        yield env


def loaded() -> Judge:
    """The vehicle with 0.35 kg in its gripper, in a steady wind."""
    payload, place = 0.35, np.array(q450.PAYLOAD_PLACE)
    mass = q450.MASS + payload
    com = payload / mass * place

    def moved(m: float, d: np.ndarray) -> np.ndarray:  # Steiner
        return m * (d @ d * np.eye(3) - np.outer(d, d))

    inertia = np.diag(INERTIA) + moved(q450.MASS, com) + moved(payload, place - com)
    judge = Judge(mass, inertia, tuple(com), drag=q450.DRAG, force=constant((0.3, -0.4, 0.1)))
    judge.place((0.0, 0.0, 0.6))
    return judge


@pytest.mark.parametrize("name", NAMES)
def test_every_controller_carries_the_payload(env, name):
    flown = fly(loaded(), controllers.make(name, env), eight, 6.0)
    assert flown.crashed is None
    assert np.sqrt(np.mean(np.sum(flown.error**2, axis=1))) < 0.12
    assert np.abs(flown.inside["attitude_error"]).max() < 0.1
