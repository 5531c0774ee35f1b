"""Time of a policy's call and speed of training: sections of `artde-gym benchmark`."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym

from artde_gym.arrays import Array
from artde_gym.benchmark.figure import Figure, Section
from artde_gym.benchmark.timing import Job, in_turns
from artde_gym.errors import MissingDependencyError
from baselines.agent import AGENTS
from baselines.policy_file import DESCRIPTION, read
from baselines.residual_config import ResidualConfig
from baselines.run import Run, Training
from baselines.saved import SHIPPED, load
from baselines.tasks import task as task_of

DECISIONS = 20  # of a turn
ROUNDS = 40
ROLLOUTS = 4  # of PPO that are timed
CALL = 100.0  # us
OVERHEAD = 0.25


def inference(quick: bool) -> Section:
    """Microseconds of a shipped policy's call, beside its base's and its network's alone."""
    figures: list[Figure] = []
    for folder in sorted(file.parent for file in SHIPPED.glob(f"*/{DESCRIPTION}")):
        times = _times(folder, ROUNDS // 10 if quick else ROUNDS)
        figures += [
            Figure(f"{folder.name}: a call, every control period", times["policy"], "us", most=CALL),
            Figure(f"{folder.name}: what the residual adds to its base", times["policy"] - times["base"], "us"),
            Figure(f"{folder.name}: its network alone, every decision", times["network"], "us"),
        ]
    text = "Mean of `predict` over whole decisions of a closed loop, one environment, one core, NumPy alone."
    return Section("Inference of trained policies", text, tuple(figures))


def _times(folder: Path, rounds: int) -> dict[str, float]:
    """us of a call of the policy, of its base and of its network."""
    saved = read(folder)
    env: Any = gym.make(saved.about["env_id"], disable_env_checker=True).unwrapped
    policy = load(folder, env)
    residual = policy.residual
    periods = residual.periods
    observations, features = _flight(env, policy, DECISIONS * periods)
    env.close()

    def calls(predict: Callable[..., Any]) -> Callable[[], Job]:
        def job() -> None:
            state = None
            for observation in observations:
                _, state = predict(observation, state)

        return lambda: job

    def network() -> None:
        for seen in features:
            policy.actor(seen)

    variants = {"policy": calls(policy.predict), "base": calls(residual.base.predict), "network": lambda: network}
    seconds = in_turns(variants, rounds)
    counts = {"policy": len(observations), "base": len(observations), "network": len(features)}
    return {name: 1e6 * seconds[name] / count for name, count in counts.items()}


def _flight(env: Any, policy: Any, steps: int) -> tuple[list[Array], list[Array]]:
    """Record a policy's observations at the start of an episode and its network's actions."""
    observations: list[Array] = []
    features: list[Array] = []
    observation, _ = env.reset(seed=0)
    state = None
    for k in range(steps):
        observations.append(observation)
        if k % policy.residual.periods == 0:
            memory = policy.residual.start(observation) if state is None else state.residual
            features.append(policy.residual.observe(observation, memory)[0])
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
    return observations, features


def training(quick: bool) -> Section:
    """Decisions a second on one core, and the share of computing outside physics and network."""
    title, text = "Training with PPO", "Decisions of the agent, learning included, in the task's batch, on one core."
    try:
        tasks = [env_id for agent in AGENTS.values() for env_id in agent.tasks]
        figures = [figure for env_id in tasks for figure in _throughput(env_id, 1 if quick else ROLLOUTS)]
    except MissingDependencyError as error:
        return Section(title, text, skipped=str(error))
    return Section(title, text, tuple(figures))


def _throughput(env_id: str, rollouts: int) -> list[Figure]:
    from baselines.train import Trainer, environments  # torch is heavy, and may not be installed

    task = task_of(env_id)
    kwargs = {} if task.batch_engine is None else {"engine": task.batch_engine}
    run_of = Training(env_id, ResidualConfig(task.robot), env_kwargs=kwargs)
    with tempfile.TemporaryDirectory() as folder:
        run = Run(run_of, Path(folder))
        env, residual = environments(run_of, run)
        trainer = Trainer(run, env, residual)
        trainer.interval = rollouts * task.ppo["n_steps"] * env.num_envs
        inside = _Clock()
        batch: Any = env
        for owner, name in (
            (batch.env, "step"),
            (batch.env, "reset"),
            (trainer.model.policy, "forward"),
            (trainer.model, "train"),
        ):
            setattr(owner, name, inside.timed(getattr(owner, name)))
        began = time.process_time()
        trainer.learn()
        seconds = time.process_time() - began
        env.close()
    return [
        Figure(f"{env_id}: decisions", trainer.steps / seconds, "1/s"),
        Figure(f"{env_id}: share outside physics and network", 1.0 - inside.seconds / seconds, most=OVERHEAD),
    ]


class _Clock:
    """Adds up computing time spent in some functions."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def timed(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Wrap a function so that its time is counted."""

        def call(*args: Any, **kwargs: Any) -> Any:
            began = time.process_time()
            try:
                return function(*args, **kwargs)
            finally:
                self.seconds += time.process_time() - began

        return call
