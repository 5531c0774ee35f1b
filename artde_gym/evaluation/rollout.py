"""One episode: an environment, a policy and a seed in; metrics and traces out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from artde_gym.evaluation.metrics import Metrics, events_of

Array = NDArray[Any]

PROGRESS_INTERVAL = 1.0  # s of simulated time


class Policy(Protocol):
    """Stable-Baselines3's predictor protocol; `diagnostics(state)` is recorded where a policy has it."""

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Any, Any]: ...


class Episode(NamedTuple):
    """Metrics as one row, and signals over time: "time" (samples,) and (samples, size) each by name."""

    row: dict[str, Any]
    traces: dict[str, Array]


def run_episode(
    env: Any,
    policy: Policy,
    seed: int,
    *,
    options: dict[str, Any] | None = None,
    trace_hz: float = 100.0,
    phases: tuple[tuple[float, float], ...] = (),
    on_progress: Callable[[float], None] | None = None,
) -> Episode:
    """Drive `env` with `policy` from a seeded reset to the end.

    Args:
        env: an environment of this project, wrapped or not.
        seed: of the reset; the same seed has the same disturbances whatever the policy.
        options: of the reset.
        trace_hz: rate of the traces, at most the control rate; infinite for every sample.
        phases: see `Metrics`.
        on_progress: called with the simulated time (s) about once a simulated second.
    """
    plant = env.unwrapped
    period: float = plant.control_period
    stride = max(1, round(1.0 / (trace_hz * period)))
    report_every = max(1, round(PROGRESS_INTERVAL / period))
    diagnose = getattr(policy, "diagnostics", None)
    diagnosed_every = 1 if plant.tracking.diagnosed else stride

    observation, info = env.reset(seed=seed, options=options)
    disturbances = info["disturbances"]
    observations, diagnostics = [observation], []
    state, episode_start = None, True
    terminated = truncated = False
    total = 0.0
    while not (terminated or truncated):
        action, state = policy.predict(observation, state=state, episode_start=episode_start, deterministic=True)
        episode_start = False
        count = len(observations)
        if diagnose is not None and (count - 1) % diagnosed_every == 0:
            diagnostics.append(diagnose(state))
        observation, reward, terminated, truncated, info = env.step(action)
        total += float(reward)
        observations.append(observation)
        if on_progress is not None and count % report_every == 0:
            on_progress(info["time_s"])

    fields = plant.observation_layout.split(np.array(observations))
    inside = _stack(diagnostics)
    metrics = Metrics(
        plant.tracking, plant.observation_layout, period, [mass(plant, disturbances)], [events_of(disturbances)], phases
    )
    metrics.add(_one(fields, slice(None, -1)), _one(inside, slice(None)))
    metrics.add(_one(fields, slice(-1, None)), None)  # nothing was decided there any more
    row = {
        "fell": bool(terminated),
        "fall_reason": info.get("fall_reason", ""),
        "time_to_fall_s": info["time_s"] if terminated else float("nan"),
        "duration_s": info["time_s"],
        "reward": total,
        **metrics.rows()[0],
        **_flatten(disturbances),
    }
    traces = {"time": period * np.arange(0, len(observations), stride)}
    traces.update({name: values[::stride].astype(np.float32) for name, values in fields.items()})
    kept = slice(None, None, stride // diagnosed_every)
    traces.update({f"policy.{name}": values[kept].astype(np.float32) for name, values in inside.items()})
    return Episode(row, traces)


def mass(plant: Any, disturbances: Mapping[str, Any]) -> float:
    """Of the robot with its payload (kg)."""
    return plant.nominal_robot.mass + disturbances.get("payload", {}).get("mass", 0.0)


def _one(signals: dict[str, Array], part: slice) -> dict[str, Array]:
    """Samples of one episode as those of one of many."""
    return {name: values[part, None] for name, values in signals.items()}


def _stack(samples: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.array([sample[name] for sample in samples]) for name in samples[0]} if samples else {}


def _flatten(disturbances: dict[str, Any]) -> dict[str, Any]:
    """Realised values as columns: payload.mass, push.0.magnitude, ..."""
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
