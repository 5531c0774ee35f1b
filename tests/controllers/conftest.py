"""A quadrotor of our own, written from Newton's and Euler's equations, as the independent judge of its controllers."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from artde_gym.envs.quadrotor_task import ACTION, OBSERVATION
from artde_gym.robots import q450

GRAVITY = np.array([0.0, 0.0, -9.81])
PERIOD = 0.015


@dataclasses.dataclass
class Flown:
    """Observations (samples, n_obs), wrench commands and diagnostics of a flight; `crashed` is when, or None."""

    observations: np.ndarray
    actions: np.ndarray
    inside: dict[str, np.ndarray]
    crashed: float | None

    def __getitem__(self, field: str) -> np.ndarray:
        return self.observations[:, OBSERVATION[field]]

    @property
    def error(self) -> np.ndarray:
        return self["position_ref"] - self["position"]


class Judge:
    """One rigid quadrotor, integrated by Runge and Kutta in short steps.

    Args:
        mass, inertia, com: of the whole body, about its centre of mass, which lies at `com` in the body frame.
        lag: of the rotors (s); 0 for none.
        drag: N s/m.
        force: of the world on the centre of mass (N), a function of time.
        torque: likewise (Nm, body axes).
        exact: as if any force in any direction acted at once, with neither rotors nor limits: the command is then
            [u1, ...] with the thrust along the *commanded* direction.
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
        self.rotors = np.full(4, mass * 9.81 / 4)
        # hover: the thrust's line through the centre of mass
        lever = np.cross(-self.com, [0.0, 0.0, mass * 9.81])
        self.rotors = q450.ALLOCATION @ np.array([mass * 9.81, *(-lever)])
        self.position, self.velocity = np.zeros(3), np.zeros(3)  # of the centre of mass
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


Reference = Callable[[float], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, float]]


def observe(judge: Judge, reference: tuple[Any, ...], wrench: np.ndarray, phase: float = 0.0) -> np.ndarray:
    """The observation of a judge's state."""
    position, velocity = judge.origin
    parts = (position, velocity, judge.rot.ravel(), judge.rates, *reference[:4], reference[4:], wrench, judge.rotors)
    return np.concatenate([*parts, [phase]])


def fly(judge: Judge, policy: Any, reference: Reference, duration: float, on_step: Any = None) -> Flown:
    """Fly a policy from where the judge is until the end or a crash (upside down, below the ground, 10 m away)."""
    wrench, state = q450.MIXER @ judge.rotors, None
    observations, actions, inside, crashed = [], [], [], None
    for k in range(round(duration / PERIOD)):
        observations.append(observe(judge, reference(k * PERIOD), wrench))
        action, state = policy.predict(observations[-1], state)
        actions.append(action)
        inside.append(policy.diagnostics(state))
        if on_step is not None:
            on_step(judge, k)
        wrench = judge.hold(action)
        position, _ = judge.origin
        if judge.rot[2, 2] < 0 or position[2] < 0 or not np.abs(position).max() < 10:
            crashed = (k + 1) * PERIOD
            break
    observations.append(observe(judge, reference(len(actions) * PERIOD), wrench))
    named = {name: np.array([sample[name] for sample in inside]) for name in inside[0]}
    return Flown(np.array(observations), np.array(actions), named, crashed)


def eight(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float, float]:
    """A figure of eight that starts from rest at (0, 0, 0.6): x = 1.2 sin th, y = 0.6 sin 2 th, z = 0.6 + 0.2 sin th.

    th = rate (t - T tanh(t / T)), T = 2 s, and its derivatives.
    """
    rate, ramp = 0.22, 2.0
    h = math.tanh(time / ramp)
    g = 1 - h * h
    angle = rate * (time - ramp * h)
    first, second = rate * (1 - g), rate * 2 * h * g / ramp
    third = rate * 2 * (g * g - 2 * h * h * g) / ramp**2
    rows = []
    for size, frequency, offset in ((1.2, 1, 0.0), (0.6, 2, 0.0), (0.2, 1, 0.6)):
        sin, cos = math.sin(frequency * angle), math.cos(frequency * angle)
        a, b, c = frequency * first, frequency * second, frequency * third
        rows.append(
            (
                offset + size * sin,
                size * cos * a,
                size * (cos * b - sin * a * a),
                size * (cos * (c - a**3) - 3 * sin * a * b),
            )
        )
    position, velocity, acceleration, jerk = np.array(rows).T
    return position, velocity, acceleration, jerk, 0.0, 0.0


class Stub:
    """What a policy reads from an environment."""

    robot_name = "q450"
    observation_layout = OBSERVATION
    action_layout = ACTION
    control_period = PERIOD
    nominal_robot = q450.q450()

    @property
    def unwrapped(self) -> Any:
        return self
