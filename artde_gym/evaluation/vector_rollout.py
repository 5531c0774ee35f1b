"""Many episodes at once in a vector environment, one seed each, with metrics and a few traces as their result."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.arrays import Array
from artde_gym.errors import ActionError
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
from artde_gym.evaluation.side_by_side import Mask, Rows, SideBySide
from artde_gym.info import fall_reason

BLOCK = 4096  # samples of all episodes of a policy together that metrics process at once, to amortize a call


def run_vector(
    env: Any,
    policy: Policy | SideBySide,
    seeds: Sequence[int],
    *,
    options: dict[str, Any] | None = None,
    record_hz: float = 100.0,
    recorded: Collection[int] = (),
    phases: Sequence[Span] = (),
    on_progress: Callable[[float], None] | None = None,
) -> list[Episode]:
    """Run a vector environment from a reset with `seeds` until all its episodes have ended.

    All metrics are those of `run_episode`. No episode depends on the others. Samples after an episode's end do not
    count; the environment may do anything with it then.

    Args:
        env: a vector environment of this project, of as many environments as there are seeds.
        policy: takes the observations of all of them at once, or each of several policies those of its own ones.
        seeds: of the episodes.
        options: of the reset.
        record_hz: rate of the traces, at most the control rate; infinite for every sample.
        recorded: numbers of the episodes that leave traces.
        phases: see `Metrics`.
        on_progress: called with the simulated time (s), about once per simulated second.

    Raises:
        ActionError: for an action that the environment refuses, with the episode.
    """
    period: float = env.control_period
    report_every = max(1, round(PROGRESS_INTERVAL / period))
    if not isinstance(policy, SideBySide):
        labels = [f"seed {seed}" for seed in seeds]
        policy = SideBySide([policy] * len(seeds), [""] * len(seeds), env.action_layout.size, labels)

    observation, info = env.reset(seed=list(seeds), options=options)
    disturbances = env.sampled_disturbances
    live = np.ones(len(seeds), dtype=np.bool_)
    steps, total = np.zeros(len(seeds), dtype=np.int64), np.zeros(len(seeds))
    reasons: dict[int, str] = {}
    stride = max(1, round(1.0 / (record_hz * period)))
    parts = [_Part(env, own, rows, disturbances, phases, recorded, stride) for own, rows in policy.parts]
    state, episode_start, k = None, live, 0
    while live.any():
        for part in parts:
            part.see(k, observation, info)
        action, state = policy.predict(observation, state=state, episode_start=episode_start, deterministic=True)
        for part, own in zip(parts, state.policies, strict=True):
            part.decide(k, own)
        try:
            observation, reward, terminated, truncated, info = env.step(action)
        except ActionError as error:
            raise error.within(policy.labels[error.environment]) from error
        k += 1
        total += np.where(live, reward, 0.0)
        episode_start = terminated | truncated
        ended = live & episode_start
        if ended.any():
            for part in parts:
                part.end(k, observation, info, ended)
            steps[ended] = k
            reasons |= {int(i): fall_reason(info, int(i)) for i in np.flatnonzero(live & terminated)}
            live = live & ~ended
        if on_progress is not None and k % report_every == 0:
            on_progress(k * period)

    fell = np.isin(np.arange(len(seeds)), list(reasons))
    found = sorted((result for part in parts for result in part.results(fell, steps)), key=lambda result: result[0])
    return [
        Episode(row_of(reasons.get(i), float(steps[i] * period), float(total[i]), row, disturbances[i]), traces)
        for i, row, traces in found
    ]


class _Part:
    """Episodes of one policy: their samples since the last block, their metrics and traces."""

    def __init__(
        self,
        env: Any,
        policy: Policy,
        rows: Rows,
        disturbances: Sequence[Mapping[str, Any]],
        phases: Sequence[Span],
        recorded: Collection[int],
        stride: int,
    ) -> None:
        self._rows, self._numbers = rows, np.arange(len(disturbances))[rows].tolist()
        self._split = env.observation_layout.split
        self._names = env.metrics_spec.recorded_info if env.metrics_spec.watched else ()
        self._metrics = metrics_for(env, [disturbances[i] for i in self._numbers], phases)
        self._diagnose: Any = getattr(policy, "diagnostics", None)
        self._looks = diagnosed_every(env, stride)
        self._traces = _Traces(env, self._numbers, recorded, stride)
        self._live, self._running = np.ones(len(self._numbers), np.bool_), True
        self._first, self._block = 0, list[Array]()
        self._told: list[dict[str, Array]] = []
        self._insides: list[dict[str, Array]] = []

    def see(self, step: int, observation: Array, info: Mapping[str, Any]) -> None:
        """Take the sample after `step` steps."""
        if not self._running:
            return
        if len(self._block) * len(self._live) >= BLOCK:
            self._add(step)
        self._block.append(np.array(observation[self._rows]))
        self._told.append(self._tell(info))
        self._traces.see(step, observation, info)

    def decide(self, step: int, state: Any) -> None:
        """Take the policy's diagnostics at the decision after `step` steps."""
        if self._running and self._diagnose is not None and step % self._looks == 0:
            self._insides.append(copied(self._diagnose(state)))
            self._traces.decide(step, self._insides[-1])

    def end(self, step: int, observation: Array, info: Mapping[str, Any], ended: Mask) -> None:
        """Take the last sample, after `step` steps, of episodes that end with it."""
        ends = ended[self._rows]
        if not ends.any():
            return
        self._add(step)
        last = {name: values[None] for name, values in self._tell(info).items()}
        sample = self._split(observation[self._rows][None])
        self._metrics.add(step, sample | last, None, ends)  # no decision follows the last observation
        self._live = self._live & ~ends
        self._running = bool(self._live.any())
        if not self._running:
            self._traces.see(step, observation, info)

    def results(self, fell: Mask, steps: NDArray[np.int64]) -> Iterator[tuple[int, dict[str, Any], dict[str, Array]]]:
        """Yield number, metrics and traces of each episode, given which ones fell and how long they were."""
        for number, row in zip(self._numbers, self._metrics.rows(fell[self._rows]), strict=True):
            yield number, row, self._traces.of(number, int(steps[number]))

    def _tell(self, info: Mapping[str, Any]) -> dict[str, Array]:
        return {name: np.array(info[name][self._rows]) for name in self._names}

    def _add(self, step: int) -> None:
        """Add the samples before `step` to the metrics."""
        block = self._split(np.array(self._block)) | stack(self._told)
        self._metrics.add(self._first, block, stack(self._insides), self._live)
        self._first, self._block, self._told, self._insides = step, [], [], []


class _Traces:
    """Signals of the recorded ones among some episodes, every `stride` control periods."""

    def __init__(self, env: Any, numbers: Sequence[int], recorded: Collection[int], stride: int) -> None:
        self._env, self._stride = env, stride
        self._places = [place for place, number in enumerate(numbers) if number in recorded]
        self._numbers = [numbers[place] for place in self._places]
        self._observations: list[Array] = []
        self._told: list[dict[str, Array]] = []
        self._diagnostics: list[dict[str, Array]] = []

    def see(self, step: int, observation: Array, info: Mapping[str, Any]) -> None:
        """Store observations and info after `step` steps."""
        if self._numbers and step % self._stride == 0:
            self._observations.append(observation[self._numbers])
            told = self._env.metrics_spec.recorded_info
            self._told.append({name: info[name][self._numbers] for name in told})

    def decide(self, step: int, values: Mapping[str, Array]) -> None:
        """Store the policy's diagnostics at a decision."""
        if self._numbers and step % self._stride == 0:
            self._diagnostics.append({name: value[self._places] for name, value in values.items()})

    def of(self, number: int, steps: int) -> dict[str, Array]:
        """Return the traces of one episode of `steps` steps; none unless it is recorded."""
        if number not in self._numbers:
            return {}
        place = self._numbers.index(number)
        seen, decided = steps // self._stride + 1, (steps - 1) // self._stride + 1
        fields = self._env.observation_layout.split(np.array([sample[place] for sample in self._observations[:seen]]))
        known, own = (
            stack([{name: values[place] for name, values in sample.items()} for sample in samples])
            for samples in (self._told[:seen], self._diagnostics[:decided])
        )
        return traces_of(self._stride * self._env.control_period, fields | known, own)
