"""Learning libraries as users meet them: each test trains or collects for a moment in a registered environment.

`make clients` installs the libraries and runs these tests; `pytest -m clients` runs those whose library is installed.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.evaluation.environments import ours

SHORT: dict[str, Any] = {"duration": 0.3, "control_period": 0.01}
DISTURBED: dict[str, Any] = {
    "payload": 0.3,
    "push": [{"magnitude": 2.0, "start": 0.05, "duration": 0.03}, {"magnitude": 1.0, "start": 0.1, "duration": 0.01}],
}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests of this folder, and leave them out unless the marker is asked for."""
    here = Path(__file__).parent
    own = [item for item in items if here in item.path.parents]
    for item in own:
        item.add_marker(pytest.mark.filterwarnings("default"))  # libraries warn of each other
    if "clients" not in config.option.markexpr:
        items[:] = [item for item in items if item not in own]
        config.hook.pytest_deselected(items=own)


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the default loggers of learning libraries make their folders where pytest removes them."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@pytest.fixture(params=ours())
def name(request: pytest.FixtureRequest) -> str:
    """Each registered environment in turn."""
    return request.param


@pytest.fixture
def arguments(name: str) -> dict[str, Any]:
    """Arguments of `gym.make` for short disturbed episodes."""
    lumped = {"actuator_inertia": "lumped"} if name.startswith("Biped") else {}  # quicker
    return {**SHORT, **lumped, "disturbances": DISTURBED}


@pytest.fixture
def make(name: str, arguments: dict[str, Any]) -> Callable[[], gym.Env[Any, Any]]:
    """Makes one environment whose actions are in [-1, 1], as the documentation advises for learning.

    Its module is named for workers that are new interpreters.
    """

    def one() -> gym.Env[Any, Any]:
        return gym.wrappers.RescaleAction(gym.make(f"artde_gym:{name}", **arguments), np.float64(-1.0), np.float64(1.0))

    return one
