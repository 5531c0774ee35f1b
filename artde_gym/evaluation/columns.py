"""Metrics of a case before it has been run: the numbers that its table of episodes will have."""

from __future__ import annotations

import numpy as np

from artde_gym.errors import OptionError, suggest_names
from artde_gym.evaluation.cells import Cell, single_of
from artde_gym.evaluation.environments import single_arguments
from artde_gym.evaluation.gains import policy_for
from artde_gym.evaluation.rollout import Policy, metrics_for
from artde_gym.evaluation.seeds import episode_seed
from artde_gym.registration import ControllerSpec

OF_EPISODES = ("duration_s", "reward", "time_to_fall_s")
"""Numbers of an episode that need no metrics."""


def metric_names(cell: Cell, item: Policy | ControllerSpec, seed: int) -> list[str]:
    """Return the names of the metrics that a controller's first episode will have, after one step of it."""
    disturbances = {name: cell.kwargs[name] for name in ("disturbances",) if name in cell.kwargs}
    env, options = single_of(cell._replace(kwargs={**single_arguments(cell.env_id, cell.kwargs), **disturbances}))
    plant = env.unwrapped
    policy = policy_for(item, env, {})
    first, _ = env.reset(seed=episode_seed(seed, 0), options=options)
    observations = [np.array(first)]
    action, state = policy.predict(first, state=None, episode_start=True, deterministic=True)
    diagnose = getattr(policy, "diagnostics", None)
    inside = {} if diagnose is None else {name: np.array(value)[None, None] for name, value in diagnose(state).items()}
    after, _, _, _, info = env.step(action)
    observations.append(np.array(after))
    told = {name: np.array([[info[name]]]) for name in plant.metrics_spec.recorded_info}
    metrics = metrics_for(plant, [plant.sampled_disturbances], cell.phases)
    fields = plant.observation_layout.split(np.array(observations)[:, None])
    metrics.add(0, {name: value[:1] for name, value in fields.items()} | told, inside)
    metrics.add(1, {name: value[1:] for name, value in fields.items()} | told, None)
    return [*OF_EPISODES, *metrics.rows()[0]]


def check_metric(name: str, cell: Cell, item: Policy | ControllerSpec, seed: int) -> None:
    """Check that episodes will have a metric, before the first of them.

    Raises:
        OptionError: if they will not.
    """
    known = metric_names(cell, item, seed)
    if name not in known:
        raise OptionError("metric", name, suggest_names(name, known))
