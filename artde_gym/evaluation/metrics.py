"""Metrics of episodes, computed block by block, so that only one block of samples has to be in memory.

`MetricsSpec` determines the columns; u is the unit of a tracked error, and the first tracked error is the main one.

Per axis: `rmse_u_<axis>`, `max_abs_error_u_<axis>`, and for each effort `rms_<effort>_<unit>_<axis>`; the same with
`_phase1_<axis>`, ... for each phase, NaN for a part that the episode did not reach. Per episode:

- `rmse_u`: root of the mean square of the main error's size, over time.
- `iae_u_s`, `itae_u_s2`: integral of the main error, and of time times it. This error is the norm if its size is the
  norm, and the mean absolute value if its size is the root mean square.
- `<effort>_variation_<unit>_s`: mean over its components of sum |f_k - f_k-1|, per second.
- `saturation`: share of samples with an actuator at its limit.
- `energy_j`: integral of the power; `cost_of_transport`: energy / (g integral of the mass over the distance), with the
  mass of the robot and what it carries at the time; NaN below 0.1 m.
- `tde_error_rms`, ...: root mean square of the time-delay estimation error (rad/s^2, m/s^2).
- `robust_gain_mean`, ...: mean of the law's robust gain c.
- `peak_error_u_<event>`: largest size of the main error from the beginning of a push, or the payload's drop, until 2 s
  after its end.
- `recovery_time_s_<event>`: time from the end of each push, or the drop, until the size of the main error stays in its
  band, or below its largest value in the 2 s before if that is more, for 1 s; infinite if it never does, including a
  fall after the event's beginning. NaN if the episode ended too early to decide: before the event, less than 1 s
  after it, or when the error had stayed there for less than 1 s.
- `rms_<watched>_<unit>`, `max_<watched>_<unit>`: of signals that an environment watches beside its errors, such as a
  swing; `peak_<watched>_<unit>_<push>` and `recovery_time_s_<push>_<watched>`: effect of a push on them, as above, but
  with their own band alone, and an infinite time also if the signal ends before it has settled.
- The metrics of `artde_gym.evaluation.registered`, by name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.disturbances.kinds import NEVER
from artde_gym.errors import OptionError
from artde_gym.evaluation.registered import METRICS, PEAK, RECOVERY, Metric
from artde_gym.layout import Layout
from artde_gym.metrics_spec import Fields, MetricsSpec, TrackedSignal, WatchedSignal

GRAVITY = 9.81  # m/s^2
BEFORE = 2.0  # s before a disturbance; the largest error in it counts as recovered too
AFTER = 2.0  # s after a disturbance in which its peak is searched
HOLD = 1.0  # s for which a recovered error must stay in its band
NEAR = 0.1  # m; shorter distances have no cost of transport
PUSH = "push"  # prefix of a push's number
END = 2**62  # sample index that no episode reaches

Span = tuple[float, float]
Mask = NDArray[np.bool_]


def events_of(disturbances: Mapping[str, Any]) -> dict[str, Span]:
    """Return name -> (begin, end) (s) of each push, and of the payload's drop if there is one."""
    events = {
        f"{PUSH}{i}": (push["start"], push["start"] + push["duration"])
        for i, push in enumerate(disturbances.get("push", ()))
    }
    payload = disturbances.get("payload", {"attach_time": 0.0, "detach_time": NEVER})
    if payload["attach_time"] < payload["detach_time"] < NEVER:
        events["drop"] = (payload["detach_time"], payload["detach_time"])
    return events


def payload_of(disturbances: Mapping[str, Any]) -> tuple[float, Span]:
    """Return the payload's mass (kg), and (begin, end) (s) of its presence."""
    payload = disturbances.get("payload", {"mass": 0.0, "attach_time": 0.0, "detach_time": 0.0})
    return payload["mass"], (payload["attach_time"], max(payload["attach_time"], payload["detach_time"]))


class Metrics:
    """Metrics of n episodes that run side by side.

    Args:
        tracking: metrics spec of the environment.
        layout: layout of its observations.
        period: control period (s).
        masses: mass of the robot alone (kg), one per episode.
        payloads: mass (kg), and (begin, end) (s) of its presence, one per episode; empty for no payloads.
        events: see `events_of`, one mapping per episode.
        phases: (begin, end) (s) of parts that are also measured separately.
    """

    def __init__(
        self,
        tracking: MetricsSpec,
        layout: Layout,
        period: float,
        masses: Sequence[float],
        events: Sequence[Mapping[str, Span]],
        phases: Sequence[Span] = (),
        payloads: Sequence[tuple[float, Span]] = (),
    ) -> None:
        self._tracking, self._period = tracking, period
        self._masses = np.array(masses, dtype=np.float64)
        loads = payloads or [(0.0, (0.0, 0.0))] * len(masses)
        self._loads = np.array([mass for mass, _ in loads])
        self._carried = np.array([[_sample(time, period) for time in span] for _, span in loads]).T
        box, part = layout.box(), layout[tracking.saturated_field]
        near = tracking.saturation_margin * (box.high - box.low)[part]
        self._limits = box.low[part] + near, box.high[part] - near
        n = len(events)
        spans = {"": (0.0, np.inf)} | {f"phase{i}_": span for i, span in enumerate(phases, start=1)}
        self._windows = {
            prefix: (_sample(begin, period), _sample(end, period)) for prefix, (begin, end) in spans.items()
        }
        self._errors = {prefix: [_Squares(n) for _ in tracking.errors] for prefix in spans}
        self._efforts = {prefix: [_Squares(n) for _ in tracking.efforts] for prefix in spans}
        self._size, self._sigmas = _Squares(n), {column: _Squares(n) for column in tracking.tde_errors}
        self._means = {column: _Mean(n) for column in tracking.diagnostic_means}
        self._variations = [_Variation(n) for _ in tracking.efforts]
        self._iae, self._itae, self._saturated, self._energy, self._distance, self._carrying = np.zeros((6, n))
        names = dict.fromkeys(name for one in events for name in one)
        never = (np.inf, np.inf)
        self._events = {
            name: _Event([one.get(name, never) for one in events], tracking.settling_band, period) for name in names
        }
        self._watched = [_Watched(watched, events, period) for watched in tracking.watched]
        self._registered = [_Registered(metric, n) for metric in METRICS.values()]
        self._count = np.zeros(n, dtype=np.int64)  # samples of each episode so far

    def add(self, start: int, fields: Fields, diagnostics: Fields | None, live: Mask | None = None) -> None:
        """Add a block of samples; the samples of an episode come once each, in order.

        Args:
            start: index of the first sample; an episode's first sample is 0.
            fields: observations by name, (samples, n, size), and recorded entries of `info` where any is watched
                (samples, n).
            diagnostics: of the policy at these samples, (samples, n, ...), or at some of them if no error depends on
                them; None after the last decision of the policy.
            live: (n,), the episodes that these samples belong to; None for all.
        """
        tracking = self._tracking
        live = None if live is None or live.all() else live
        samples = len(fields[tracking.saturated_field])
        self._count += samples if live is None else samples * live
        for number, tracked in enumerate(tracking.errors):
            error = _error(tracked, fields, diagnostics)
            if error is None:
                continue
            for prefix, (first, stop) in self._windows.items():
                self._errors[prefix][number].add(error[_part(first, stop, start)], live)
            if number == 0:
                self._add_main(error, start, live)
        for number, effort in enumerate(tracking.efforts):
            force = fields[effort.field][..., effort.part]
            for prefix, (first, stop) in self._windows.items():
                self._efforts[prefix][number].add(force[_part(max(first, 1), stop, start)], live)
            self._variations[number].add(force[_part(1, END, start)], live)
        acted = _part(1, END, start)  # the first observation reports what acted before this episode
        low, high = self._limits
        values = fields[tracking.saturated_field][acted]
        self._saturated = _added(self._saturated, np.any((values <= low) | (values >= high), axis=-1), live)
        self._energy = _added(self._energy, tracking.power(fields)[acted], live)
        if tracking.speed is not None:
            speed = tracking.speed(fields)
            self._distance = _added(self._distance, speed, live)
            self._carrying = _added(self._carrying, self._mass(start, samples) * speed, live)
        for column, name in tracking.tde_errors.items():
            if diagnostics is not None and name in diagnostics:
                self._sigmas[column].add(diagnostics[name], live)
        for column, name in tracking.diagnostic_means.items():
            if diagnostics is not None and name in diagnostics:
                self._means[column].add(diagnostics[name], live)
        for watched in self._watched:
            watched.add(fields, start, live)
        for registered in self._registered:
            registered.add(fields, diagnostics or {}, live)

    def _mass(self, start: int, samples: int) -> Array:
        """Return the mass of the robot with what it carries (kg), (samples, n)."""
        k = np.arange(start, start + samples)[:, None]
        attached, dropped = self._carried
        return self._masses + self._loads * ((attached <= k) & (k < dropped))

    def _add_main(self, error: Array, start: int, live: Mask | None) -> None:
        size = np.sqrt(np.square(error).sum(axis=-1) if self._tracking.norm else np.square(error).mean(axis=-1))
        absolute = (size if self._tracking.norm else np.abs(error).mean(axis=-1))[_part(1, END, start)]
        time = self._period * np.arange(max(start, 1), start + len(error))
        self._size.add(size[..., None], live)
        self._iae = _added(self._iae, absolute, live)
        self._itae = _added(self._itae, time[:, None] * absolute, live)
        for event in self._events.values():
            event.add(size, start, live)

    def rows(self, fell: Mask | None = None) -> list[dict[str, Any]]:
        """Return the metrics, one row per episode; `fell` (n,) marks episodes that ended in a fall, None for none."""
        fell = np.zeros(len(self._count), np.bool_) if fell is None else fell
        tracking, period = self._tracking, self._period
        main = tracking.errors[0]
        unit, scale = main.unit, main.scale
        columns: dict[str, Array] = {}
        for prefix in self._windows:
            for tracked, squares in zip(tracking.errors, self._errors[prefix], strict=True):
                for axis, i in tracked.axes.items():
                    columns[f"rmse_{tracked.unit}_{prefix}{axis}"] = tracked.scale * squares.rms[:, i]
                    columns[f"max_abs_error_{tracked.unit}_{prefix}{axis}"] = tracked.scale * squares.peak[:, i]
            for effort, squares in zip(tracking.efforts, self._efforts[prefix], strict=True):
                for axis, i in effort.axes.items():
                    columns[f"rms_{effort.name}_{effort.unit}_{prefix}{axis}"] = squares.rms[:, i]
        for name, event in self._events.items():
            columns[f"{RECOVERY}{name}"] = event.recovery_time(self._count, fell)
            columns[f"{PEAK}{unit}_{name}"] = scale * event.peak
        columns[f"rmse_{unit}"] = scale * self._size.rms[:, 0]
        columns[f"iae_{unit}_s"] = scale * period * self._iae
        columns[f"itae_{unit}_s2"] = scale * period * self._itae
        acted = np.maximum(self._count - 1, 1)  # control periods
        for effort, variation in zip(tracking.efforts, self._variations, strict=True):
            columns[f"{effort.name}_variation_{effort.unit}_s"] = variation.total / (acted * period)
        columns["saturation"] = self._saturated / acted
        columns["energy_j"] = energy = period * self._energy
        if tracking.speed is not None:
            carried = np.where(period * self._distance > NEAR, period * self._carrying, np.nan)
            columns["cost_of_transport"] = energy / (GRAVITY * carried)
        columns |= {column: squares.rms_of_all for column, squares in self._sigmas.items()}
        columns |= {column: mean.value for column, mean in self._means.items()}
        for watched in self._watched:
            columns |= watched.columns(self._count, fell)
        for registered in self._registered:
            if registered.name in columns:
                raise OptionError(
                    "name of a metric", registered.name, "choose another name", "is that of another column"
                )
            columns[registered.name] = registered.value
        return [
            dict(zip(columns, row, strict=True))
            for row in zip(*(values.tolist() for values in columns.values()), strict=True)
        ]


class _Squares:
    """Mean squares and peaks of vectors in n episodes."""

    def __init__(self, n: int) -> None:
        self._sums: Array = np.zeros((n, 1))
        self._largest: Array = np.full((n, 1), np.nan)
        self._number = np.zeros(n, dtype=np.int64)

    def add(self, values: Array, live: Mask | None) -> None:
        """Add values (samples, n, size)."""
        squares = np.square(values)
        self._sums = _added(self._sums, squares, live)
        self._largest = np.fmax(self._largest, _largest(squares, live))
        self._number += len(values) if live is None else len(values) * live

    @property
    def rms(self) -> Array:
        """Root mean square of each component, (n, size)."""
        return np.sqrt(self._sums / _or_nan(self._number)[:, None])

    @property
    def rms_of_all(self) -> Array:
        """Root mean square of all components together, (n,)."""
        return np.sqrt(self._sums.mean(axis=-1) / _or_nan(self._number))

    @property
    def peak(self) -> Array:
        """Largest absolute value of each component, (n, size)."""
        return np.sqrt(self._largest)


class _Mean:
    """Means of numbers in n episodes; a NaN is no number."""

    def __init__(self, n: int) -> None:
        self._sums, self._number = np.zeros(n), np.zeros(n, dtype=np.int64)

    def add(self, values: Array, live: Mask | None) -> None:
        """Add values (samples, n)."""
        known = ~np.isnan(values)
        self._sums = _added(self._sums, np.where(known, values, 0.0), live)
        self._number += known.sum(axis=0) if live is None else known.sum(axis=0) * live

    @property
    def value(self) -> Array:
        return self._sums / _or_nan(self._number)


class _Watched:
    """A watched signal in n episodes, and the effect of pushes on it."""

    def __init__(self, watched: WatchedSignal, events: Sequence[Mapping[str, Span]], period: float) -> None:
        self._watched = watched
        self._mean, self._largest = _Mean(len(events)), np.full(len(events), np.nan)
        names = dict.fromkeys(name for one in events for name in one if name.startswith(PUSH))
        never = (np.inf, np.inf)
        self._events = {
            name: _Event([one.get(name, never) for one in events], watched.settling_band, period, widens=False)
            for name in names
        }

    def add(self, fields: Fields, start: int, live: Mask | None) -> None:
        """Take in a block of samples, of which the first is sample `start`."""
        size = self._watched.size(fields)
        self._mean.add(np.square(size), live)
        self._largest = np.fmax(self._largest, _largest(size, live))
        for event in self._events.values():
            event.add(size, start, live)

    def columns(self, count: NDArray[np.int64], fell: Mask) -> dict[str, Array]:
        """Columns of episodes of so many samples, some of which ended in a fall."""
        name, unit, scale = self._watched.name, self._watched.unit, self._watched.scale
        columns: dict[str, Array] = {
            f"rms_{name}_{unit}": scale * np.sqrt(self._mean.value),
            f"max_{name}_{unit}": scale * self._largest,
        }
        for event, found in self._events.items():
            columns[f"peak_{name}_{unit}_{event}"] = scale * found.peak
            if np.isfinite(self._watched.settling_band):
                columns[f"{RECOVERY}{event}_{name}"] = found.recovery_time(count, fell)
        return columns


class _Registered:
    """A registered metric of n episodes."""

    def __init__(self, metric: Metric, n: int) -> None:
        self.name, self._signal = metric.name, metric.signal
        self._rms, self._sign = metric.reduction == "rms", -1.0 if metric.reduction == "min" else 1.0
        self._extreme = metric.reduction in ("max", "min")
        self._mean, self._largest = _Mean(n), np.full(n, np.nan)

    def add(self, fields: Fields, diagnostics: Fields, live: Mask | None) -> None:
        """Add a block of samples.

        Raises:
            OptionError: if the signal has the wrong shape.
        """
        given = self._signal(fields, diagnostics)
        if given is None:
            return
        values = np.asarray(given, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != len(self._largest):
            raise OptionError(f"shape of metric {self.name!r}", values.shape, f"(samples, {len(self._largest)})")
        if self._extreme:
            self._largest = np.fmax(self._largest, _largest(self._sign * values, live))
        else:
            self._mean.add(np.square(values) if self._rms else values, live)

    @property
    def value(self) -> Array:
        """Value per episode, (n,); NaN without a sample."""
        if self._extreme:
            return self._sign * self._largest
        return np.sqrt(self._mean.value) if self._rms else self._mean.value


class _Variation:
    """Total variation of vectors in n episodes, averaged over their components."""

    def __init__(self, n: int) -> None:
        self.total = np.zeros(n)
        self._last: Array | None = None

    def add(self, values: Array, live: Mask | None) -> None:
        """Add values (samples, n, size)."""
        if len(values):
            joined = values if self._last is None else np.concatenate([self._last, values])
            self.total = _added(self.total, np.abs(np.diff(joined, axis=0)).mean(axis=-1), live)
            last = values[-1:]
            self._last = last if live is None or self._last is None else np.where(live[:, None], last, self._last)


class _Event:
    """Peak and recovery after a disturbance in n episodes."""

    def __init__(self, spans: Sequence[Span], band: float, period: float, *, widens: bool = True) -> None:
        self._begin, self._end = np.array([[_sample(time, period) for time in span] for span in spans]).T
        self._before, self._after, self._hold = (_sample(time, period) for time in (BEFORE, AFTER, HOLD))
        self._period, self._widens = period, widens
        self._band = np.full(len(spans), band)
        self._outside = self._end - 1  # the last sample outside the band since the end of the disturbance
        self._recovered = np.full(len(spans), -1)  # the first sample of the recovery, once it has held
        self.peak: Array = np.full(len(spans), np.nan)

    def add(self, size: Array, start: int, live: Mask | None) -> None:
        """Add sizes of errors (samples, n), starting at sample `start`."""
        k = np.arange(start, start + len(size))[:, None]
        if k[-1, 0] < self._begin.min() - self._before:
            return
        counts = True if live is None else live
        before = (k >= self._begin - self._before) & (k <= self._begin) & counts & self._widens
        self._band = np.fmax(self._band, np.where(before, size, 0.0).max(axis=0))
        near = (k >= self._begin) & (k <= self._end + self._after) & counts
        self.peak = np.fmax(self.peak, np.fmax.reduce(np.where(near, size, np.nan), axis=0))
        since = (k >= self._end) & counts
        outside = np.maximum.accumulate(np.where(since & ~(size <= self._band), k, self._outside), axis=0)
        held = since & (k - outside >= self._hold)
        here = held.any(axis=0) & (self._recovered < 0)
        recovered = np.take_along_axis(outside, held.argmax(axis=0)[None], axis=0)[0] + 1
        self._recovered = np.where(here, recovered, self._recovered)
        self._outside = outside[-1]

    def recovery_time(self, count: NDArray[np.int64], fell: Mask) -> Array:
        """Return the recovery time (n,) (s) for episodes of `count` samples; NaN if unknown."""
        last = count - 1
        never = np.where(fell, last >= self._begin, (self._outside == last) & (count - self._end >= self._hold))
        time = np.where(never, np.inf, np.nan)
        return np.where(self._recovered < 0, time, self._period * (self._recovered - self._end))


def _error(tracked: TrackedSignal, fields: Fields, diagnostics: Fields | None) -> Array | None:
    if tracked.diagnostic is None:
        return tracked.error(fields)
    if diagnostics is None:
        return None
    return diagnostics[tracked.diagnostic] if tracked.diagnostic in diagnostics else tracked.error(fields)


def _sample(time: float, period: float) -> int:
    return round(min(time / period, END))


def _part(first: int, stop: int, start: int) -> slice:
    """Return the slice for samples [first, stop) of a block that starts at sample `start`."""
    return slice(max(first - start, 0), max(stop - start, 0))


def _added(before: Array, values: Array | Mask, live: Mask | None) -> Array:
    """Add a block's samples (samples, n, ...) to a sum (n, ...) one by one: no bit depends on the block size."""
    start = np.broadcast_to(before, values.shape[1:])
    total = np.add.accumulate(np.concatenate([start[None], values]), axis=0)[-1]
    return total if live is None else np.where(_beside(live, total), total, start)


def _largest(values: Array, live: Mask | None) -> Array:
    """Return the largest of a block's samples (samples, n, ...); NaN for episodes that are not live."""
    largest = np.fmax.reduce(values, axis=0, initial=np.nan)
    return largest if live is None else np.where(_beside(live, largest), largest, np.nan)


def _beside(live: Mask, values: Array) -> Mask:
    return live.reshape(live.shape + (1,) * (values.ndim - 1))


def _or_nan(number: NDArray[np.int64]) -> Array:
    return np.where(number > 0, number, np.nan)
