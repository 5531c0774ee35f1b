"""A training run: what is trained, its folder, and its tests on held-out seeds. Nothing here needs torch."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import platform
import tempfile
from collections.abc import Callable, Mapping
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

import artde_gym
from artde_gym.arguments import check_number, wrap_read_errors
from artde_gym.deprecation import current_configuration, renamed_arguments
from artde_gym.errors import suggest_names
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.cells import cells_of, validate_cell
from artde_gym.evaluation.environments import with_engine
from artde_gym.evaluation.store import write_atomically
from artde_gym.evaluation.workers import check_workers
from baselines.errors import TrainingError
from baselines.network import Network
from baselines.options import ALGORITHMS, check_options
from baselines.policy_file import Saved, layout_hash, save
from baselines.residual import Residual, ResidualPolicy
from baselines.residual_config import ResidualConfig
from baselines.residual_env import ResidualEnv
from baselines.saved import EXPORT, load, nominal_name
from baselines.tasks import HELD_OUT, task

RECORD = "run.json"
LARGEST_SEED = 2**32 - 1  # that NumPy's older generators take, and with them Stable-Baselines3 and CMA-ES
LABELS = {"cma-es": "balance"}
"""What stands behind the base's name in that of a policy, where it is not the algorithm."""


@renamed_arguments({"recipe": "config"})
@dataclasses.dataclass(frozen=True)
class Training:
    """Configuration of a training; the same one resumes its run, also with more steps or other options.

    Attributes:
        env_id: of the environment.
        config: of the residual.
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
    config: ResidualConfig
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
            raise TrainingError("algo", self.algo, suggest_names(self.algo, ALGORITHMS))
        counts = {"steps": self.steps, "workers": self.workers, "test_every": self.test_every, "envs": self.envs or 1}
        for field, value in {**counts, "patience": self.patience}.items():
            if not (type(value) is int and value >= 1):
                raise TrainingError(field, value, "a whole number >= 1")
        if not (type(self.seed) is int and 0 <= self.seed <= LARGEST_SEED):
            raise TrainingError("seed", self.seed, f"a whole number from 0 to {LARGEST_SEED}")
        if self.level is not None:
            check_number("level", self.level, 0.0, 1.0, "a number from 0 to 1, or None")
        if self.config.robot != task(self.env_id).robot:
            raise TrainingError("robot of the residual", self.config.robot, f"{task(self.env_id).robot!r}")
        check_options(self.algo, self.options)


class Progress(NamedTuple):
    """News of a training: decisions done and wanted, and a line of text."""

    steps: int
    wanted: int
    text: str


class Run:
    """A run and its folder, which `begin` claims; until then nothing is written.

    Args:
        training: what is trained.
        folder: of the run.
        on_progress: called now and then.

    Attributes:
        state: what of the tests a checkpoint has to hold: `best` score, `stale` tests since, all `tests`.

    Raises:
        TrainingError: if the folder holds a run of another configuration.
        OptionError, DisturbanceError, gymnasium.error.Error: for arguments that the environment does not take.
    """

    def __init__(self, training: Training, folder: Path, on_progress: Callable[[Progress], None] | None = None) -> None:
        check_workers(training.workers)
        self.training, self.folder, self.task = training, folder, task(training.env_id)
        self._on_progress = on_progress or (lambda _: None)
        self.state: dict[str, Any] = {"best": None, "stale": 0, "tests": []}
        self._configuration = _plain(training) | {"engine": environment_kwargs(training).get("engine")}
        _refuse_others(folder, self._configuration, {"workers"} if self.batched else set())
        (cell,) = cells_of(training.env_id, None, environment_kwargs(training), self.task.test, self.vectorized)
        validate_cell(self.vectorized, cell)

    @property
    def batched(self) -> bool:
        """True if all environments are one vector: in the task's engine, if it names one."""
        engine = self.task.batch_engine
        if self.task.batch is None:
            return False
        return engine is None or environment_kwargs(self.training).get("engine") == engine

    @property
    def vectorized(self) -> bool:
        """True if the held-out tests run in a vector environment."""
        return self.batched

    @property
    def exported(self) -> Path:
        """Folder of the best policy so far."""
        return self.folder / EXPORT

    def report(self, steps: int, text: str) -> None:
        """Tell of progress."""
        best = self.state["best"]
        text += "" if best is None else f", best test {best:.4g}"
        self._on_progress(Progress(min(steps, self.training.steps), self.training.steps, text))

    def begin(self, residual: Residual) -> None:
        """Make the folder this run's, once a held-out episode without a residual has shown that tests will work.

        Raises:
            TrainingError: for a base that a policy's file could not hold.
        """
        if isinstance(residual.base, ResidualPolicy):
            problem = "is a trained policy, which a policy's file cannot hold"
            raise TrainingError("base", self.training.config.base, "choose a law", problem)
        if not self.state["tests"]:
            size, count = residual.features.size, len(residual.actions)
            layer = np.zeros((size, count), np.float32), np.zeros(count, np.float32)
            nothing = Network(np.zeros(size, np.float32), np.ones(size, np.float32), (layer,))
            with tempfile.TemporaryDirectory() as folder:
                self._judge(self._saved(nothing, residual, 0), Path(folder), 1, 1)
        _claim(self.folder, self._configuration)

    def test(self, network: Network, residual: Residual, steps: int, more: Mapping[str, float]) -> dict[str, float]:
        """Judge a network on the held-out episodes, and keep it if it is the best so far; returns what was found."""
        state, saved = self.state, self._saved(network, residual, steps)
        found = self._judge(saved, self.folder / "candidate", self.task.episodes, self.training.workers)
        score = found["score"]
        found = {"steps": steps, **found, **more}
        state["tests"].append(found)
        _write_rows(self.folder / "learning_curve.csv", state["tests"])
        if state["best"] is None or score > state["best"]:
            state["best"], state["stale"] = score, 0
            save(self.exported, saved)
        else:
            state["stale"] += 1
        return found

    def _judge(self, saved: Saved, folder: Path, episodes: int, workers: int) -> dict[str, float]:
        """Score and means of a policy on the first held-out episodes, by way of its file in `folder`."""
        save(folder, saved)
        rows = evaluate(
            [load(folder)],
            self.training.env_id,
            disturbances=self.task.test,
            env_kwargs=environment_kwargs(self.training),
            episodes=episodes,
            seed=HELD_OUT,
            workers=workers,
            vectorized=self.vectorized,
        ).episodes
        means = {name: float(np.mean(rows[name].to_numpy())) for name in _SHOWN if name in rows}
        return {"score": self.task.score(rows), **means}

    def _saved(self, network: Network, residual: Residual, steps: int) -> Saved:
        training, kwargs = self.training, environment_kwargs(self.training)
        return Saved(
            f"{training.config.base}+{LABELS.get(training.algo, training.algo)}",
            residual.config,
            network,
            layout_hash(residual.features),
            tuple(residual.actions),
            residual.config.decision_period / residual.periods,
            nominal_name(training.config.robot, kwargs),
            {
                "algorithm": training.algo,
                "env_id": training.env_id,
                "env_kwargs": kwargs,
                "steps": steps,
                "seed": training.seed,
                "versions": versions(),
            },
        )


_SHOWN = ("fell", "duration_s", "rmse_m", "reward")


def environment_kwargs(training: Training) -> dict[str, Any]:
    """Arguments of the training's environments."""
    known = task(training.env_id)
    given = {**known.kwargs, **training.env_kwargs}
    return given if known.batch_engine is None else with_engine(training.env_id, given)  # else a batch is an engine


def single(env_id: str, kwargs: dict[str, Any], config: ResidualConfig) -> ResidualEnv:
    """One environment for an agent."""
    return ResidualEnv(gym.make(env_id, disable_env_checker=True, **kwargs), config)


def _plain(training: Training) -> dict[str, Any]:
    """Return a training in JSON's types.

    Raises:
        TrainingError: for values that JSON cannot write.
    """
    try:
        return json.loads(json.dumps(dataclasses.asdict(training)))
    except (TypeError, ValueError) as error:
        given = {"env_kwargs": training.env_kwargs, "options": training.options}
        raise TrainingError("training", given, f"values that JSON can write ({error})") from error


def _refuse_others(folder: Path, configuration: dict[str, Any], free: set[str]) -> None:
    """See that a folder holds no run but this one; what `free` names may change, as may steps, options and patience."""
    file = folder / RECORD
    if not file.exists():
        return
    with wrap_read_errors("run", file, "a file that `train` wrote", TrainingError):
        before = current_configuration(json.loads(file.read_text(encoding="utf-8"))["configuration"])
    for name, value in configuration.items():
        if name not in {"steps", "options", "patience", *free} and before.get(name) != value:
            problem = f"differs from {before.get(name)!r} of the run in {folder}"
            raise TrainingError(name, value, "choose another folder", problem)


def _claim(folder: Path, configuration: dict[str, Any]) -> None:
    """Make a folder this run's, if it is not yet."""
    if not (folder / RECORD).exists():
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"configuration": configuration, "versions": versions()}, indent=1)
        write_atomically(folder / RECORD, lambda file: file.write(text.encode()))


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


def _write_rows(path: Path, rows: list[dict[str, Any]]) -> None:
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(rows[0]))
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, lambda file: file.write(text.getvalue().encode()))
