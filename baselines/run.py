"""A training run: what is trained, its folder, and its tests on held-out seeds. Nothing here needs torch."""

from __future__ import annotations

import csv
import dataclasses
import json
import platform
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

import artde_gym
from artde_gym.arguments import reading
from artde_gym.errors import among
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.environments import with_engine
from baselines.errors import TrainingError
from baselines.network import Network
from baselines.policy_file import Saved, layout_hash, save
from baselines.recipe import Recipe
from baselines.residual import Residual
from baselines.residual_env import ResidualEnv
from baselines.saved import EXPORT, load, nominal_name
from baselines.tasks import HELD_OUT, task

ALGORITHMS = ("ppo", "sac", "cma-es")
LABELS = {"cma-es": "balance"}
"""What stands behind the base's name in that of a policy, where it is not the algorithm."""


@dataclasses.dataclass(frozen=True)
class Training:
    """What is trained; the same configuration continues its run, also with more steps or other options.

    Attributes:
        env_id: of the environment.
        recipe: of the residual.
        algo: "ppo", "sac", or "cma-es" for the gains of the linear balance law.
        steps: decisions of the agent, all environments together.
        seed: of everything.
        env_kwargs: arguments of the environment on top of the task's.
        options: arguments of the algorithm on top of the task's.
        envs: number of environments; None for the task's in a batch, or the number of workers.
        workers: processes of environments that are no batch; of a batch, those of its held-out tests alone.
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


class Run:
    """A run in its folder.

    Args:
        training: what is trained.
        folder: claimed for it.
        on_progress: called now and then.

    Attributes:
        state: what of the tests a checkpoint has to hold: `best` score, `stale` tests since, all `tests`.

    Raises:
        TrainingError: if the folder holds a run of another configuration.
    """

    def __init__(self, training: Training, folder: Path, on_progress: Callable[[Progress], None] | None = None) -> None:
        self.training, self.folder, self.task = training, folder, task(training.env_id)
        self._on_progress = on_progress or (lambda _: None)
        self.state: dict[str, Any] = {"best": None, "stale": 0, "tests": []}
        configuration = {**dataclasses.asdict(training), "engine": environment_kwargs(training).get("engine")}
        _claim(folder, json.loads(json.dumps(configuration)), {"workers"} if self.batched else set())

    @property
    def batched(self) -> bool:
        """Whether all environments are one batch: quadrotors always, bipeds in MuJoCo."""
        engine = self.task.batch_engine
        return engine is None or environment_kwargs(self.training).get("engine") == engine

    @property
    def exported(self) -> Path:
        """Folder of the best policy so far."""
        return self.folder / EXPORT

    def report(self, steps: int, text: str) -> None:
        """Tell of progress."""
        best = self.state["best"]
        text += "" if best is None else f", best test {best:.4g}"
        self._on_progress(Progress(min(steps, self.training.steps), self.training.steps, text))

    def test(self, network: Network, residual: Residual, steps: int, more: Mapping[str, float]) -> dict[str, float]:
        """Judge a network on the held-out episodes, and keep it if it is the best so far; returns what was found."""
        training, state = self.training, self.state
        kwargs = environment_kwargs(training)
        saved = Saved(
            f"{training.recipe.base}+{LABELS.get(training.algo, training.algo)}",
            training.recipe,
            network,
            layout_hash(residual.features),
            tuple(residual.actions),
            residual.recipe.hold / residual.periods,
            nominal_name(training.recipe.robot, kwargs),
            {
                "algorithm": training.algo,
                "env_id": training.env_id,
                "env_kwargs": kwargs,
                "steps": steps,
                "seed": training.seed,
                "versions": versions(),
            },
        )
        candidate = self.folder / "candidate"
        save(candidate, saved)
        rows = evaluate(
            [load(candidate)],
            training.env_id,
            disturbances=self.task.test,
            env_kwargs=kwargs,
            episodes=self.task.episodes,
            seed=HELD_OUT,
            workers=training.workers,
            backend="batch" if self.batched else "single",
        ).episodes
        score = self.task.score(rows)
        means = {name: float(np.mean(rows[name].to_numpy())) for name in _SHOWN if name in rows}
        found = {"steps": steps, "score": score, **means, **more}
        state["tests"].append(found)
        _write_rows(self.folder / "learning_curve.csv", state["tests"])
        if state["best"] is None or score > state["best"]:
            state["best"], state["stale"] = score, 0
            save(self.exported, saved)
        else:
            state["stale"] += 1
        return found


_SHOWN = ("fell", "duration_s", "rmse_m", "reward")


def environment_kwargs(training: Training) -> dict[str, Any]:
    """Arguments of the training's environments."""
    known = task(training.env_id)
    given = {**known.kwargs, **training.env_kwargs}
    return given if known.batch_engine is None else with_engine(training.env_id, given)  # else a batch is an engine


def single(env_id: str, kwargs: dict[str, Any], recipe: Recipe) -> ResidualEnv:
    """One environment for an agent."""
    return ResidualEnv(gym.make(env_id, disable_env_checker=True, **kwargs), recipe)


def _claim(folder: Path, configuration: dict[str, Any], free: set[str]) -> None:
    """Make a folder this run's, or see that it is; what `free` names may change, as may steps, options and patience."""
    file = folder / "run.json"
    if not file.exists():
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps({"configuration": configuration, "versions": versions()}, indent=1))
        return
    with reading("run", file, "a file that `train` wrote", TrainingError):
        before = dict(json.loads(file.read_text(encoding="utf-8"))["configuration"])
    for name, value in configuration.items():
        if name not in {"steps", "options", "patience", *free} and before.get(name) != value:
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


def _write_rows(file: Path, rows: list[dict[str, Any]]) -> None:
    with file.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
