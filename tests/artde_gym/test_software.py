"""Results of one software in one folder: versions, source, weights, the user's own code; mixing takes a word."""

from __future__ import annotations

import dataclasses
import importlib
import json
import linecache
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import artde_gym
from artde_gym import registration
from artde_gym.errors import StoreError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.provenance import source_hash
from artde_gym.report import write_report
from artde_gym.scenarios import SCENARIOS
from artde_gym.studies import frontier, reproduce, sweep, tune

QUADROTOR = "QuadInfinity-Payload-v0"
FLIGHT: dict[str, Any] = {"duration": 0.3}


def evaluated(folder: Path, **options: Any) -> Any:
    return evaluate(
        ["tde", "tde+ppo"], QUADROTOR, disturbances={}, env_kwargs=FLIGHT, vectorized=True, episodes=1, out=folder,
        **options,
    )  # fmt: skip


def searched(folder: Path, **options: Any) -> Any:
    return frontier(
        ["tde"], QUADROTOR, "wind.scale", low=0, high=1, tolerance=1, episodes=1, env_kwargs=FLIGHT,
        disturbances={"wind": 1.0}, out=folder, vectorized=True, **options,
    )  # fmt: skip


def tuned(folder: Path, **options: Any) -> Any:
    return tune(
        ["tde"], QUADROTOR, trials=1, episodes=1, held_out=1, env_kwargs=FLIGHT, out=folder, vectorized=True, **options
    )


def swept(folder: Path, **options: Any) -> Any:
    pytest.importorskip("pyarrow")
    given = {"env": QUADROTOR, "controller": "tde+ppo", "disturbances": {}, "env_kwargs": FLIGHT, "vectorized": True}
    return sweep(given, folder, **options)


WRITERS: dict[str, tuple[Callable[..., Any], str]] = {
    "evaluate": (evaluated, "summary.json"),
    "frontier": (searched, "frontier.json"),
    "level of a frontier": (searched, "levels/0/summary.json"),
    "tune": (tuned, "tuning.json"),
    "held-out test": (tuned, "held-out/summary.json"),
    "sweep": (swept, "sweep.json"),
}
"""What writes a folder, and its record."""


def provenance_of(record: dict[str, Any]) -> dict[str, Any]:
    return record["runs"][-1]["provenance"] if "runs" in record else record["provenance"]


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize(("asked", "how"), [({}, "default"), ({"engine": "numpy"}, "asked for")])
def test_records_say_whether_the_engine_was_asked_for(name, asked, how, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "FLIGHT", {**FLIGHT, **asked})
    write, record = WRITERS[name]
    write(tmp_path)
    assert provenance_of(json.loads((tmp_path / record).read_text()))["engines"] == {"numpy": how}


@pytest.mark.parametrize("name", WRITERS)
def test_results_of_other_software_are_gone_on_with_on_request_only(name, tmp_path):
    run, record = WRITERS[name]
    run(tmp_path)
    file = tmp_path / record
    content = json.loads(file.read_text())
    before = provenance_of(content)
    assert before["source_sha256"] == source_hash()
    assert before["commit"] is None or len(before["commit"].removesuffix("-dirty")) == 40
    before["packages"]["numpy"] = "1.0"
    file.write_text(json.dumps(content))
    with pytest.raises(StoreError, match=r"version of numpy.*1\.0.*--allow-mixed.*allow_mixed=True"):
        run(tmp_path)
    assert json.loads(file.read_text()) == content
    run(tmp_path, allow_mixed=True)
    run(tmp_path)  # the newest counts
    (mixed,) = provenance_of(json.loads(file.read_text()))["mixed_with"]
    assert mixed["packages"]["numpy"] == "1.0"
    if name == "evaluate":
        assert "mixed with results of other software" in write_report(tmp_path).read_text()


@pytest.mark.parametrize("name", ["evaluate", "sweep"])
@pytest.mark.parametrize("changed", ["source_sha256", "weights of tde+ppo in QuadInfinity-Payload-v0"])
def test_changes_that_are_not_committed_and_weights_trained_anew_are_other_software(name, changed, tmp_path):
    run, record = WRITERS[name]
    run(tmp_path)
    content = json.loads((tmp_path / record).read_text())
    before = provenance_of(content)
    part = before if changed in before else before["behind_controllers"]
    assert part[changed]
    part[changed] = "another"
    (tmp_path / record).write_text(json.dumps(content))
    with pytest.raises(StoreError, match="weights of tde.ppo in Quad" if "weights" in changed else "source code"):
        run(tmp_path)


def test_reproduction_refuses_too(tmp_path, monkeypatch):
    flight = dataclasses.replace(SCENARIOS["Q1-calm"], kwargs=FLIGHT)
    monkeypatch.setitem(SCENARIOS._entries, "Q1-calm", flight)

    def run(**options: Any) -> Any:
        return reproduce("quadrotor", tmp_path, scenarios=["Q1-calm"], controllers=["tde"], episodes=1, **options)

    run()
    file = tmp_path / "summary.json"
    content = json.loads(file.read_text())
    content["provenance"]["source_sha256"] = "another"
    file.write_text(json.dumps(content))
    with pytest.raises(StoreError, match="source code of artde-gym"):
        run()
    assert run(allow_mixed=True).result.complete


OWN = """
from pathlib import Path
import numpy as np
class Own:
    def __init__(self, env):
        self.identity = Path({weights!r}).read_text()
        self.action = np.array([14.0, 0.0, 0.0, 0.0])
    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.broadcast_to(self.action, observation.shape[:-1] + (4,)){more}, None
"""


def test_weights_and_code_of_a_users_controller_count(tmp_path, monkeypatch):
    module, weights = tmp_path / "own_law.py", tmp_path / "weights"
    weights.write_text("first")
    module.write_text(OWN.format(weights=str(weights), more=""))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", registration.registered_controllers())
    artde_gym.register_controller("own", "own_law:Own")

    def run() -> Any:
        return evaluate(["own"], QUADROTOR, disturbances={}, env_kwargs=FLIGHT, episodes=1, out=tmp_path / "run")

    run()
    run()
    weights.write_text("second")
    with pytest.raises(StoreError, match="weights of own in Quad"):
        run()
    weights.write_text("first")
    module.write_text(OWN.format(weights=str(weights), more=" + 1.0"))
    monkeypatch.delitem(sys.modules, "own_law")
    with pytest.raises(StoreError, match="code of own"):
        run()


def test_a_folder_without_results_may_be_begun_by_any_software(tmp_path):
    def interrupt(_: Any) -> None:
        raise KeyboardInterrupt

    evaluated(tmp_path, on_progress=interrupt)
    file = tmp_path / "summary.json"
    content = json.loads(file.read_text())
    content["provenance"]["packages"]["numpy"] = "1.0"
    file.write_text(json.dumps(content))
    assert evaluated(tmp_path).complete
    assert "mixed_with" not in provenance_of(json.loads(file.read_text()))


def test_the_hash_of_the_source_is_the_same_in_each_process():
    code = "from artde_gym.evaluation.provenance import source_hash; print(source_hash())"
    outcome = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert outcome.stdout.strip() == source_hash()


FACTORY = """
import numpy as np


class Constant:
    def __init__(self, env, thrust):
        self.action = np.full(env.action_space.shape, thrust)

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return self.action, state


def make(env):
    return Constant(env, 1.0)
"""


def test_the_code_that_makes_a_controller_belongs_to_the_software(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registration, "_controllers", dict(registration.registered_controllers()))
    artde_gym.register_controller("constant", "own_factory:make")
    module = tmp_path / "own_factory.py"

    def run() -> Any:
        sys.modules.pop("own_factory", None)
        linecache.clearcache()
        importlib.invalidate_caches()
        return evaluate(["constant"], QUADROTOR, episodes=1, env_kwargs=FLIGHT, out=tmp_path / "run")

    module.write_text(FACTORY)
    run()
    run()
    module.write_text(FACTORY.replace("env, 1.0", "env, 1.25"))
    with pytest.raises(StoreError, match="code that makes constant"):
        run()
