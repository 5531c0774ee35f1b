"""Training and its measurement leave no logs in the folder for temporary files."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")

from baselines.residual_config import ResidualConfig
from baselines.run import Run, Training
from baselines.train import Trainer, environments

TINY: dict[str, Any] = {"envs": 2, "env_kwargs": {"duration": 0.1}, "test_every": 100}
OPTIONS: dict[str, dict[str, Any]] = {
    "ppo": {"n_steps": 8, "batch_size": 16},
    "sac": {"learning_starts": 8, "buffer_size": 64},
}


@pytest.mark.parametrize("algo", OPTIONS)
def test_a_training_leaves_no_folder_behind(algo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    training = Training("QuadInfinity-Payload-v0", ResidualConfig("q450"), algo=algo, options=OPTIONS[algo], **TINY)
    run = Run(training, tmp_path / "run")
    env, residual = environments(training, run)
    trainer = Trainer(run, env, residual)
    trainer.interval = 16
    trainer.learn()  # alone, as the benchmark measures it
    env.close()
    assert not list(temporary.glob("SB3*"))  # PyTorch may keep a cache there
