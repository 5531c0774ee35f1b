"""Numbers of one episode, from its recorded signals."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from artde_gym.arrays import Array

GRAVITY = 9.81  # m/s^2
RECOVERY_BAND = np.radians(0.5)  # rad, joint error (RMS over joints) that counts as recovered
RECOVERY_HOLD = 1.0  # s, for which it must stay there


@dataclasses.dataclass(frozen=True)
class Recording:
    """Signals of one episode at every control period.

    Attributes:
        period: s.
        fields: observations by field name, (samples, size); the last row is the final observation.
        limit: largest force of each actuator.
        axes: reported axis -> its column in q.
        mass: of the robot with its payload (kg).
        pushes: (start, end) of each push (s).
        phases: (start, end) of parts that are measured one by one too (s).
        sigma: TDE errors at the trace's rate, (samples, n); None for a policy without.
    """

    period: float
    fields: Mapping[str, Array]
    limit: Array
    axes: Mapping[str, int]
    mass: float
    pushes: tuple[tuple[float, float], ...] = ()
    phases: tuple[tuple[float, float], ...] = ()
    sigma: Array | None = None


def episode_metrics(recording: Recording) -> dict[str, Any]:
    """All metrics of section "Metrics" of the documentation, by column name.

    Per axis: `rmse_deg`, `max_abs_error_deg`, `rms_torque_nm`; the same with `_phase1`, ... for each phase. Per
    episode, over all joints:

    - `rmse_deg`: root of the mean square error over joints and time.
    - `iae_deg_s`, `itae_deg_s2`: integral of the mean absolute error, and of time times it.
    - `torque_variation_nm_s`: mean over joints of sum |tau_k - tau_k-1|, a second.
    - `saturation`: share of samples with a joint at its limit.
    - `energy_j`: integral of sum |tau qd|; `cost_of_transport`: energy / (m g distance), NaN below 0.1 m.
    - `tde_error_rms`: root mean square of sigma (rad/s^2).
    - `recovery_time_s_push0`, ...: time from the end of each push until the joint error (RMS over joints) stays for 1 s
      within 0.5 degrees, or within its largest value in the 2 s before the push if that is more; infinite if it never
      does.
    """
    fields, period = recording.fields, recording.period
    error = fields["q_ref"] - fields["q"]
    torque = fields["tau_applied"][1:]
    time = period * np.arange(1, len(torque) + 1)
    absolute = np.degrees(np.abs(error[1:]).mean(axis=1))
    power = np.abs(torque * fields["qd"][1:]).sum(axis=1)
    energy = float(power.sum() * period)
    distance = float(fields["base_velocity"][:, 0].sum() * period)
    metrics = _axis_metrics(recording, 0, len(error), "")
    for number, (start, end) in enumerate(recording.phases, start=1):
        last = len(error) if end == float("inf") else round(end / period)
        metrics |= _axis_metrics(recording, round(start / period), last, f"phase{number}_")
    for number, push in enumerate(recording.pushes):
        metrics[f"recovery_time_s_push{number}"] = recovery_time(error, period, *push)
    sigma = recording.sigma
    return metrics | {
        "rmse_deg": float(np.degrees(_rms(error))),
        "iae_deg_s": float(absolute.sum() * period),
        "itae_deg_s2": float((time * absolute).sum() * period),
        "torque_variation_nm_s": float(np.abs(np.diff(torque, axis=0)).sum(axis=0).mean() / (len(torque) * period)),
        "saturation": float((np.abs(torque) >= recording.limit).any(axis=1).mean()),
        "energy_j": energy,
        "cost_of_transport": energy / (recording.mass * GRAVITY * distance) if distance > 0.1 else float("nan"),
        "tde_error_rms": float("nan") if sigma is None else _rms(sigma),
    }


def _axis_metrics(recording: Recording, first: int, last: int, prefix: str) -> dict[str, Any]:
    """Metrics of each reported axis over the samples [first, last); NaN for a part that the episode did not reach."""
    error = recording.fields["q_ref"][first:last] - recording.fields["q"][first:last]
    torque = recording.fields["tau_applied"][max(first, 1) : last]  # of the period that ends with its sample
    metrics: dict[str, Any] = {}
    for axis, column in recording.axes.items():
        reached = len(error) > 0
        peak = np.abs(error[:, column]).max() if reached else np.nan
        metrics[f"rmse_deg_{prefix}{axis}"] = float(np.degrees(_rms(error[:, column]))) if reached else np.nan
        metrics[f"max_abs_error_deg_{prefix}{axis}"] = float(np.degrees(peak))
        metrics[f"rms_torque_nm_{prefix}{axis}"] = _rms(torque[:, column]) if reached else np.nan
    return metrics


def recovery_time(error: Array, period: float, start: float, end: float) -> float:
    """Time from a push's end (s) until the error (samples, n) (rad) is back in its band for good measure."""
    size = np.sqrt((error**2).mean(axis=1))
    first, last = round(start / period), round(end / period)
    if last >= len(size):
        return float("nan")  # the episode ended before the push did
    before = size[max(0, first - round(2.0 / period)) : first + 1]
    outside = size[last:] > max(RECOVERY_BAND, float(before.max()))
    hold = min(round(RECOVERY_HOLD / period), len(outside))
    # number of samples outside the band in [k, k + hold)
    count = np.convolve(outside, np.ones(hold), mode="valid")
    recovered = np.flatnonzero(count < 0.5)
    return float(recovered[0] * period) if len(recovered) else float("inf")


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
