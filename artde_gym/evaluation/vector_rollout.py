"""Many episodes at once in a vector environment, one seed each, with metrics and a few traces as their result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from artde_gym.arrays import Array
from artde_gym.evaluation.metrics import Span
from artde_gym.evaluation.rollout import (
    PROGRESS_INTERVAL,
    Episode,
    Policy,
    copied,
    diagnosed_every,
    metrics_for,
    row_of,
    stack,
    traces_of,
)
from artde_gym.info import fall_reason

BLOCK = 4096  # samples of all episodes together that metrics process at once, to amortize the cost of a call


def run_vector(
    env: Any,
    policy: Policy,
    seeds: Sequence[int],
    *,
    options: dict[str, Any] | None = None,
    record_hz: float = 100.0,
    record_episodes: int = 0,
    phases: Sequence[Span] = (),
    on_progress: Callable[[float], None] | None = None,
) -> list[Episode]:
    """Run a vector environment from a reset with `seeds` until all its episodes have ended.

    All metrics are those of `run_episode`. No episode depends on the others. Samples after an episode's end do not
    count; the environment may do anything with it then.

    Args:
        env: a vector environment of this project, of as many environments as there are seeds.
        policy: takes the observations of all of them at once.
        seeds: of the episodes.
        options: of the reset.
        record_hz: rate of the traces, at most the control rate; infinite for every sample.
        record_episodes: the first so many episodes leave traces.
        phases: see `Metrics`.
        on_progress: called with the simulated time (s), about once per simulated second.
    """
    period: float = env.control_period
    stride = max(1, round(1.0 / (record_hz * period)))
    report_every = max(1, round(PROGRESS_INTERVAL / period))
    diagnose = getattr(policy, "diagnostics", None)
    looks = diagnosed_every(env, stride)
    split = env.observation_layout.split

    observation, info = env.reset(seed=list(seeds), options=options)
    disturbances = env.sampled_disturbances
    metrics = metrics_for(env, disturbances, phases)
    live = np.ones(len(seeds), dtype=np.bool_)
    steps, total = np.zeros(len(seeds), dtype=np.int64), np.zeros(len(seeds))
    reasons: dict[int, str] = {}

    traces = _Traces(env, record_episodes, stride)
    traces.observe(0, observation, info)
    block: list[Array] = []
    told: list[dict[str, Array]] = []
    names = env.metrics_spec.recorded_info if env.metrics_spec.watched else ()
    insides: list[dict[str, Array]] = []
    state, episode_start, k = None, live, 0
    while live.any():
        block.append(np.array(observation))
        told.append({name: np.array(info[name]) for name in names})
        action, state = policy.predict(observation, state=state, episode_start=episode_start, deterministic=True)
        if diagnose is not None and k % looks == 0:
            insides.append(copied(diagnose(state)))
            traces.diagnose(k, insides[-1])
        observation, reward, terminated, truncated, info = env.step(action)
        k += 1
        total += np.where(live, reward, 0.0)
        traces.observe(k, observation, info)
        episode_start = terminated | truncated
        ended = live & episode_start
        if ended.any() or len(block) * len(seeds) >= BLOCK:
            metrics.add(k - len(block), split(np.array(block)) | stack(told), stack(insides), live)
            block, told, insides = [], [], []
        if ended.any():
            last = {name: np.array(info[name])[None] for name in names}
            metrics.add(k, split(observation[None]) | last, None, ended)  # no decision follows the last observation
            steps[ended] = k
            reasons |= {int(i): fall_reason(info, int(i)) for i in np.flatnonzero(live & terminated)}
            live = live & ~ended
        if on_progress is not None and k % report_every == 0:
            on_progress(k * period)

    episodes = []
    for i, row in enumerate(metrics.rows(np.isin(np.arange(len(seeds)), list(reasons)))):
        row = row_of(reasons.get(i), float(steps[i] * period), float(total[i]), row, disturbances[i])
        episodes.append(Episode(row, traces.of(i, int(steps[i])) if i < record_episodes else {}))
    return episodes


class _Traces:
    """Signals of the first `count` episodes, every `stride` control periods."""

    def __init__(self, env: Any, count: int, stride: int) -> None:
        self._env, self._count, self._stride = env, count, stride
        self._observations: list[Array] = []
        self._told: list[dict[str, Array]] = []
        self._diagnostics: list[dict[str, Array]] = []

    def observe(self, step: int, observation: Array, info: Mapping[str, Any]) -> None:
        """Store observations and info after `step` steps."""
        if self._count and step % self._stride == 0:
            self._observations.append(observation[: self._count].copy())
            told = self._env.metrics_spec.recorded_info
            self._told.append({name: np.array(info[name][: self._count]) for name in told})

    def diagnose(self, step: int, values: Mapping[str, Array]) -> None:
        """Store the policy's diagnostics at a decision."""
        if self._count and step % self._stride == 0:
            self._diagnostics.append({name: value[: self._count].copy() for name, value in values.items()})

    def of(self, episode: int, steps: int) -> dict[str, Array]:
        """Return the traces of one episode of `steps` steps."""
        seen, decided = steps // self._stride + 1, (steps - 1) // self._stride + 1
        fields = self._env.observation_layout.split(np.array([sample[episode] for sample in self._observations[:seen]]))
        known, own = (
            stack([{name: values[episode] for name, values in sample.items()} for sample in samples])
            for samples in (self._told[:seen], self._diagnostics[:decided])
        )
        return traces_of(self._stride * self._env.control_period, fields | known, own)
