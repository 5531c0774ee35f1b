"""The two sentences of an error, and that both survive a worker process."""

from __future__ import annotations

import pickle

import pytest

from artde_gym.errors import ArtdeGymError, OptionError, StoreError, UnknownArgumentError, WorkerError
from baselines.errors import TrainingError

RANGE = OptionError("engine", "ode", "'bullet', 'mujoco'")
PROBLEM = StoreError("output folder", "runs/1", "choose a new folder", "contains other files")
ENDED = WorkerError("worker processes", "ended 3 times before a job was done", "use fewer workers")
UNKNOWN = UnknownArgumentError("Quadrotor", "engin", "engine")
TEXTS = [
    (RANGE, "engine is 'ode'; allowed: 'bullet', 'mujoco'"),
    (PROBLEM, "output folder 'runs/1' contains other files; choose a new folder"),
    (ENDED, "worker processes ended 3 times before a job was done; use fewer workers"),
]


@pytest.mark.parametrize(("error", "text"), TEXTS)
def test_a_range_and_a_problem_read_differently(error: ArtdeGymError, text: str) -> None:
    assert str(error) == text
    assert error.field in text
    assert str(error.value) in text
    assert text.endswith(error.allowed)


@pytest.mark.parametrize("error", [RANGE, PROBLEM, ENDED, UNKNOWN, TrainingError("seed", 1, "choose 2", "differs")])
def test_an_error_survives_another_process_and_a_longer_field(error: ArtdeGymError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), again.problem) == (type(error), str(error), error.problem)
    placed = again.within("world 3")
    assert (type(placed), placed.field) == (type(error), f"{error.field} (world 3)")
    assert str(placed) == str(error).replace(error.field, placed.field)
