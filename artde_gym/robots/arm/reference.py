"""References of joints as data: way-points with minimum jerk, sums of sines, and a figure-eight of the tool.

    {"times": [0, 2, 3, 5], "points": [[...], ...]}  at rest in each point (rad or m), minimum jerk between them
    {"amplitude": 0.3, "frequency": 0.2}             two sines about the home pose, one value or one for each joint
    {"size": [0.15, 0.08], "period": 4}              a figure-eight of the tool (m, s) about the home pose, or {"pose"}

Source of the minimum jerk: Flash and Hogan, Journal of Neuroscience 5 (1985) 1688-1703, s(x) = 10 x^3 - 15 x^4 + 6 x^5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from artde_gym.arguments import check_number
from artde_gym.arrays import Array
from artde_gym.errors import OptionError
from artde_gym.multibody.spec import Link, RobotSpec
from artde_gym.robots.arm.figure_eight import figure_eight
from artde_gym.robots.arm.panda import HOME, panda

PICK, MULTI_SINE, FIGURE_EIGHT = "pick-and-place", "multi-sine", "figure-eight"
KINDS = (PICK, MULTI_SINE, FIGURE_EIGHT)
EIGHT: dict[str, Any] = {"size": [0.15, 0.08], "period": 4.0}
TIMES = (0.0, 3.5, 4.5, 7.5, 8.5, 11.5)
"""Of the way-points of pick and place: home, at the load twice, at its place twice, home (s)."""
GRASP, RELEASE = 4.0, 8.0  # s
RISE = 2.0  # s, in which sines grow from rest
SECOND = 1.7  # ratio of the frequencies of two sines
MARGIN = 0.05  # share of a joint's range that a reference keeps from either end
BRISK = 0.5  # share of a joint's largest speed that pick and place uses
REACH, STROKE = 0.6, 0.2  # largest offset of a joint from home in pick and place (rad, m)
PEAK = 1.875  # largest speed of minimum jerk over the mean

_TO_PICK = (1.0, 0.8, -0.5, 0.6, 0.5, -0.6, 0.7)
_TO_PLACE = (-1.0, 0.7, 0.5, 0.8, -0.5, -0.4, -0.7)
_ALLOWED = f'{", ".join(map(repr, KINDS))}, {{"times", "points"}}, {{"amplitude", "frequency"}}, {{"size", "period"}}'


class Reference(NamedTuple):
    """Positions, velocities and accelerations of the joints (samples, n)."""

    q: Array
    qd: Array
    qdd: Array


def home(spec: RobotSpec) -> Array:
    """Return the pose in the middle of the limits (n,); of the Panda one with a bent elbow."""
    if spec == panda():  # another arm's joints may have the same names
        return np.array(HOME)
    return np.array([(low + high) / 2 if np.isfinite(low + high) else 0.0 for low, high in _limits(spec)])


def reference(spec: RobotSpec, given: Any, time: Array) -> Reference:
    """Return the reference of an arm at times (samples,) (s).

    Raises:
        OptionError: for anything but the kinds at the top, a reference beyond the joints' limits of position or speed,
            or sines that the samples cannot show.
    """
    if isinstance(given, Mapping) and given.keys() == {"times", "points"}:
        found = _way_points(spec, given["times"], given["points"], time)
    elif isinstance(given, Mapping) and given.keys() == {"amplitude", "frequency"}:
        found = _sines(spec, given["amplitude"], given["frequency"], time)
    elif isinstance(given, Mapping) and {"size", "period"} <= given.keys() <= {"size", "period", "pose"}:
        found = _eight(spec, time, **given)
    elif given == FIGURE_EIGHT:
        found = _eight(spec, time, **EIGHT)
    elif given == PICK:
        found = _way_points(spec, TIMES, _pick_and_place(spec), time)
    elif given == MULTI_SINE:
        found = _sines(spec, 0.5 * np.minimum(_offsets(spec, 1.0), 0.6), _slow(spec), time)
    else:
        raise OptionError("reference", given, _ALLOWED)
    for name, q, qd in zip(spec.actuated, found.q.T, found.qd.T, strict=True):
        _check_joint(spec.by_name[name], q, float(np.abs(qd).max()))
    return found


def _check_joint(link: Link, q: Array, fastest: float) -> None:
    """Refuse a reference that leaves a joint's limits of position or speed (from its spec, infinite without any)."""
    low, high = link.limits
    if not (low < q.min() and q.max() < high):
        field = f"reference of {link.name}"
        raise OptionError(field, (float(q.min()), float(q.max())), f"above {low:g}, below {high:g}")
    if not fastest <= link.speed:
        unit = "m/s" if link.prismatic else "rad/s"
        raise OptionError(f"speed of the reference of {link.name}", fastest, f"at most {link.speed:g} {unit}")


def _limits(spec: RobotSpec) -> list[tuple[float, float]]:
    return [spec.by_name[name].limits for name in spec.actuated]


def _offsets(spec: RobotSpec, span: float) -> Array:
    """Return how far each joint may move from home in `span` seconds with minimum jerk, to either side (n,)."""
    links = [spec.by_name[name] for name in spec.actuated]
    at = home(spec)
    room = [
        min(q - low, high - q) - MARGIN * min(high - low, 2 * np.pi)
        for q, (low, high) in zip(at, _limits(spec), strict=True)
    ]
    fast = [BRISK * link.speed * span / PEAK for link in links]
    reach = [STROKE if link.prismatic else REACH for link in links]
    return np.maximum(np.min([room, fast, reach], axis=0), 0.0)


def _pick_and_place(spec: RobotSpec) -> Array:
    start, size = home(spec), _offsets(spec, (TIMES[3] - TIMES[2]) / 2)
    pick, place = (start + size * np.resize(signs, len(start)) for signs in (_TO_PICK, _TO_PLACE))
    return np.array([start, pick, pick, place, place, start])


def _slow(spec: RobotSpec) -> Array:
    """Return frequencies of sines (n,) (Hz), none a multiple of another."""
    return 0.11 + 0.013 * np.arange(len(spec.actuated))


def _way_points(spec: RobotSpec, times: Any, points: Any, time: Array) -> Reference:
    knots, poses = _array("times", times), _array("points", points)
    if knots.ndim != 1 or len(knots) < 2 or knots[0] != 0 or not (np.diff(knots) > 0).all():
        raise OptionError("times of the reference", times, "at least two, from 0 on, each later than the one before")
    if poses.shape != (len(knots), len(spec.actuated)):
        raise OptionError("points of the reference", poses.shape, f"{len(knots)} of {len(spec.actuated)} numbers")
    part = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(knots) - 2)
    span = np.diff(knots)[part]
    x, step = np.clip((time - knots[part]) / span, 0.0, 1.0)[:, None], np.diff(poses, axis=0)[part]
    span = span[:, None]
    q = poses[part] + step * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    qd = step / span * 30.0 * x**2 * (1.0 - x) ** 2
    qdd = step / span**2 * 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
    return Reference(q, qd, qdd)


def _sines(spec: RobotSpec, amplitude: Any, frequency: Any, time: Array) -> Reference:
    """Return home + A r(t) (sin(w t) + sin(1.7 w t) / 2) / 1.5, where r rises from rest with minimum jerk."""
    size, rate = (_each(spec, name, value) for name, value in (("amplitude", amplitude), ("frequency", frequency)))
    most = 0.5 / float(time[1] - time[0]) / SECOND if len(time) > 1 else np.inf
    if not (rate < most).all():
        raise OptionError("frequency of the reference", frequency, f"below {most:g} Hz, which the samples can show")
    x = np.clip(time / RISE, 0.0, 1.0)[:, None]
    rise = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    rise_1 = 30.0 * x**2 * (1.0 - x) ** 2 / RISE
    rise_2 = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / RISE**2
    wave, wave_1, wave_2 = np.zeros((3, len(time), len(size)))
    for share, ratio in ((2 / 3, 1.0), (1 / 3, SECOND)):
        omega = 2 * np.pi * ratio * rate
        sine, cosine = np.sin(omega * time[:, None]), np.cos(omega * time[:, None])
        wave, wave_1, wave_2 = wave + share * sine, wave_1 + share * omega * cosine, wave_2 - share * omega**2 * sine
    q = home(spec) + size * rise * wave
    qd = size * (rise_1 * wave + rise * wave_1)
    return Reference(q, qd, size * (rise_2 * wave + 2 * rise_1 * wave_1 + rise * wave_2))


def _eight(spec: RobotSpec, time: Array, size: Any, period: Any, pose: Any = None) -> Reference:
    axes, center = _array("size", size), home(spec) if pose is None else _array("pose", pose)
    if axes.shape != (2,) or (axes < 0).any():
        raise OptionError("size of the reference", size, "two numbers >= 0 (m), across and up")
    if center.shape != (len(spec.actuated),):
        raise OptionError("pose of the reference", pose, f"{len(spec.actuated)} numbers")
    seconds = check_number("period of the reference", period, 0.1, 1000.0, "0.1 to 1000 s")
    across, up = axes.tolist()
    return Reference(*figure_eight(spec, center, (across, up), seconds, RISE, time))


def _each(spec: RobotSpec, name: str, given: Any) -> Array:
    values = _array(name, given)
    n = len(spec.actuated)
    if values.shape not in ((), (n,)) or (values < 0).any():
        raise OptionError(f"{name} of the reference", given, f"a number >= 0, or {n} of them")
    return np.broadcast_to(values, n)


def _array(name: str, given: Any | Sequence[Any]) -> Array:
    try:
        values = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        values = np.full(1, np.nan)
    if not np.isfinite(values).all():
        raise OptionError(f"{name} of the reference", given, "finite numbers")
    return values
