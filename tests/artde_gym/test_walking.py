"""The walking pattern: physics by Pinocchio, kinematics by finite differences, geometry by the footholds."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from artde_gym.errors import OptionError
from artde_gym.multibody.dynamics import GRAVITY, RigidBodyTree
from artde_gym.robots.ojas.model import ANKLE_HEIGHT, FOOT_CENTER_AHEAD, FOOT_SIZE, HIP_OFFSET, ojas
from artde_gym.robots.ojas.walking import STAND, WalkingPattern, hip_height_above_ankle, walking_pattern

pytestmark = pytest.mark.once

PERIOD, DURATION, STEPS = 0.001, 58.0, 54
SPEEDS = (0.1, 0.2)
MIRROR = np.array([-1, -1, 1, 1, 1, -1])  # of q1..q6: yaw and roll change their sign


@pytest.fixture(params=SPEEDS, ids="{} m/s".format)
def speed(request: pytest.FixtureRequest) -> float:
    return request.param


@pytest.fixture
def walk(speed: float) -> WalkingPattern:
    return walking_pattern(speed, 1.0, DURATION, PERIOD)


def row(time: float) -> int:
    return round(time / PERIOD)


def central(values: np.ndarray, order: int) -> np.ndarray:
    """First or second derivative of `values` by time at the inner samples."""
    if order == 1:
        return (values[2:] - values[:-2]) / (2 * PERIOD)
    return (values[2:] - 2 * values[1:-1] + values[:-2]) / PERIOD**2


# -------------------------------------------------------------------------------------------------------------- physics


def corners(ankle: np.ndarray) -> np.ndarray:
    length, width, _ = FOOT_SIZE
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    return ankle[:2] + [FOOT_CENTER_AHEAD, 0.0] + 0.5 * signs * [length, width]


def test_the_foot_is_that_of_the_robot():
    (box,) = ojas().by_name["left_ankle_roll"].collisions
    assert box.size == (0.20, 0.11, 0.02)
    assert box.center == (0.02, 0.0, pytest.approx(0.01 - ANKLE_HEIGHT))


def test_zero_moment_point_keeps_three_centimetres_inside_the_support_polygon(walk, judge):
    """The ZMP of the whole robot, by Pinocchio's inverse dynamics, against the hull of the feet that carry load."""
    other = judge(ojas("none"))
    velocity, acceleration = central(walk.base, 1), central(walk.base, 2)
    margins, errors = [], []
    for k in range(1, len(walk.q) - 1, 11):
        motion = [np.concatenate([values[k - 1], np.zeros(3)]) for values in (velocity, acceleration)]
        force, moment = other.inverse_dynamics(walk.q[k], walk.qd[k], walk.qdd[k], *motion)[:6].reshape(2, 3)
        moment = moment + np.cross(walk.base[k], force)  # about the world's origin, on the ground
        zmp = np.array([-moment[1], moment[0]]) / force[2]
        carrying = [walk.feet[k, foot] for foot, load in enumerate((walk.load_left[k], 1 - walk.load_left[k])) if load]
        hull = ConvexHull(np.concatenate([corners(ankle) for ankle in carrying]))
        margins.append(-(hull.equations[:, :2] @ zmp + hull.equations[:, 2]).max())
        errors.append(zmp - walk.zmp[k])
        assert 0.8 < force[2] / (8.986 * GRAVITY) < 1.2
    assert min(margins) > 0.03
    assert np.abs(errors).max() < 0.001  # the multibody correction has converged


def test_base_keeps_its_height_and_begins_and_ends_over_the_feet(walk, speed):
    np.testing.assert_allclose(walk.base[:, 2], ANKLE_HEIGHT + hip_height_above_ankle(speed), rtol=1e-12)
    tree = RigidBodyTree(ojas("none"))
    for k in (0, -1):
        center = walk.base[k] + tree.center_of_mass(walk.q[k])
        middle = walk.feet[k].mean(axis=0) + np.array([FOOT_CENTER_AHEAD, 0.0, 0.0])
        np.testing.assert_allclose(center[:2], middle[:2], atol=1e-5)


# ----------------------------------------------------------------------------------------------------------- kinematics


def test_knee_is_bent_and_never_too_far(walk):
    knee = np.degrees(walk.q[:, [3, 9]])
    assert knee.min() > 20
    assert knee.max() < 80


def test_velocity_and_acceleration_are_the_derivatives(walk):
    # the error of a central difference is h^2 / 6 or h^2 / 12 times the next two derivatives: at most 4e5 rad/s^4 here
    np.testing.assert_allclose(walk.qd[1:-1], central(walk.q, 1), rtol=0, atol=5e-4)
    np.testing.assert_allclose(walk.qdd[1:-1], central(walk.qd, 1), rtol=0, atol=0.1)
    np.testing.assert_allclose(walk.qdd[1:-1], central(walk.q, 2), rtol=0, atol=0.05)
    # and it falls with the square of the step
    errors = [
        np.abs((walk.q[2 * n :] - walk.q[: -2 * n]) / (2 * n * PERIOD) - walk.qd[n:-n])[10000:20000].max()
        for n in (1, 2)
    ]
    np.testing.assert_allclose(errors[1] / errors[0], 4.0, rtol=0.1)


def test_forward_kinematics_gives_back_the_feet(walk, judge):
    tree, other = RigidBodyTree(ojas("none")), judge(ojas("none"))
    for side, foot in enumerate(("left_ankle_roll", "right_ankle_roll")):
        ankle, rot = walk.base + tree.position(foot, walk.q), tree.rotation(foot, walk.q)
        np.testing.assert_allclose(ankle[::5], walk.feet[::5, side], atol=1e-12)  # knots of the spline
        np.testing.assert_allclose(ankle, walk.feet[:, side], atol=5e-8)  # and between them
        np.testing.assert_allclose(rot, np.broadcast_to(np.eye(3), rot.shape), atol=1e-12)  # soles stay level
        for k in range(0, len(walk.q), 997):
            position, orientation = other.placement(foot, walk.q[k])
            np.testing.assert_allclose(walk.base[k] + position, walk.feet[k, side], atol=5e-8)
            np.testing.assert_allclose(orientation, np.eye(3), atol=1e-12)


def test_feet_stand_still_while_they_carry_and_swing_four_centimetres_high(walk):
    for side, load in enumerate((walk.load_left, 1 - walk.load_left)):
        foot, velocity = walk.feet[:, side], central(walk.feet[:, side], 1)
        carries = load > 0
        assert np.all(foot[carries, 2] == ANKLE_HEIGHT)
        # a sample beside one that does not carry may have it in its difference
        inner = carries[:-2] & carries[1:-1] & carries[2:]
        assert np.all(velocity[inner] == 0)
        assert foot[:, 2].min() == ANKLE_HEIGHT
        np.testing.assert_allclose(foot[:, 2].max() - ANKLE_HEIGHT, 0.04, atol=1e-9)
        np.testing.assert_array_equal(foot[:, 1], (HIP_OFFSET, -HIP_OFFSET)[side])
        assert np.all(velocity[:, 0] >= 0)
        assert (~carries).any()
    assert np.all((walk.load_left >= 0) & (walk.load_left <= 1))


def test_footholds(walk, speed):
    length = speed * 1.0
    for step in range(STEPS + 1):
        left, right = walk.feet[row(STAND + step), :, 0]
        # the right foot swings first and lands one step ahead, then each lands one step ahead of the other
        expected_right = 0.0 if step == 0 else length * (step if step % 2 else step - 1)
        expected_left = 0.0 if step == 0 else length * (step - 1 if step % 2 else step)
        if step == STEPS:  # the last step closes up
            expected_left = expected_right = length * (STEPS - 1)
        np.testing.assert_allclose([left, right], [expected_left, expected_right], atol=1e-9)
    np.testing.assert_allclose(walk.feet[-1, :, 0], length * (STEPS - 1), atol=1e-9)


def test_starts_and_ends_at_rest(walk):
    for k in (0, -1):
        np.testing.assert_allclose(walk.qd[k], 0.0, atol=1e-8)
        np.testing.assert_allclose(walk.qdd[k], 0.0, atol=1e-5)
        np.testing.assert_allclose(walk.q[k, :6], MIRROR * walk.q[k, 6:], atol=1e-9)
        np.testing.assert_allclose(walk.base[k, 1], 0.0, atol=1e-9)
        assert walk.load_left[k] == 0.5
        assert walk.phase[k] == 0.0
    np.testing.assert_allclose(walk.q[0], walk.q[-1], atol=1e-8)
    # the preparation is calm
    assert np.abs(walk.qd[: row(1.0)]).max() < 0.02


def test_steady_walking_repeats_mirrored_after_one_step(walk, speed):
    steady = slice(row(STAND + 15), row(STAND + 35))
    later = slice(steady.start + row(1.0), steady.stop + row(1.0))
    for values in (walk.q, walk.qd, walk.qdd):
        np.testing.assert_allclose(values[later, 6:], MIRROR * values[steady, :6], atol=1e-8)
        np.testing.assert_allclose(values[later, :6], MIRROR * values[steady, 6:], atol=1e-8)
    np.testing.assert_allclose(walk.base[later] - walk.base[steady] * [1, -1, 1], [[speed, 0, 0]] * 20000, atol=1e-9)
    np.testing.assert_allclose(walk.load_left[later], 1 - walk.load_left[steady], atol=1e-12)
    np.testing.assert_allclose((walk.phase[later] - walk.phase[steady]) % 1, 0.5, atol=1e-12)


# ------------------------------------------------------------------------------------------------------------ interface


def test_shapes_and_time(walk):
    samples = round(DURATION / PERIOD) + 1
    assert walk.duration == pytest.approx(DURATION)
    shapes = {"q": (12,), "qd": (12,), "qdd": (12,), "base": (3,), "feet": (2, 3), "zmp": (2,)}
    for name, shape in {**shapes, "load_left": (), "phase": ()}.items():
        values = getattr(walk, name)
        assert values.shape == (samples, *shape)
        assert np.isfinite(values).all()


def test_cached_and_read_only(walk, speed):
    assert walking_pattern(speed, 1.0, DURATION, PERIOD) is walk
    for field in dataclasses.fields(walk):
        values = getattr(walk, field.name)
        if isinstance(values, np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                values[0] = 0.0


def test_arguments_by_name_and_by_position_share_one_pattern():
    walk = walking_pattern(0.1, 1.0, 0.1, 0.001)
    assert walking_pattern(duration=0.1) is walk
    assert walking_pattern(speed=0.1, step_duration=1, duration=0.1, period=0.001) is walk


@pytest.mark.parametrize(("duration", "steps"), [(0.1, 0), (0.1234, 0), (4.5, 0), (5.0, 1), (6.0, 2), (6.9, 2)])
@pytest.mark.parametrize("period", [0.001, 0.004])
def test_short_walks(duration, steps, period):
    walk = walking_pattern(0.1, 1.0, duration, period)
    assert len(walk.q) == math.floor(duration / period + 1e-9) + 1
    np.testing.assert_allclose(walk.feet[-1, :, 0], 0.1 * max(0, steps - 1), atol=1e-9)
    assert (np.abs(walk.feet[..., 2] - ANKLE_HEIGHT).max() > 0.03) == (steps > 0)
    assert np.isfinite(walk.qdd).all()
    tree = RigidBodyTree(ojas("none"))
    for side, foot in enumerate(("left_ankle_roll", "right_ankle_roll")):
        np.testing.assert_allclose(walk.base + tree.position(foot, walk.q), walk.feet[:, side], atol=5e-8)


def test_coarse_sampling_is_every_nth_fine_sample():
    fine, coarse = walking_pattern(0.1, 1.0, 6.0, 0.001), walking_pattern(0.1, 1.0, 6.0, 0.004)
    for name in ("q", "qd", "qdd", "base", "feet", "zmp", "load_left", "phase"):
        np.testing.assert_allclose(getattr(coarse, name), getattr(fine, name)[::4], atol=1e-9)


def test_standing_still():
    walk = walking_pattern(0.0, 1.0, 4.5, 0.001)
    np.testing.assert_allclose(walk.q, np.broadcast_to(walk.q[0], walk.q.shape), atol=1e-9)


@pytest.mark.parametrize("step_duration", [0.6, 1.0, 1.3, 2.0])
@pytest.mark.parametrize("length", [0.0, 0.1, 0.25])
def test_the_whole_allowed_range_works(length, step_duration):
    speed = min(length / step_duration, 0.25)
    walk = walking_pattern(speed, step_duration, 2 * STAND + 6 * step_duration, 0.005)
    knee = np.degrees(walk.q[:, [3, 9]])
    assert 15 < knee.min() < knee.max() < 110
    np.testing.assert_allclose(walk.base[:, 2], ANKLE_HEIGHT + hip_height_above_ankle(speed, step_duration), rtol=1e-12)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"speed": -0.01}, "speed is -0.01"),
        ({"speed": 0.26}, "speed is 0.26"),
        ({"speed": math.nan}, "speed is nan"),
        ({"step_duration": 0.5}, "step_duration is 0.5"),
        ({"step_duration": math.inf}, "step_duration is inf"),
        ({"speed": 0.2, "step_duration": 1.5}, r"speed \* step_duration is 0.3"),
        ({"duration": 0.09}, "duration is 0.09"),
        ({"duration": math.nan}, "duration is nan"),
        ({"duration": math.inf}, "duration is inf"),
        ({"period": 0.0}, "period is 0.0"),
        ({"period": -0.001}, "period is -0.001"),
        ({"period": math.nan}, "period is nan"),
    ],
)
def test_errors_name_the_field(changes, words):
    with pytest.raises(OptionError, match=words):
        walking_pattern(**changes)
