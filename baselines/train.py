"""Training a residual with PPO or SAC, in intervals that can be continued after any interruption."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from artde_gym.errors import WorkerError
from artde_gym.evaluation.lock import writes_folder
from artde_gym.evaluation.workers import FEWER, GUARD, ignored_interrupt
from artde_gym.extras import needs
from artde_gym.layout import Layout
from baselines.checkpoint import Checkpoints
from baselines.errors import TrainingError
from baselines.export import exported
from baselines.residual import Residual
from baselines.residual_config import ResidualConfig
from baselines.residual_env import ResidualEnv
from baselines.rollouts import OpenRollouts
from baselines.run import Progress, Run, Training, environment_kwargs, single
from baselines.vec_env import batched

with needs("rl"):
    import tensorboard  # noqa: F401  # Stable-Baselines3 imports it only once a training has begun
    import torch
    from stable_baselines3 import PPO, SAC
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.logger import Logger, configure
    from stable_baselines3.common.utils import set_random_seed
    from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv, VecMonitor, VecNormalize

HIDDEN = (64, 64)
CRITIC = (256, 256)  # of SAC
HARDER, EASIER = 0.65, 0.4  # shares of training episodes without a fall: above, below which the level moves
ENDED = 8  # episodes that such a share needs
SAC_INTERVAL = 4096  # decisions between two checkpoints


@writes_folder
def train(training: Training, out: str | Path, on_progress: Callable[[Progress], None] | None = None) -> Path:
    """Train, or continue, and return the folder of the best policy so far.

    `out` holds `run.json` (what was asked for, versions), `checkpoints/`, `tensorboard/`, `learning_curve.csv` (a row
    a held-out test) and `policy/`, the best policy by the test's score.

    Raises:
        TrainingError: if `out` holds a run of another configuration, or for options that do not go together.
        OptionError, DisturbanceError, UnknownNameError, GainError: for a bad argument; nothing has been written then.
    """
    run = Run(training, Path(out), on_progress)
    env, residual = environments(training, run)
    try:
        trainer = Trainer(run, env, residual)
        run.begin(residual)
        trainer.go()
    finally:
        env.close()
    return run.exported


class Trainer:
    """A run's environments, model and checkpoints; `learn` is one interval, `go` all that are left."""

    def __init__(self, run: Run, env: VecEnv, residual: Residual) -> None:
        self.run, self.residual = run, residual
        training, task = run.training, run.task
        options = {**(task.ppo if training.algo == "ppo" else task.sac), **training.options}
        self.env = VecNormalize(VecMonitor(env), gamma=options["gamma"])
        try:
            self.model = _model(training, self.env, options, residual.features)
        except (AssertionError, TypeError, ValueError, MemoryError) as error:  # Stable-Baselines3's own checks
            raise TrainingError("options", options, f"arguments that go together ({error})") from error
        self.model.set_logger(Logger(None, []))  # the default one makes a folder, even without anything to write
        self.interval = SAC_INTERVAL
        if training.algo == "ppo":
            self.interval = task.rollouts * options["n_steps"] * env.num_envs
        self.checkpoints = Checkpoints(run.folder / "checkpoints")
        level = task.level if training.level is None else training.level
        state = self.checkpoints.restore(self.model, self.env) or {"interval": 0, "steps": 0, "level": level}
        self.number, self.steps, self.level = state["interval"], state["steps"], state["level"]
        run.state |= {name: state[name] for name in run.state if name in state}

    def go(self) -> None:
        run, training = self.run, self.run.training
        self.model.set_logger(configure(str(run.folder / "tensorboard"), ["tensorboard"]))
        self._report(self.steps)
        while self.steps < training.steps and run.state["stale"] < training.patience:
            self.learn()
            if self.number % training.test_every == 0 or self.steps >= training.steps:
                found = run.test(exported(self.model, self.env), self.residual, self.steps, {"level": self.level})
                self._log({f"test/{name}": value for name, value in found.items()})
            state = {"interval": self.number, "steps": self.steps, "level": self.level, **run.state}
            self.checkpoints.save(self.model, self.env, state)

    def learn(self) -> None:
        """One interval, from fresh episodes."""
        run, model = self.run, self.model
        words = np.random.SeedSequence([run.training.seed, self.number]).generate_state(2, np.uint64).tolist()
        set_random_seed(words[0] % 2**32)  # NumPy's old generator takes no more
        self.env.seed(words[1])
        disturbances = run.task.training(self.level)
        self.env.set_options({} if disturbances is None else {"disturbances": disturbances})
        model._last_obs = None  # so that `learn` resets the environments
        watcher, began = _Watcher(self._report), time.perf_counter()
        wanted = min(self.interval, run.training.steps - self.steps)
        model.learn(wanted, callback=watcher, reset_num_timesteps=False, log_interval=1)
        rate = (model.num_timesteps - self.steps) / (time.perf_counter() - began)
        survived = watcher.survived()
        if survived is not None:
            step = 0.1 if survived > HARDER else -0.05 if survived < EASIER else 0.0
            self.level = round(min(max(self.level + step, 0.0), 1.0), 3)
            self._log({"train/survived": survived})
        self.number, self.steps = self.number + 1, model.num_timesteps
        self._log({"train/level": self.level, "time/steps_per_second": rate})

    def _log(self, values: dict[str, float]) -> None:
        for name, value in values.items():
            self.model.logger.record(name, value)
        self.model.logger.dump(self.model.num_timesteps)

    def _report(self, steps: int) -> None:
        self.run.report(steps, f"interval {self.number}, level {self.level:g}")


class _Watcher(BaseCallback):
    """Counts how training episodes end, and tells of progress."""

    def __init__(self, on_steps: Callable[[int], None]) -> None:
        super().__init__()
        self._on_steps = on_steps
        self._ended, self._fell, self._told = 0, 0, 0

    def _on_step(self) -> bool:
        for i in np.flatnonzero(self.locals["dones"]):
            self._ended += 1
            self._fell += not self.locals["infos"][i].get("TimeLimit.truncated", False)
        if self.num_timesteps - self._told >= 1000:
            self._told = self.num_timesteps
            self._on_steps(self.num_timesteps)
        return True

    def survived(self) -> float | None:
        """Share of the episodes that ended without a fall; None if hardly any ended."""
        return 1.0 - self._fell / self._ended if self._ended >= ENDED else None


def environments(training: Training, run: Run) -> tuple[VecEnv, Residual]:
    """Environments of a training, and the residual that they share."""
    task = run.task
    disturbances = task.training(task.level)  # else the environment's own, of which it might warn
    kwargs = environment_kwargs(training) | ({} if disturbances is None else {"disturbances": disturbances})
    if run.batched:
        env = batched(training.env_id, training.config, training.envs or task.envs, kwargs)
        return env, env.residual
    count = training.envs or training.workers
    makers: list[Callable[[], gym.Env[Any, Any]]] = [
        functools.partial(_worker_env, training.env_id, kwargs, training.config) for _ in range(count)
    ]
    residual = single(training.env_id, kwargs, training.config).residual
    return (DummyVecEnv(makers) if training.workers == 1 else _processes(makers)), residual


def _processes(makers: list[Callable[[], gym.Env[Any, Any]]]) -> VecEnv:
    """Environments in processes of their own."""
    try:
        with ignored_interrupt():
            return SubprocVecEnv(makers, start_method="spawn")
    except (EOFError, ConnectionError) as error:  # it does not say what its processes ended with
        todo = f"{FEWER}; or use {GUARD}"
        raise WorkerError("worker processes", "ended when they had just started", todo) from error


def _worker_env(env_id: str, kwargs: dict[str, Any], config: ResidualConfig) -> ResidualEnv:
    torch.set_num_threads(1)
    return single(env_id, kwargs, config)


def _model(training: Training, env: VecNormalize, options: dict[str, Any], features: Layout) -> Any:
    policy: dict[str, Any] = {"activation_fn": torch.nn.Tanh, "net_arch": list(HIDDEN)}
    common: dict[str, Any] = {"device": "cpu", "seed": training.seed}
    if training.algo == "sac":
        policy["net_arch"] = {"pi": list(HIDDEN), "qf": list(CRITIC)}
        return SAC("MlpPolicy", env, policy_kwargs=policy, **options, **common)
    own = ("log_std_init", "net_arch")
    policy |= {name: options[name] for name in own if name in options}
    others = {name: value for name, value in options.items() if name not in own}
    if "gate" in features.slices:

        def gate(seen: NDArray[Any]) -> NDArray[Any]:
            at = features["gate"].start
            statistics: Any = env.obs_rms
            return seen[:, at] * np.sqrt(statistics.var[at]) + statistics.mean[at]

        others |= {"rollout_buffer_class": OpenRollouts, "rollout_buffer_kwargs": {"gate": gate}}
    return PPO("MlpPolicy", env, policy_kwargs=policy, **others, **common)
