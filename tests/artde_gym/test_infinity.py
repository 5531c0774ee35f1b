"""The infinity path: shape and times of the thesis, and derivatives that are derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from artde_gym.errors import OptionError
from artde_gym.robots.q450.infinity import LOOPS, RAMP, START, infinity_path

pytestmark = pytest.mark.once

PERIOD = 0.002


@pytest.mark.parametrize(
    ("of", "derivative", "tolerance"),
    [("position", "velocity", 1e-8), ("velocity", "acceleration", 1e-8), ("acceleration", "jerk", 1e-4)],
)
def test_each_is_the_derivative_of_the_one_before(of: str, derivative: str, tolerance: float) -> None:
    path = infinity_path(72.0, PERIOD)
    time = PERIOD * np.arange(len(path.yaw))
    spline = CubicSpline(time, getattr(path, of))
    inside = slice(10, -10)  # a spline guesses its end conditions
    np.testing.assert_allclose(spline(time, 1)[inside], getattr(path, derivative)[inside], rtol=0, atol=tolerance)


def test_velocity_adds_up_to_the_way_flown() -> None:
    path = infinity_path(70.0, PERIOD)
    way = np.cumsum(PERIOD / 2 * (path.velocity[1:] + path.velocity[:-1]), axis=0)
    np.testing.assert_allclose(START + way, path.position[1:], rtol=0, atol=1e-7)


def test_shape_of_both_loops() -> None:
    path = infinity_path(70.0, PERIOD)
    x, y, z = (path.position - START).T
    np.testing.assert_allclose(y**2, x**2 * (1 - (x / 1.2) ** 2), rtol=0, atol=1e-12)  # 0.6 sin 2a = 1.2 sin a cos a
    np.testing.assert_allclose(z, x / 6, rtol=0, atol=1e-12)
    for start, end in LOOPS:
        loop = path.position[round(start / PERIOD) : round(end / PERIOD) + 1] - START
        np.testing.assert_allclose(loop.min(axis=0), [-1.2, -0.6, -0.2], rtol=0, atol=1e-5)
        np.testing.assert_allclose(loop.max(axis=0), [1.2, 0.6, 0.2], rtol=0, atol=1e-5)
        side = np.sign(loop[np.abs(loop[:, 0]) > 1e-6, 0])
        assert np.flatnonzero(np.diff(side)).size == 1  # one lobe, then the other
        assert side[0] == 1


def test_rests_before_between_and_after_the_loops() -> None:
    path = infinity_path(75.0, PERIOD)
    time = PERIOD * np.arange(len(path.yaw))
    rest = (time == 0.0) | ((time >= 33.0) & (time <= 37.0)) | (time >= 70.0)
    np.testing.assert_allclose(path.position[rest], np.broadcast_to(START, (rest.sum(), 3)), rtol=0, atol=1e-12)
    for values in (path.velocity, path.acceleration, path.jerk):
        assert np.abs(values[rest]).max() < 1e-12
    speed = np.linalg.norm(path.velocity, axis=1)
    assert speed[~rest].min() > 0
    cruise = (time > RAMP) & (time < 33.0 - RAMP)
    crossing = np.abs(path.velocity[cruise, 0]).max() / 1.2  # half-way, where the angle is pi
    assert crossing == pytest.approx(2 * np.pi / (33.0 - RAMP), rel=1e-6)


def test_jerk_has_no_jumps() -> None:
    path = infinity_path(70.0, PERIOD)
    assert np.abs(np.diff(path.jerk, axis=0)).max() < 0.4 * PERIOD / 0.002


def test_sampling_and_duration_do_not_change_the_path() -> None:
    fine, coarse, short = infinity_path(70.0, 0.005), infinity_path(70.0, 0.015), infinity_path(10.0, 0.005)
    np.testing.assert_allclose(fine.position[::3], coarse.position, rtol=0, atol=1e-14)
    assert np.array_equal(fine.jerk[: len(short.jerk)], short.jerk)
    assert len(short.yaw) == 2001


def test_paths_are_shared_and_read_only() -> None:
    path = infinity_path(70.0, 0.015)
    assert infinity_path(70.0, 0.015) is path
    with pytest.raises(ValueError, match="read-only"):
        path.position[0] = 1.0


@pytest.mark.parametrize(
    ("duration", "period", "field"),
    [(0.0, 0.015, "duration"), (float("nan"), 0.015, "duration"), (70.0, 0.0, "period"), (70.0, 1.0, "period")],
)
def test_bad_arguments(duration: float, period: float, field: str) -> None:
    with pytest.raises(OptionError, match=field):
        infinity_path(duration, period)
