"""Saved policies and training runs that are damaged, or made to do harm: refused by an error of ours, unexecuted."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import random
import shutil
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baselines
from artde_gym.errors import ArtdeGymError
from baselines.errors import PolicyFileError, TrainingError
from baselines.policy_file import DESCRIPTION, WEIGHTS
from baselines.saved import SHIPPED
from controllers import GainError
from tests.mutations import Touch, copied, mutate

TRIES = int(os.environ.get("EXAMPLES", "150"))
REFUSED = (ArtdeGymError, GainError)


def test_a_damaged_policy_is_loaded_or_refused(tmp_path: Path) -> None:
    """With the hash of the weights put right, since whoever means harm does that too."""
    shutil.copytree(SHIPPED / "quadrotor-gale", tmp_path / "whole")
    marker, rng = tmp_path / "executed", random.Random(0)
    for _ in range(TRIES):
        folder = copied(tmp_path / "whole", tmp_path / "damaged")
        damage = [mutate(folder, rng, marker) for _ in range(rng.choice([1, 1, 2]))]
        _right_hash(folder)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                policy = baselines.load(folder)
                policy.predict([0.0] * policy.residual.base._size)
        except REFUSED:
            pass
        except Exception as error:
            raise AssertionError(damage) from error
        assert not marker.exists(), damage
        assert {path.name for path in tmp_path.iterdir()} == {"whole", "damaged"}, damage


def _right_hash(folder: Path) -> None:
    weights, description = folder / WEIGHTS, folder / DESCRIPTION
    if weights.is_file() and description.is_file():
        try:
            content = json.loads(description.read_text())
            content["weights_sha256"] = hashlib.sha256(weights.read_bytes()).hexdigest()
            description.write_text(json.dumps(content))
        except (ValueError, TypeError, RecursionError):
            return


@pytest.mark.parametrize(
    "recipe",
    [
        {"base": "tde+ppo", "gains": {"policies": {"QuadInfinity-Payload-v0": "/outside"}}},
        {"base": "tde+ppo"},
        {"gains": {"env": 1}},
        {"gains": {"law": 3}},
        {"gains": {"k_p_p": [1, 2, 3, 4]}},
        {"base": "../outside"},
    ],
)
def test_a_recipe_cannot_lead_elsewhere(recipe: dict[str, Any], tmp_path: Path) -> None:
    folder = Path(shutil.copytree(SHIPPED / "quadrotor-gale", tmp_path / "policy"))
    content = json.loads((folder / DESCRIPTION).read_text())
    content["recipe"] |= recipe
    (folder / DESCRIPTION).write_text(json.dumps(content))
    with pytest.raises(REFUSED):
        baselines.load(folder)


FIELDS: list[tuple[str, Any]] = [
    ("version", True), ("version", 1.0), ("name", 3), ("name", "../../outside"), ("recipe", []),
    ("recipe: decision_period", 1e9), ("recipe: decision_period", "0.015"),
    ("recipe: decision_period", False), ("recipe: decision_period", None),
    ("recipe: action_scale", float("nan")), ("recipe: action_scale", -1),
    ("recipe: gated", "no"), ("recipe: action_mode", "x"),
    ("recipe: action_mode", 0), ("recipe: base", None), ("recipe: gains", []), ("recipe: robot", ["q450"]),
    ("recipe: unknown", 1), ("network", 3), ("network: sizes", [54]), ("network: sizes", []),
    ("network: sizes", [54, 0, 3]), ("network: sizes", [54.0, 64, 64, 3]), ("network: sizes", {"54": 3}),
    ("network: squashed", "no"), ("network: squashed", 1), ("network: squashed", None), ("network: activation", "relu"),
    ("features_sha256", None), ("actions", "xyz"), ("actions", [1, 2, 3]), ("control_period", float("nan")),
    ("control_period", 0), ("control_period", -0.005), ("control_period", "0.005"), ("control_period", 1e9),
    ("control_period", True), ("nominal_robot", ["q450"]), ("about", []), ("weights_sha256", 0),
]  # fmt: skip


@pytest.mark.parametrize(("field", "value"), FIELDS, ids=str)
def test_every_field_of_a_policy_is_checked(field: str, value: Any, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(SHIPPED / "quadrotor-gale", tmp_path / "policy"))
    content = json.loads((folder / DESCRIPTION).read_text())
    outer, _, inner = field.partition(": ")
    (content[outer] if inner else content)[inner or outer] = value
    (folder / DESCRIPTION).write_text(json.dumps(content))
    with pytest.raises(PolicyFileError) as caught:
        baselines.load(folder)
    assert (inner or outer).partition("_")[0] in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_every_field_of_a_policy_is_needed(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(SHIPPED / "quadrotor-gale", tmp_path / "policy"))
    content = json.loads((folder / DESCRIPTION).read_text())
    for name in content.keys() - {"artde_gym"}:  # for the reader of the file alone
        rest = {key: value for key, value in content.items() if key != name}
        (folder / DESCRIPTION).write_text(json.dumps(rest))
        with pytest.raises(PolicyFileError, match=name.partition("_")[0]):
            baselines.load(folder)


def test_a_variance_below_zero_is_refused(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(SHIPPED / "quadrotor-gale", tmp_path / "policy"))
    with np.load(folder / WEIGHTS) as stored:
        arrays: dict[str, Any] = {name: stored[name] for name in stored.files}
    arrays["variance"][3] = -1.0
    np.savez(folder / WEIGHTS, **arrays)
    _right_hash(folder)
    with pytest.raises(PolicyFileError, match=r"variance is -1\.0"):
        baselines.load(folder)


@pytest.mark.torch
def test_a_damaged_run_is_continued_or_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import torch

    from baselines.agent import AGENTS
    from baselines.residual_config import ResidualConfig
    from baselines.run import Training
    from baselines.train import train

    name = "QuadInfinity-Payload-v0"
    tasks = AGENTS["q450"].tasks
    monkeypatch.setitem(tasks, name, dataclasses.replace(tasks[name], rollouts=2, episodes=1))
    training = Training(
        name, ResidualConfig("q450"), steps=64, envs=4, test_every=1, env_kwargs={"duration": 1.0},
        options={"n_steps": 8, "batch_size": 16},
    )  # fmt: skip
    train(training, tmp_path / "whole")
    marker, rng = tmp_path / "executed", random.Random(1)
    shutil.rmtree(tmp_path / "whole" / "tensorboard")
    for _ in range(max(10, TRIES // 15)):
        folder = copied(tmp_path / "whole", tmp_path / "damaged")
        damage = mutate(folder, rng, marker)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                train(training, folder)
        except (*REFUSED, IsADirectoryError):
            pass
        except Exception as error:
            raise AssertionError(damage) from error
        assert not marker.exists(), damage
    folder = copied(tmp_path / "whole", tmp_path / "damaged")
    newest = sorted((folder / "checkpoints").iterdir())[-1]
    (newest / "normaliser.npz").write_bytes(b"PK\x03\x04")  # to be closed again
    with pytest.raises(TrainingError, match="checkpoint"):
        train(training, folder)
    torch.save({"policy": Touch(marker)}, newest / "parameters.pt")
    with pytest.raises(TrainingError, match="checkpoint"):
        train(training, folder)
    assert not marker.exists()


def test_a_policy_of_no_sense_is_named(tmp_path: Path) -> None:
    (tmp_path / DESCRIPTION).write_text("[" * 100_000)
    (tmp_path / WEIGHTS).write_bytes(b"")
    with pytest.raises(PolicyFileError, match="RecursionError"):
        baselines.load(tmp_path)
