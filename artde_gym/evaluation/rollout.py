"""One episode of an environment, a policy and a seed, with metrics and traces as its result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import ActionError
from artde_gym.evaluation.metrics import Metrics, Span, events_of, payload_of
from artde_gym.info import fall_reason
from artde_gym.motion.motion import HZ, Motion, Pose

Array = NDArray[Any]

PROGRESS_INTERVAL = 1.0  # s of simulated time


class Policy(Protocol):
    """Stable-Baselines3's predictor protocol; `diagnostics(state)` is recorded if a policy has it."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Any, Any]: ...


class Episode(NamedTuple):
    """Metrics as one row, and signals over time: "time" (samples,) and (samples, size) each by name.

    The motion is among them as `artde_gym.motion.motion.Motion.read` takes it.
    """

    row: dict[str, Any]
    traces: dict[str, Array]


def run_episode(
    env: Any,
    policy: Policy,
    seed: int,
    *,
    options: dict[str, Any] | None = None,
    record_hz: float = 100.0,
    phases: Sequence[Span] = (),
    on_progress: Callable[[float], None] | None = None,
    label: str = "",
) -> Episode:
    """Run `policy` in `env` from a seeded reset to the end.

    Args:
        env: an environment of this project, wrapped or not.
        seed: of the reset; equal seeds give equal disturbances whatever the policy.
        options: for the reset.
        record_hz: rate of the traces, at most the control rate; infinite for every sample.
        phases: see `Metrics`.
        on_progress: called with the simulated time (s), about once per simulated second.
        label: of the episode, for errors; its seed if there is none.

    Raises:
        ActionError: for an action that the environment refuses, with the episode.
    """
    plant = env.unwrapped
    period: float = plant.control_period
    stride = max(1, round(1.0 / (record_hz * period)))
    report_every = max(1, round(PROGRESS_INTERVAL / period))
    diagnose = getattr(policy, "diagnostics", None)
    looks = diagnosed_every(plant, stride)

    observation, info = env.reset(seed=seed, options=options)
    disturbances = plant.sampled_disturbances
    observations, diagnostics, told = [np.array(observation)], [], [_told(plant, info)]  # copies: policies write
    poses = _Poses(plant)
    poses.look(0)
    tells = told_every(plant, stride)
    state, episode_start = None, True
    terminated = truncated = False
    total = 0.0
    while not (terminated or truncated):
        action, state = policy.predict(observation, state=state, episode_start=episode_start, deterministic=True)
        episode_start = False
        count = len(observations)
        if diagnose is not None and (count - 1) % looks == 0:
            diagnostics.append(copied(diagnose(state)))
        try:
            observation, reward, terminated, truncated, info = env.step(action)
        except ActionError as error:
            raise error.within(label or f"seed {seed}") from error
        total += float(reward)
        observations.append(np.array(observation))
        if count % tells == 0:
            told.append(_told(plant, info))
        poses.look(count)
        if on_progress is not None and count % report_every == 0:
            on_progress(info["time_s"])

    fields = plant.observation_layout.split(np.array(observations))
    inside = stack(diagnostics)
    known = stack(told)
    metrics = metrics_for(plant, [disturbances], phases)
    last = len(observations) - 1
    measured = fields | (known if tells == 1 else {})
    metrics.add(0, _part(measured, np.s_[:last, None]), _part(inside, np.s_[:, None]))
    metrics.add(last, _part(measured, np.s_[last:, None]), None)  # no decision follows the last observation
    reason = fall_reason(info) if terminated else None
    row = row_of(reason, info["time_s"], total, metrics.rows(np.array([bool(terminated)]))[0], disturbances)
    kept = slice(None, None, stride // looks)
    seen = _part(fields, slice(None, None, stride)) | _part(known, slice(None, None, stride // tells))
    return Episode(row, traces_of(stride * period, seen, _part(inside, kept)) | poses.traces())


class _Poses:
    """Poses of an episode, of an environment that tells them, at the rate of stored motion."""

    def __init__(self, plant: Any) -> None:
        self._pose: Callable[[], Pose] | None = getattr(plant, "pose", None)
        self._stride = max(1, round(1.0 / (HZ * plant.control_period)))
        self._period = self._stride * plant.control_period
        self._poses: list[Pose] = []

    def look(self, step: int) -> None:
        """Keep the pose after so many steps."""
        if self._pose is not None and step % self._stride == 0:
            self._poses.append(self._pose())

    def traces(self) -> dict[str, Array]:
        return Motion.of(self._poses, self._period).traces() if self._poses else {}


def diagnosed_every(plant: Any, stride: int) -> int:
    """Return the number of control periods between two diagnostics of a policy, for metrics and traces of a stride."""
    return 1 if plant.metrics_spec.diagnosed else stride


def told_every(plant: Any, stride: int) -> int:
    """Return the number of control periods between two records of `info`, for metrics and traces."""
    return 1 if plant.metrics_spec.watched else stride


def metrics_for(plant: Any, disturbances: Sequence[Mapping[str, Any]], phases: Sequence[Span]) -> Metrics:
    """Return the metrics of episodes in an environment, given the sampled disturbances of each."""
    masses = [plant.nominal_robot.mass * one.get("mass_scale", {}).get("factor", 1.0) for one in disturbances]
    payloads = [payload_of(one) for one in disturbances]
    events = [events_of(one) for one in disturbances]
    return Metrics(plant.metrics_spec, plant.observation_layout, plant.control_period, masses, events, phases, payloads)


def row_of(
    fall_reason: str | None, time_s: float, reward: float, metrics: dict[str, Any], disturbances: dict[str, Any]
) -> dict[str, Any]:
    """Return one episode's row; `fall_reason` is None without a fall."""
    fell = fall_reason is not None
    return {
        "fell": fell,
        "fall_reason": fall_reason or "",
        "time_to_fall_s": time_s if fell else float("nan"),
        "duration_s": time_s,
        "reward": reward,
        **metrics,
        **_flatten(disturbances),
    }


def traces_of(period: float, fields: dict[str, Array], inside: dict[str, Array]) -> dict[str, Array]:
    """Return the signals of one episode every `period` (s): observations (and more) and the policy's diagnostics."""
    return {
        "time": period * np.arange(len(next(iter(fields.values())))),
        **{name: values.astype(np.float32) for name, values in fields.items()},
        **{f"policy.{name}": values.astype(np.float32) for name, values in inside.items()},
    }


def stack(samples: list[dict[str, Array]]) -> dict[str, Array]:
    """Stack samples of named arrays into named arrays of samples."""
    return {name: np.array([sample[name] for sample in samples]) for name in samples[0]} if samples else {}


def copied(signals: Mapping[str, Any]) -> dict[str, Array]:
    """Copy named arrays."""
    return {name: np.array(values) for name, values in signals.items()}


def _told(plant: Any, info: dict[str, Any]) -> dict[str, Array]:
    return {name: np.array(info[name]) for name in plant.metrics_spec.recorded_info}


def _part(signals: dict[str, Array], part: Any) -> dict[str, Array]:
    return {name: values[part] for name, values in signals.items()}


def _flatten(disturbances: dict[str, Any]) -> dict[str, Any]:
    """Flatten sampled values into columns: payload.mass, push.0.magnitude, ..."""
    columns: dict[str, Any] = {}

    def visit(path: str, value: Any) -> None:
        items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else None
        if items is None:
            columns[f"disturbance.{path}"] = value
        else:
            for key, item in items:
                visit(f"{path}.{key}" if path else str(key), item)

    visit("", disturbances)
    return columns


def nested(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Columns such as "disturbance.push.0.start" as the nested mappings and lists that they came from."""
    root: dict[str, Any] = {}
    for column, value in columns.items():
        if isinstance(value, float) and np.isnan(value):
            continue  # of another scenario
        *path, last = column.split(".")[1:]
        place = root
        for part in path:
            place = place.setdefault(part, {})
        place[last] = value
    return _lists(root)


def _lists(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    inner = {key: _lists(item) for key, item in value.items()}
    return list(inner.values()) if inner and all(key.isdigit() for key in inner) else inner
