"""Tuning the linear balance law by an evolution strategy (CMA-ES, Hansen 2016), in generations that can be continued.

Every generation meets the same new pushes with all of its candidates. What is judged on held-out seeds and exported is
the mean of the distribution. The state is the list of values told so far: telling them again gives the same generator.
"""

from __future__ import annotations

import functools
import json
import multiprocessing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from cmaes import CMA
from numpy.typing import NDArray

from baselines.balance import GAINS, balance_network
from baselines.errors import TrainingError
from baselines.recipe import Recipe
from baselines.residual_env import ResidualEnv
from baselines.run import Progress, Run, Training, environment_kwargs, single
from baselines.tasks import push

POPULATION = 14
PUSHES = 10  # episodes of each candidate
SPREAD = 0.2  # of the first generation
DURATION = 5.5  # s, of an episode
_PUSH = {"push": [push({"choice": [15.0, 20.0, 25.0, 30.0]}, start={"uniform": [2.3, 3.3]})]}


def tune(training: Training, out: str | Path, on_progress: Callable[[Progress], None] | None = None) -> Path:
    """Tune, or continue, and return the folder of the best gains so far; `steps` counts decisions.

    Raises:
        TrainingError: if `out` holds a run of another configuration, or the robot has no such law.
    """
    if training.recipe.robot != "ojas" or training.recipe.channel != "synergies":
        raise TrainingError("recipe", training.recipe, "the biped's synergies, of which the law has gains")
    run = Run(training, Path(out), on_progress)
    kwargs = {**environment_kwargs(training), "duration": DURATION, "disturbances": _PUSH}
    judge = functools.partial(_judge, training.env_id, kwargs, training.recipe)
    residual = single(training.env_id, kwargs, training.recipe).residual
    file = run.folder / "generations.json"
    told: list[dict[str, Any]] = []
    if file.exists():
        stored = json.loads(file.read_text())
        told = stored["generations"]
        run.state = stored["state"]
    strategy = CMA(np.zeros(GAINS), SPREAD, population_size=POPULATION, seed=training.seed)
    with multiprocessing.get_context("spawn").Pool(training.workers) as pool:
        steps, generation = 0, 0
        while steps < training.steps and not strategy.should_stop():
            candidates = [strategy.ask() for _ in range(POPULATION)]
            if generation < len(told):
                costs = told[generation]["costs"]
                steps = told[generation]["steps"]
            else:
                seeds = np.random.SeedSequence([training.seed, generation]).generate_state(PUSHES).tolist()
                networks = [balance_network(gains, residual.features, residual.actions) for gains in candidates]
                found = pool.map(functools.partial(judge, seeds=seeds), networks, chunksize=1)
                costs = [cost for cost, _ in found]
                steps += sum(count for _, count in found)
            strategy.tell(list(zip(candidates, costs, strict=True)))
            generation += 1
            if generation > len(told):
                told.append({"costs": costs, "steps": steps})
                if generation % training.test_every == 0:
                    network = balance_network(_mean(strategy), residual.features, residual.actions)
                    run.test(network, residual, steps, {"mean_cost": float(np.mean(costs))})
                part = file.with_suffix(".part")
                part.write_text(json.dumps({"state": run.state, "generations": told}))
                part.replace(file)
                run.report(steps, f"generation {generation}, mean cost {np.mean(costs):.3f}")
    return run.exported


def _mean(strategy: CMA) -> NDArray[np.float64]:
    return np.asarray(strategy.mean)


_kept: dict[str, ResidualEnv] = {}
"""A worker's environment; building one takes a second."""


def _judge(env_id: str, kwargs: dict[str, Any], recipe: Recipe, network: Any, seeds: list[int]) -> tuple[float, int]:
    """Share of falls, a little less for late ones and for small actions, and decisions taken."""
    if env_id not in _kept:
        _kept[env_id] = single(env_id, kwargs, recipe)
    env, cost, steps = _kept[env_id], 0.0, 0
    for seed in seeds:
        features, _ = env.reset(seed=int(seed))
        terminated, over, count, effort = False, False, 0, 0.0
        while not over:
            action = network(features)
            features, _, terminated, truncated, _ = env.step(action)
            over, count, effort = terminated or truncated, count + 1, effort + float(action.dot(action))
        if terminated:
            cost += 1.0 - 0.3 * count * recipe.hold / DURATION
        cost += 0.002 * effort / count
        steps += count
    return cost / len(seeds), steps
