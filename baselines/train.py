"""Training a residual with PPO or SAC, in intervals that can be continued after any interruption."""

from __future__ import annotations

import csv
import dataclasses
import functools
import json
import platform
import time
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import pandas as pd
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.utils import set_random_seed
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv, VecMonitor, VecNormalize

import artde_gym
from artde_gym.errors import among
from artde_gym.evaluation import evaluate
from baselines.checkpoint import Checkpoints
from baselines.errors import TrainingError
from baselines.export import exported
from baselines.policy_file import Saved, layout_hash, save
from baselines.recipe import Recipe
from baselines.residual_env import ResidualEnv
from baselines.saved import EXPORT, load, nominal_name
from baselines.tasks import HELD_OUT, Task, task
from baselines.vec_env import ResidualVecEnv

ALGORITHMS = ("ppo", "sac")
HIDDEN = (64, 64)
CRITIC = (256, 256)  # of SAC
HARDER, EASIER = 0.8, 0.5  # shares of training episodes without a fall: above, below which the level moves


@dataclasses.dataclass(frozen=True)
class Training:
    """What is trained; the same configuration continues its run.

    Attributes:
        env_id: of the environment.
        recipe: of the residual.
        algo: "ppo" or "sac".
        steps: decisions of the agent, all environments together.
        seed: of everything.
        env_kwargs: arguments of the environment on top of the task's.
        options: arguments of the algorithm on top of the task's.
        envs: number of environments; None for the task's, or the number of workers.
        workers: processes of environments; the batched quadrotor takes one.
        test_every: intervals between two held-out tests.
        patience: tests without a better score after which the training ends.
        level: difficulty at the start; None for the task's.

    Raises:
        TrainingError, OptionError: for a value that is not allowed.
    """

    env_id: str
    recipe: Recipe
    algo: str = "ppo"
    steps: int = 1_000_000
    seed: int = 0
    env_kwargs: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    options: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    envs: int | None = None
    workers: int = 1
    test_every: int = 4
    patience: int = 20
    level: float | None = None

    def __post_init__(self) -> None:
        if self.algo not in ALGORITHMS:
            raise TrainingError("algo", self.algo, among(self.algo, ALGORITHMS))
        counts = {"steps": self.steps, "workers": self.workers, "test_every": self.test_every, "envs": self.envs or 1}
        for field, value in {**counts, "patience": self.patience}.items():
            if not (isinstance(value, int) and value >= 1):
                raise TrainingError(field, value, "a whole number >= 1")
        if not (isinstance(self.seed, int) and self.seed >= 0):
            raise TrainingError("seed", self.seed, "a whole number >= 0")
        if self.recipe.robot != task(self.env_id).robot:
            raise TrainingError("robot of the recipe", self.recipe.robot, f"{task(self.env_id).robot!r}")


class Progress(NamedTuple):
    """News of a training: decisions done and wanted, and a line of text."""

    steps: int
    wanted: int
    text: str


def train(training: Training, out: str | Path, on_progress: Callable[[Progress], None] | None = None) -> Path:
    """Train, or continue, and return the folder of the best policy so far.

    `out` holds `run.json` (what was asked for, versions), `checkpoints/`, `tensorboard/`, `learning_curve.csv` (a row
    a held-out test) and `policy/`, the best policy by the test's score.

    Raises:
        TrainingError: if `out` holds a run of another configuration.
    """
    folder = Path(out)
    configuration = json.loads(json.dumps(dataclasses.asdict(training)))
    _claim(folder, configuration)
    own = task(training.env_id)
    env, residual = _environment(training, own)
    try:
        return _Run(training, folder, own, env, residual, on_progress or (lambda _: None)).go()
    finally:
        env.close()


class _Run:
    def __init__(
        self,
        training: Training,
        folder: Path,
        own: Task,
        env: VecEnv,
        residual: Any,
        on_progress: Callable[[Progress], None],
    ) -> None:
        self.training, self.folder, self.task, self.residual = training, folder, own, residual
        self.on_progress = on_progress
        options = {**(own.ppo if training.algo == "ppo" else own.sac), **training.options}
        self.gamma = options["gamma"]
        self.env = VecNormalize(VecMonitor(env), gamma=self.gamma)
        self.model = _model(training, self.env, options)
        self.model.set_logger(configure(str(folder / "tensorboard"), ["tensorboard"]))
        self.checkpoints = Checkpoints(folder / "checkpoints")
        state = self.checkpoints.restore(self.model, self.env)
        level = own.level if training.level is None else training.level
        self.state = state or {"interval": 0, "steps": 0, "level": level, "best": None, "stale": 0, "tests": []}
        rollout = options.get("n_steps", 128) * env.num_envs
        self.interval = own.rollouts * rollout if training.algo == "ppo" else max(2048, rollout)

    def go(self) -> Path:
        state = self.state
        self._report()
        while state["steps"] < self.training.steps and state["stale"] < self.training.patience:
            self._learn()
            if state["interval"] % self.training.test_every == 0 or state["steps"] >= self.training.steps:
                self._test()
            self.checkpoints.save(self.model, self.env, state)
        return self.folder / EXPORT

    def _learn(self) -> None:
        """One interval, from fresh episodes."""
        state, model = self.state, self.model
        entropy = np.random.SeedSequence([self.training.seed, state["interval"]])
        seed, env_seed = (int(word) for word in entropy.generate_state(2) >> 1)
        set_random_seed(seed)
        self.env.seed(env_seed)
        self.env.set_options({"disturbances": self.task.training(state["level"])})
        model._last_obs = None  # noqa: SLF001  # so that `learn` resets the environments
        model._last_original_obs = None  # noqa: SLF001
        watcher = _Watcher(lambda steps: self._report(steps))
        before, began = model.num_timesteps, time.perf_counter()
        wanted = min(self.interval, self.training.steps - state["steps"])
        model.learn(wanted, callback=watcher, reset_num_timesteps=False, log_interval=1)
        elapsed = time.perf_counter() - began
        survived = watcher.survived()
        if survived is not None:
            step = 0.1 if survived > HARDER else -0.05 if survived < EASIER else 0.0
            state["level"] = round(min(max(state["level"] + step, 0.0), 1.0), 3)
        state["interval"] += 1
        state["steps"] = model.num_timesteps
        logger = model.logger
        logger.record("train/level", state["level"])
        logger.record("train/survived", float("nan") if survived is None else survived)
        logger.record("time/steps_per_second", (model.num_timesteps - before) / elapsed)
        logger.dump(model.num_timesteps)

    def _test(self) -> None:
        """Judge the policy on held-out seeds, and keep it if it is the best so far."""
        state, training = self.state, self.training
        network = exported(self.model, self.env)
        about = {
            "algorithm": training.algo,
            "env_id": training.env_id,
            "steps": state["steps"],
            "seed": training.seed,
            "versions": versions(),
        }
        kwargs = {**self.task.kwargs, **training.env_kwargs}
        saved = Saved(
            f"{training.recipe.base}+{training.algo}",
            training.recipe,
            network,
            layout_hash(self.residual.features),
            tuple(self.residual.actions),
            kwargs.get("control_period", _PERIODS[training.recipe.robot]),
            nominal_name(training.recipe.robot, kwargs),
            about,
        )
        candidate = self.folder / "candidate"
        save(candidate, saved)
        result = evaluate(
            [load(candidate)],
            training.env_id,
            disturbances=self.task.test,
            env_kwargs=kwargs,
            episodes=self.task.episodes,
            seed=HELD_OUT,
            workers=training.workers,
            backend="batch" if self.task.batched else "single",
        )
        score = self.task.score(result.episodes)
        row = {"steps": state["steps"], "level": state["level"], "score": score, **_means(result.episodes)}
        state["tests"].append(row)
        _write_rows(self.folder / "learning_curve.csv", state["tests"])
        for name, value in row.items():
            self.model.logger.record(f"test/{name}", value)
        self.model.logger.dump(state["steps"])
        if state["best"] is None or score > state["best"]:
            state["best"], state["stale"] = score, 0
            save(self.folder / EXPORT, saved)
        else:
            state["stale"] += 1

    def _report(self, steps: int | None = None) -> None:
        state = self.state
        best = "" if state["best"] is None else f", best test {state['best']:.4g}"
        text = f"interval {state['interval']}, level {state['level']:g}{best}"
        done = state["steps"] if steps is None else steps
        self.on_progress(Progress(min(done, self.training.steps), self.training.steps, text))


class _Watcher(BaseCallback):
    """Counts how training episodes end, and tells of progress."""

    def __init__(self, on_steps: Callable[[int], None]) -> None:
        super().__init__()
        self._on_steps = on_steps
        self._ended, self._fell, self._told = 0, 0, 0

    def _on_step(self) -> bool:
        dones = self.locals["dones"]
        if dones.any():
            for i in np.flatnonzero(dones):
                self._ended += 1
                self._fell += not self.locals["infos"][i].get("TimeLimit.truncated", False)
        if self.num_timesteps - self._told >= 1000:
            self._told = self.num_timesteps
            self._on_steps(self.num_timesteps)
        return True

    def survived(self) -> float | None:
        """Share of the episodes that ended without a fall; None if hardly any ended."""
        return 1.0 - self._fell / self._ended if self._ended >= 8 else None


_PERIODS = {"ojas": 0.001, "q450": 0.015}


def _environment(training: Training, own: Task) -> tuple[VecEnv, Any]:
    """Environments of a training, and the residual that they share."""
    kwargs = {**own.kwargs, **training.env_kwargs}
    if own.batched:
        kwargs.pop("engine", None)
        count = training.envs or own.envs or 1
        batch = gym.make_vec(
            training.env_id, count, vectorization_mode="vector_entry_point", dtype="float32", **kwargs
        )
        env = ResidualVecEnv(batch, training.recipe)
        return env, env.residual
    count = training.envs or training.workers
    makers = [functools.partial(_single, training.env_id, kwargs, training.recipe)] * count
    residual = makers[0]().residual
    if training.workers == 1:
        return DummyVecEnv(makers), residual
    return SubprocVecEnv(makers, start_method="spawn"), residual


def _single(env_id: str, kwargs: dict[str, Any], recipe: Recipe) -> ResidualEnv:
    torch.set_num_threads(1)
    return ResidualEnv(gym.make(env_id, disable_env_checker=True, **kwargs), recipe)


def _model(training: Training, env: VecNormalize, options: dict[str, Any]) -> Any:
    options = dict(options)
    common: dict[str, Any] = {"device": "cpu", "seed": training.seed}
    if training.algo == "ppo":
        architecture = {"net_arch": list(HIDDEN), "activation_fn": torch.nn.Tanh}
        return PPO("MlpPolicy", env, policy_kwargs={**architecture, "log_std_init": options.pop("log_std_init")},
                   **options, **common)
    architecture = {"net_arch": {"pi": list(HIDDEN), "qf": list(CRITIC)}, "activation_fn": torch.nn.Tanh}
    return SAC("MlpPolicy", env, policy_kwargs=architecture, **options, **common)


def _claim(folder: Path, configuration: dict[str, Any]) -> None:
    """Make a folder this run's, or see that it is. A longer run may continue a shorter one."""
    file = folder / "run.json"
    if not file.exists():
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps({"configuration": configuration, "versions": versions()}, indent=1))
        return
    before = json.loads(file.read_text())["configuration"]
    for name, value in configuration.items():
        if name != "steps" and before.get(name) != value:
            raise TrainingError(f"{name} of the run in {folder}", value, f"{before.get(name)!r}, or another folder")


def versions() -> dict[str, str]:
    """Of what a training depends on."""
    packages = ("gymnasium", "numpy", "pybullet", "stable-baselines3", "torch", "mujoco")
    known = {name: metadata.version(name) for name in packages if _installed(name)}
    return {"python": platform.python_version(), "artde-gym": artde_gym.__version__, **known}


def _installed(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


def _means(rows: pd.DataFrame) -> dict[str, float]:
    return {name: float(rows[name].mean()) for name in ("fell", "duration_s", "rmse_m", "reward") if name in rows}


def _write_rows(file: Path, rows: list[dict[str, Any]]) -> None:
    with file.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
