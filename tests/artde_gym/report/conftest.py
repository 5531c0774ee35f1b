"""Short runs with their reports."""

from __future__ import annotations

import pytest

from artde_gym.evaluation import evaluate, frontier
from artde_gym.evaluation.claims import CLAIMS, judge
from artde_gym.evaluation.report import write_report

SHORT = {"duration": 3.0, "actuator_inertia": "lumped"}


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walks") / "run"
    push = {"body": "chest", "magnitude": 60.0, "direction": [1.0, 0.0, 0.0], "start": 0.5, "duration": 0.2}
    arguments = {"episodes": 2, "out": folder, "env_kwargs": SHORT}
    result = evaluate(["tde", "artde"], scenario="S1", disturbances={"push": [push]}, **arguments)
    judge(result, [claim for claim in CLAIMS if claim.scenario == "S1"]).to_csv(folder / "claims.csv", index=False)
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights") / "run"
    disturbances = {"payload": {"mass": 0.35, "drop": 2.0}}
    kwargs = {"duration": 4.0}
    arguments = {"disturbances": disturbances, "env_kwargs": kwargs, "out": folder}
    evaluate(["tde", "atde", "artde"], "QuadInfinity-Payload-v0", episodes=2, **arguments)
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def bracket(tmp_path_factory):
    folder = tmp_path_factory.mktemp("frontier") / "run"
    arguments = {"low": 1.0, "high": 3.0, "tolerance": 1.0, "episodes": 1, "env_kwargs": {"duration": 2.0}}
    frontier(["artde"], "QuadInfinity-Payload-v0", "payload.mass", disturbances={}, out=folder, **arguments)
    write_report(folder)
    return folder
