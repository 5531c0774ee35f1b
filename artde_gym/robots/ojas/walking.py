"""Walking pattern of Ojas: stand, start, walk, stop, as joint positions, velocities and accelerations.

1. Footholds and a zero-moment-point (ZMP) reference: at the center of the stance foot, moved by a quintic during
   double support.
2. The center of mass c of the linear inverted pendulum under that reference, c - (z/g) c'' = p with c = p at both
   ends: a tridiagonal boundary value problem.
3. Multibody correction: the ZMP error of the whole robot from inverse dynamics gives, through the same boundary value
   problem, a correction of the base; a few passes.
4. Analytic inverse kinematics, then a quintic spline through the joint angles, whose derivatives are the reference
   velocity and acceleration.

Sources: Kajita et al., "Biped walking pattern generation by using preview control of zero-moment point" (ICRA 2003);
Nishiwaki et al., "Online generation of humanoid walking motion based on a fast generation method of motion pattern
that follows desired ZMP" (IROS 2002) for the boundary value form; Park 2001 for the bent knee.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.linalg import solve_banded

from artde_gym.arguments import check_number
from artde_gym.arrays import Array
from artde_gym.cache import cached
from artde_gym.errors import OptionError
from artde_gym.multibody import dynamics, spec
from artde_gym.multibody.dynamics import GRAVITY, RigidBodyTree
from artde_gym.robots.ojas import leg_ik
from artde_gym.robots.ojas import model as robot
from artde_gym.robots.ojas.leg_ik import leg_angles

STAND = 2.0  # s, before the first step and after the last one
DOUBLE_SUPPORT = 0.2  # share of a step
STEP_HEIGHT = 0.04  # m
GRID_PERIOD = 0.005  # s, of the pendulum problem and of the spline knots
CORRECTION_PASSES = 5  # of the multibody correction
BLOCK = 256  # samples of the multibody correction at once: their numbers fit into caches
STORED_SAMPLES = 1000  # of the grid; shorter walks are planned faster than a file is read
MAX_DURATION = 1800.0  # s, of a walk; it needs 0.8 MB per second, and 2 % of its duration for planning

_HIPS = np.array([[0.0, robot.HIP_OFFSET, 0.0], [0.0, -robot.HIP_OFFSET, 0.0]])


@dataclasses.dataclass(frozen=True)
class WalkingPattern:
    """A walk sampled every `period` seconds; row k is time k * period.

    Attributes:
        q, qd, qdd: leg joints, left then right, (samples, 12) (rad, rad/s, rad/s^2).
        base: position of the upright base, (samples, 3) (m).
        feet: ankle positions, left then right, (samples, 2, 3) (m).
        zmp: reference zero moment point, (samples, 2) (m).
        load_left: planned share of the weight on the left foot, (samples,).
        phase: progress within a stride of two steps, 0 to 1, (samples,); 0 while standing.
    """

    period: float
    q: Array
    qd: Array
    qdd: Array
    base: Array
    feet: Array
    zmp: Array
    load_left: Array
    phase: Array

    @property
    def duration(self) -> float:
        return (len(self.q) - 1) * self.period


def hip_height_above_ankle(speed: float, step_duration: float = 1.0) -> float:
    """Return 0.37 m at 0.1 m/s and 0.345 m at 0.2 m/s, and less for long, slow steps, in which the body sways more.

    The second bound keeps the knee bent by at least 15 degrees over the whole range of `walking_pattern`.
    """
    return min(0.395 - 0.25 * speed, 0.38 - (0.25 + 0.62 * step_duration) * (speed * step_duration) ** 2)


def check_gait(speed: float, step_duration: float) -> tuple[float, float]:
    """Return a speed (m/s) and a duration of a step (s) that can be walked.

    Raises:
        OptionError: for a speed outside 0 to 0.25 m/s, a step outside 0.6 to 2 s, or a step longer than 0.25 m.
    """
    speed = check_number("speed", speed, 0.0, 0.25, "0 to 0.25 m/s")
    step_duration = check_number("step_duration", step_duration, 0.6, 2.0, "0.6 to 2 s")
    if speed * step_duration > 0.25:
        raise OptionError("speed * step_duration", speed * step_duration, "a step of at most 0.25 m")
    return speed, step_duration


def walking_pattern(
    speed: float = 0.1, step_duration: float = 1.0, duration: float = 58.0, period: float = 0.001
) -> WalkingPattern:
    """Return a walk of `duration` (s) at `speed` (m/s) with one step every `step_duration` (s).

    The result is cached and its arrays are read-only, so that all environments of a process share it.

    Raises:
        OptionError: as `check_gait`, or for a walk outside 0.1 to 1800 s or a period outside 1e-6 to 0.1 s.
    """
    speed, step_duration = check_gait(speed, step_duration)
    duration = check_number("duration", duration, 0.1, MAX_DURATION, f"0.1 to {MAX_DURATION:g} s")
    period = check_number("period", period, 1e-6, 0.1, "1e-6 to 0.1 s")
    return _pattern(speed, step_duration, duration, period)  # positional: the cache distinguishes keyword arguments


@functools.lru_cache(maxsize=8)
def _pattern(speed: float, step_duration: float, duration: float, period: float) -> WalkingPattern:
    gait = _Gait(speed, step_duration, duration)
    time = GRID_PERIOD * np.arange(math.ceil(duration / GRID_PERIOD - 1e-9) + 1)
    hips = _base_positions(gait, time)
    fine = period * np.arange(math.floor(duration / period + 1e-9) + 1)
    spline = _spline(time, _joint_angles(hips, gait.feet(time)))
    pattern = WalkingPattern(
        period=period,
        q=spline(fine),
        qd=spline.derivative(1)(fine),
        qdd=spline.derivative(2)(fine),
        base=_spline(time, hips)(fine),
        feet=gait.feet(fine),
        zmp=gait.zmp(fine),
        load_left=gait.load_left(fine),
        phase=gait.phase(fine),
    )
    for field in dataclasses.fields(pattern):
        value = getattr(pattern, field.name)
        if isinstance(value, np.ndarray):
            value.setflags(write=False)
    return pattern


class _Gait:
    """Footholds over time; step i lasts from start + i T to start + (i + 1) T, with double support first."""

    def __init__(self, speed: float, step_duration: float, duration: float) -> None:
        self.speed = speed
        self.period = step_duration
        self.steps = max(0, math.floor((duration - 2 * STAND) / step_duration + 1e-9))
        self.length = speed * step_duration

    def foothold(self, foot: NDArray[np.int_], steps: NDArray[np.int_]) -> Array:
        """Return the ankle x of each `foot` (0 left, 1 right) after a number of steps; the right foot swings first."""
        steps = np.minimum(steps, self.steps)
        last_swing = np.where((steps - 1) % 2 == (1 - foot), steps - 1, steps - 2)  # index of this foot's last step
        landed = self.length * np.where(last_swing == self.steps - 1, last_swing, last_swing + 1)
        return np.where(last_swing >= 0, landed, 0.0)

    def feet(self, time: Array) -> Array:
        step, u = self._progress(time)
        swing = _quintic((u - DOUBLE_SUPPORT) / (1 - DOUBLE_SUPPORT))
        lift = np.clip((u - DOUBLE_SUPPORT) / (1 - DOUBLE_SUPPORT), 0.0, 1.0)
        feet = np.zeros((len(time), 2, 3))
        for foot in (0, 1):
            start, end = (self.foothold(np.array(foot), steps) for steps in (step, step + 1))
            feet[:, foot, 0] = start + (end - start) * swing
            feet[:, foot, 1] = _HIPS[foot, 1]
            swinging = (step % 2 == 1 - foot) & (step >= 0) & (step < self.steps)
            feet[:, foot, 2] = robot.ANKLE_HEIGHT
            feet[:, foot, 2] += np.where(swinging, STEP_HEIGHT * 64 * lift**3 * (1 - lift) ** 3, 0.0)
        return feet

    def load_left(self, time: Array) -> Array:
        """Return the left foot's share of the load: 0.5 while standing, 0 or 1 in single support, a quintic between."""
        step, u = self._progress(time)

        def after(steps: NDArray[np.int_]) -> Array:
            return np.where((steps < 0) | (steps >= self.steps), 0.5, np.where(steps % 2 == 0, 1.0, 0.0))

        return after(step - 1) + (after(step) - after(step - 1)) * _quintic(u / DOUBLE_SUPPORT)

    def zmp(self, time: Array) -> Array:
        """Return the ZMP between the foot centers at the planned share; the feet rest while it moves."""
        step, _ = self._progress(time)
        left, right = (self.foothold(np.array(foot), step) for foot in (0, 1))
        load = self.load_left(time)
        x = load * left + (1 - load) * right + robot.FOOT_CENTER_AHEAD
        y = (2 * load - 1) * robot.HIP_OFFSET
        return np.stack([x, y], axis=-1)

    def phase(self, time: Array) -> Array:
        step, u = self._progress(time)
        walking = (step >= 0) & (step < self.steps)
        return np.where(walking, (step % 2 + u) / 2, 0.0)

    def _progress(self, time: Array) -> tuple[NDArray[np.int_], Array]:
        """Return the step's index, clipped to one before the first and one after the last, and progress within it."""
        exact = (time - STAND) / self.period
        step = np.clip(np.floor(exact + 1e-9), -1, self.steps).astype(int)
        return step, np.clip(exact - step, 0.0, 1.0)


def _base_positions(gait: _Gait, time: Array) -> Array:
    """Return the result of `_solve`, which is stored in the user's cache if it takes long."""
    if len(time) < STORED_SAMPLES:
        return _solve(gait, time)
    constants = STAND, DOUBLE_SUPPORT, STEP_HEIGHT, GRID_PERIOD, CORRECTION_PASSES
    key = {
        "walk": (gait.speed, gait.period, len(time), gait.steps),
        "constants": constants,
        "robot": repr(robot.ojas("none")),
    }
    modules = (__file__, *(str(module.__file__) for module in (dynamics, leg_ik, robot, spec)))
    return cached("walk", key, modules, lambda: _solve(gait, time))


def _solve(gait: _Gait, time: Array) -> Array:
    """Return positions of the base (samples, 3) for which the whole robot's ZMP follows the gait's."""
    tree = RigidBodyTree(robot.ojas("none"))
    zmp, feet = gait.zmp(time), gait.feet(time)
    hips = np.zeros((len(time), 3))
    hips[:, 2] = robot.ANKLE_HEIGHT + hip_height_above_ankle(gait.speed, gait.period)
    hips[:, :2] = zmp
    com = tree.center_of_mass(_joint_angles(hips[:1], feet[:1]))[0]
    height = hips[0, 2] + com[2]
    hips[:, :2] = _pendulum(zmp, height) - com[:2]
    for _ in range(CORRECTION_PASSES):
        hips[:, :2] -= _pendulum(_multibody_zmp(tree, time, hips, feet) - zmp, height)
    return hips


def _pendulum(zmp: Array, height: float) -> Array:
    """Solve c - (z/g) c'' = p for each column, with c = p at both ends."""
    count, ratio = len(zmp), height / GRAVITY / GRID_PERIOD**2
    bands = np.zeros((3, count))
    bands[0, 2:] = bands[2, :-2] = -ratio
    bands[1] = 1 + 2 * ratio
    bands[1, [0, -1]] = 1.0
    return solve_banded((1, 1), bands, zmp)


def _multibody_zmp(tree: RigidBodyTree, time: Array, hips: Array, feet: Array) -> Array:
    """Return the point where the ground reaction has no horizontal moment, (samples, 2) (m)."""
    joints, base = _spline(time, _joint_angles(hips, feet)), _spline(time, hips)
    curves = [curve.derivative(order) for curve, order in ((joints, 0), (joints, 1), (joints, 2), (base, 1), (base, 2))]
    wrench = np.empty((len(time), 6))
    for first in range(0, len(time), BLOCK):
        block = slice(first, first + BLOCK)
        q, qd, qdd, *motion = (curve(time[block]) for curve in curves)
        twists = (np.concatenate([linear, np.zeros_like(linear)], axis=-1) for linear in motion)
        wrench[block] = tree.base_wrench(q, qd, qdd, *twists)
    force, moment = wrench[:, :3], wrench[:, 3:]  # about the base origin
    x = hips[:, 0] - (moment[:, 1] + hips[:, 2] * force[:, 0]) / force[:, 2]
    y = hips[:, 1] + (moment[:, 0] - hips[:, 2] * force[:, 1]) / force[:, 2]
    return np.stack([x, y], axis=-1)


def _joint_angles(hips: Array, feet: Array) -> Array:
    legs = [leg_angles(feet[:, foot] - hips - _HIPS[foot], robot.THIGH, robot.SHANK) for foot in (0, 1)]
    return np.concatenate(legs, axis=-1)


def _spline(time: Array, values: Array) -> BSpline:
    """Return a quintic spline through all values, at rest at both ends."""
    rest = [(1, np.zeros(values.shape[1])), (2, np.zeros(values.shape[1]))]
    return make_interp_spline(time, values, k=5, bc_type=(rest, rest))


def _quintic(u: Array) -> Array:
    """Return a quintic from 0 at u <= 0 to 1 at u >= 1 with zero first and second derivatives at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u**2)
