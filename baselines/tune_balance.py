"""Tuning the linear balance law by an evolution strategy (CMA-ES, Hansen 2016), in generations that can be continued.

Every generation meets the same new pushes with all of its candidates. The distribution's mean is judged on
held-out seeds and exported. The state is the list of values told so far: telling them again gives the same generator.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artde_gym.arguments import wrap_read_errors
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.store import write_atomically
from artde_gym.extras import needs
from baselines.agent import agent_of
from baselines.balance import GAINS, balance_network
from baselines.errors import TrainingError
from baselines.network import Network
from baselines.ojas_tasks import push
from baselines.run import Progress, Run, Training, environment_kwargs
from baselines.vec_env import ResidualVecEnv, batched

with needs("rl"):
    from cmaes import CMA

POPULATION = 14
PUSHES = 16  # episodes of each candidate
SPREAD = 0.2  # of the first generation
DURATION = 5.5  # s, of an episode
_PUSH = {"push": [push({"choice": [15.0, 20.0, 25.0, 30.0]}, start={"uniform": [2.2, 3.2]})]}


@writes_folder
def tune(training: Training, out: str | Path, on_progress: Callable[[Progress], None] | None = None) -> Path:
    """Tune, or continue, and return the folder of the best gains so far; `steps` counts decisions.

    Raises:
        TrainingError: if `out` holds a run of another configuration, the robot has no such law, or the engine no batch.
    """
    config = training.config
    balanced = sorted(agent_of(config.robot).balanced)
    if not balanced:
        problem = f"has no law of the robot {config.robot!r} whose gains it could tune"
        raise TrainingError("algo", training.algo, "choose another one", problem)
    if config.action_mode not in balanced:
        raise TrainingError("action_mode", config.action_mode, f"{', '.join(balanced)}, of which the law has gains")
    run = Run(training, Path(out), on_progress)
    if not run.batched:
        raise TrainingError("engine", environment_kwargs(training).get("engine"), repr(run.task.batch_engine))
    kwargs = {**environment_kwargs(training), "duration": DURATION, "disturbances": _PUSH}
    env = batched(training.env_id, training.config, POPULATION * PUSHES, kwargs)
    residual = env.residual
    file = run.folder / "generations.json"
    told: list[dict[str, Any]] = []
    if file.exists():
        with wrap_read_errors("generations", file, "a file that `train` wrote", TrainingError):
            stored = json.loads(file.read_text(encoding="utf-8"))
            told = [{"costs": [float(cost) for cost in one["costs"]], "steps": int(one["steps"])}
                    for one in stored["generations"]]  # fmt: skip
            run.state |= {name: stored["state"][name] for name in run.state}
    run.begin(residual)
    strategy = CMA(np.zeros(GAINS), SPREAD, population_size=POPULATION, seed=training.seed)
    steps, generation = 0, 0
    while steps < training.steps and not strategy.should_stop():
        candidates = [strategy.ask() for _ in range(POPULATION)]
        if generation < len(told):
            costs = told[generation]["costs"]
            steps = told[generation]["steps"]
        else:
            seeds = np.random.SeedSequence([training.seed, generation]).generate_state(PUSHES, np.uint64).tolist()
            networks = [balance_network(gains, residual.features, residual.actions) for gains in candidates]
            costs, count = _judge(env, networks, seeds)
            steps += count
        strategy.tell(list(zip(candidates, costs, strict=True)))
        generation += 1
        if generation > len(told):
            told.append({"costs": costs, "steps": steps})
            if generation % training.test_every == 0:
                network = balance_network(_mean(strategy), residual.features, residual.actions)
                run.test(network, residual, steps, {"mean_cost": float(np.mean(costs))})
            text = json.dumps({"state": run.state, "generations": told})
            write_atomically(file, lambda stream, text=text: stream.write(text.encode()))
            run.report(steps, f"generation {generation}, mean cost {np.mean(costs):.3f}")
    env.close()
    return run.exported


def _mean(strategy: CMA) -> NDArray[np.float64]:
    return np.asarray(strategy.mean)


def _judge(env: ResidualVecEnv, networks: list[Network], seeds: list[int]) -> tuple[list[float], int]:
    """Of each candidate one minus its mean return up to a fall, by what can be had at most; decisions taken."""
    weights = np.repeat([network.layers[0][0] for network in networks], len(seeds), axis=0)
    law, config = networks[0], env.residual.config
    every = Network(law.mean, law.variance, ((weights, law.layers[0][1]),))  # a law of its own for each environment
    env.seed(seeds * len(networks))
    features: Any = env.reset()
    going = np.ones(env.num_envs, np.bool_)
    returns, count = np.zeros(env.num_envs), 0
    while going.any():
        features, rewards, done, _ = env.step(every(features))
        returns += np.where(going, rewards, 0.0)
        count += int(going.sum())
        going &= ~done
    most = (
        DURATION
        / config.decision_period
        * sum(scale for scale in env.residual.adapter.reward_scales.values() if scale > 0)
    )
    return (1.0 - returns.reshape(len(networks), -1).mean(axis=1) / most).tolist(), count
