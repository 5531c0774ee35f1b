"""What docs/determinism.md promises of an evaluation: the same file, byte by byte."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from artde_gym.evaluation import evaluate
from artde_gym.evaluation.tasks import Update

TASKS = importlib.import_module("artde_gym.evaluation.tasks")
CASES: dict[str, dict[str, Any]] = {
    "biped in bullet": {
        "scenario": "S2-L4",
        "env_kwargs": {"duration": 0.4, "actuator_inertia": "lumped", "engine": "bullet"},
    },
    "biped in mujoco": {"scenario": "S2-L4", "env_kwargs": {"duration": 0.4, "engine": "mujoco"}},
    "quadrotor in bullet": {"scenario": "Q1-gale", "env_kwargs": {"duration": 0.9, "engine": "bullet"}},
    "quadrotors in batch": {"scenario": "Q1-gale", "env_kwargs": {"duration": 0.9}, "vectorized": True},
}


def table(folder: Path, case: dict[str, Any], **options: Any) -> bytes:
    evaluate(["tde", "artde"], episodes=2, seed=5, out=folder, **case, **options)
    return (folder / "episodes.csv").read_bytes()


def table_of_a_command(folder: Path, case: dict[str, Any]) -> bytes:
    """In a process of its own, with other hashes and other numbers of threads."""
    command = [sys.executable, "-m", "artde_gym.cli", "evaluate", "--controllers", "tde,artde", "--episodes", "2"]
    command += ["--seed", "5", "--workers", "1", "--scenario", case["scenario"], "--out", str(folder)]
    command += ["--env-kwargs", json.dumps(case["env_kwargs"]), *["--vectorized"] * case.get("vectorized", False)]
    changed = {"PYTHONHASHSEED": "4242", "OMP_NUM_THREADS": "3", "OPENBLAS_NUM_THREADS": "3"}
    subprocess.run(command, env={**os.environ, **changed}, check=True, capture_output=True)
    return (folder / "episodes.csv").read_bytes()


def interrupted(update: Update) -> None:
    if update.finished > 2:  # the one that has just ended is lost
        raise KeyboardInterrupt


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("biped in bullet", marks=pytest.mark.bullet),
        "biped in mujoco",
        pytest.param("quadrotor in bullet", marks=pytest.mark.bullet),
        pytest.param("quadrotors in batch", marks=pytest.mark.once),
    ],
)
def test_an_evaluation_is_the_same_file_byte_by_byte(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = CASES[name]
    first = table(tmp_path / "first", case)
    assert table(tmp_path / "again", case) == first
    assert table(tmp_path / "workers", case, workers=2) == first
    with monkeypatch.context() as patch:
        patch.setattr(TASKS, "CHUNK", 2)  # of a vector, one controller is finished
        part = table(tmp_path / "part", case, on_progress=interrupted)
    assert part.count(b"\n") < first.count(b"\n")
    assert table(tmp_path / "part", case) == first
    assert table_of_a_command(tmp_path / "command", case) == first
    other = tmp_path / "other seed"
    evaluate(["tde", "artde"], episodes=2, seed=6, out=other, **case)
    assert (other / "episodes.csv").read_bytes() != first
