"""Takes: single episodes to be shown, read from a folder or run once more, and what a page holds of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from artde_gym.arrays import Array
from artde_gym.disturbances.schedule import force_of
from artde_gym.errors import OptionError
from artde_gym.evaluation.cells import Cell, single_of
from artde_gym.evaluation.environments import metrics_spec_of
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.metrics import NEVER
from artde_gym.evaluation.rollout import Policy, nested, run_episode
from artde_gym.evaluation.store import read_traces, stored_names
from artde_gym.metrics_spec import EffortSignal, MetricsSpec, TrackedSignal
from artde_gym.motion.motion import KEY, Motion
from artde_gym.motion.packing import Packed
from artde_gym.registration import ControllerSpec

POINTS = 400  # at most, of a plotted signal
LEVELS = 2000  # of a plotted signal, from zero to its largest value
INSIDE = "policy."
SAME = 1e-6  # share of a number, by which it may differ in the same episode
SYMBOLS = {"n": "N", "nm": "Nm"}
"""Unit as columns spell it -> as it is written, where they differ."""


class Take(NamedTuple):
    """One controller's episode.

    Attributes:
        row: of the table of episodes.
        traces: its signals, the motion among them.
        note: what has to be said about it.
    """

    name: str
    row: Mapping[str, Any]
    traces: Mapping[str, Array]
    note: str = ""

    @property
    def motion(self) -> Motion:
        """Motion of the episode.

        Raises:
            OptionError: if its environment does not tell poses.
        """
        motion = Motion.read(self.traces)
        if motion is None:
            raise OptionError(
                "env_id",
                self.row.get("env"),
                "choose another one, or add the method",
                "has no method `pose`, which replays show",
            )
        return motion

    @property
    def disturbances(self) -> dict[str, Any]:
        """Sampled disturbances in the grammar."""
        return nested({key: value for key, value in self.row.items() if key.startswith("disturbance.")})


def stored_take(folder: Path, scenario: str, name: str, row: Mapping[str, Any]) -> Take | None:
    """Read a take; None if its motion was not stored."""
    if not has_motion(folder, scenario, name, int(row["episode"])):
        return None
    return Take(name, row, read_traces(folder, scenario, name, int(row["episode"])) or {})


def has_motion(folder: Path, scenario: str, name: str, episode: int) -> bool:
    """Tell whether the motion of an episode is stored."""
    return f"{KEY}planes" in stored_names(folder, scenario, name, episode)


def new_take(
    cell: Cell,
    name: str,
    item: Policy | ControllerSpec,
    gains: Mapping[str, Any],
    seed: int,
    on_progress: Callable[[float], None] | None = None,
) -> Take:
    """Run an episode.

    Raises:
        OptionError, DisturbanceError, GainError: for what an environment or a controller refuses.
    """
    env, options = single_of(cell)
    episode = run_episode(env, policy_for(item, env, dict(gains)), seed, options=options, on_progress=on_progress)
    return Take(name, {"env": cell.env_id, **episode.row}, episode.traces)


def compared(take: Take, row: Mapping[str, Any], now: str, then: str) -> Take:
    """Return a take that was run again with a note, if it is not the episode of a stored `row`.

    Args:
        take: the episode as it is now.
        row: of the table of episodes.
        now, then: titles of the physics of both.
    """
    same = all(math.isclose(take.row[key], row[key], rel_tol=SAME, abs_tol=SAME) for key in _compared(take, row))
    if same and take.row["fell"] == row["fell"]:
        return take
    why = "another machine or other versions?" if now == then else f"it ran in {then}, and again in {now}"
    note = f"it {_end(take, take.row)}, while in episodes.csv it {_end(take, row)} ({why})"
    return take._replace(note=f"{take.name} was run again and did not repeat: {note}")


def _compared(take: Take, row: Mapping[str, Any]) -> list[str]:
    """Return the columns that show whether an episode is the same: its duration, and its main error if it is known."""
    error = metrics_spec_of(take.row["env"]).errors[0]
    metric = f"rmse_{error.unit}"
    return ["duration_s", *([metric] if math.isfinite(row.get(metric, math.nan)) else [])]


def _end(take: Take, row: Mapping[str, Any]) -> str:
    _, *errors = _compared(take, row)
    error = "".join(f" with {name} {row[name]:.6g}" for name in errors)
    return f"{'fell' if row['fell'] else 'ended'} at {row['duration_s']:.3f} s{error}"


def text_of(take: Take, tracking: MetricsSpec, color: str) -> dict[str, Any]:
    """Return what a page holds of a take."""
    row, motion = take.row, take.motion.thinned()
    return {
        "name": take.name,
        "color": color,
        "end": float(row["duration_s"]),
        "fall": (str(row["fall_reason"]) or "fall") if row["fell"] else "",
        "note": take.note,
        "motion": motion.text(),
        "hook": _hook(take),
        "pushes": list(_pushes(take)),
        "events": [[time, text] for time, text in _payload_events(take) if time <= row["duration_s"]],
        "series": [_plotted(label, take.traces["time"], values) for label, values in signals_of(take.traces, tracking)],
    }


def _hook(take: Take) -> list[float] | None:
    """Return the place in the base frame at which a payload hangs on a cable (m), or None."""
    payload = take.disturbances.get("payload", {})
    return [float(part) for part in payload["position"]] if payload.get("cable") else None


def _pushes(take: Take) -> Iterable[dict[str, Any]]:
    for push in take.disturbances.get("push", ()):
        start = push["start"]
        if start <= take.row["duration_s"] and push["magnitude"]:
            end = start + push["duration"]
            yield {"site": push["body"], "force": np.round(force_of(push), 3).tolist(), "start": start, "end": end}


def _payload_events(take: Take) -> Iterable[tuple[float, str]]:
    payload = take.disturbances.get("payload")
    if payload and payload["attach_time"] < payload["detach_time"]:
        what = f"payload of {payload['mass']:.3g} kg"
        if payload["attach_time"] > 0:
            yield payload["attach_time"], f"{what} attached"
        if payload["detach_time"] < NEVER:
            yield payload["detach_time"], f"{what} dropped"


def signals_of(fields: Mapping[str, Array], tracking: MetricsSpec) -> Iterable[tuple[str, Array]]:
    """Sizes over time: each tracked error, each effort, and gains of the policy that are reported as means."""
    for place, tracked in enumerate(tracking.errors):
        yield error_label(tracked), _error(fields, tracked, tracking.norm or place > 0)
    for effort in tracking.efforts:
        yield effort_label(effort), _largest(fields, effort)
    for column, diagnostic in tracking.diagnostic_means.items():
        if INSIDE + diagnostic in fields:
            yield gain_label(column), _size(fields[INSIDE + diagnostic])


def error_label(tracked: TrackedSignal) -> str:
    """Return the label of an error."""
    return f"error ({tracked.unit})"


def effort_label(effort: EffortSignal) -> str:
    """Return the label of an effort."""
    return f"{effort.name}, largest ({SYMBOLS.get(effort.unit, effort.unit)})"


def gain_label(column: str) -> str:
    """Return the label of a gain that is reported as a mean in a column."""
    return column.replace("_mean", "").replace("_", " ")


def _error(fields: Mapping[str, Array], tracked: TrackedSignal, norm: bool) -> Array:
    own = INSIDE + (tracked.diagnostic or "")
    error = tracked.scale * (fields[own] if own in fields else tracked.error(fields))
    squares = (error.astype(np.float64) ** 2).reshape(len(error), -1)
    return np.sqrt(squares.sum(axis=1) if norm else squares.mean(axis=1))


def _largest(fields: Mapping[str, Array], effort: EffortSignal) -> Array:
    return np.abs(fields[effort.field][:, effort.part]).max(axis=1)


def _size(values: Array) -> Array:
    return np.linalg.norm(values.reshape(len(values), -1), axis=1)


def _plotted(label: str, time: Array, values: Array) -> dict[str, Any]:
    """Pack the largest value in each of at most `POINTS` equal spans, so that no peak is lost."""
    values = np.nan_to_num(np.asarray(values, np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    stride = -(-len(values) // POINTS)
    peaks = np.maximum.reduceat(values, np.arange(0, len(values), stride))
    unit = float(peaks.max()) / LEVELS or 1.0
    period = stride * float(time[1] - time[0]) if len(time) > 1 else 1.0
    return {"label": label, "period": period, **Packed.of(peaks[:, None], [unit]).text()}
