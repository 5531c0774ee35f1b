"""Short runs with their reports, which several modules read: who changes one changes a copy."""

from __future__ import annotations

import json

import pytest

from artde_gym.evaluation import evaluate
from artde_gym.report import write_report
from artde_gym.studies import frontier
from artde_gym.studies.reproduce.claims import all_claims, judge

SHORT = {"duration": 3.0, "actuator_inertia": "lumped"}


@pytest.fixture(scope="session")
def walks(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walks") / "run"
    push = {"body": "chest", "magnitude": 60.0, "direction": [1.0, 0.0, 0.0], "start": 0.5, "duration": 0.2}
    arguments = {"episodes": 2, "out": folder, "env_kwargs": SHORT}
    result = evaluate(["tde", "artde"], scenario="S1", disturbances={"push": [push]}, **arguments)
    judge(result, [claim for claim in all_claims() if claim.scenario == "S1"]).to_csv(
        folder / "claims.csv", index=False
    )
    arguments |= {"out": folder / "ablation" / "S1", "gains": {"tde+kd": {"c": 5.0}}}
    evaluate(["tde+kd"], scenario="S1", disturbances={"push": [push]}, **arguments)
    write_report(folder, pictures=True)
    return folder


@pytest.fixture(scope="session")
def flights(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights") / "run"
    disturbances = {"payload": {"mass": 0.35, "detach_time": 2.0}}
    kwargs = {"duration": 4.0}
    arguments = {"disturbances": disturbances, "env_kwargs": kwargs, "out": folder}
    evaluate(["tde", "atde", "artde"], "QuadInfinity-Payload-v0", episodes=2, **arguments)
    write_report(folder, pictures=True)
    return folder


@pytest.fixture(scope="session")
def bracket(tmp_path_factory):
    folder = tmp_path_factory.mktemp("frontier") / "run"
    arguments = {"low": 1.0, "high": 3.0, "tolerance": 1.0, "episodes": 1, "env_kwargs": {"duration": 2.0}}
    frontier(["artde"], "QuadInfinity-Payload-v0", "payload.mass", disturbances={}, out=folder, **arguments)
    write_report(folder)
    return folder


@pytest.fixture(scope="session")
def training(tmp_path_factory):
    """As a training leaves it behind."""
    folder = tmp_path_factory.mktemp("training")
    config = {"robot": "q450", "base": "tde", "action_mode": "attitude"}
    configuration = {"env_id": "QuadInfinity-Payload-v0", "config": config, "algo": "ppo", "steps": 4000000, "seed": 0}
    (folder / "run.json").write_text(json.dumps({"configuration": configuration, "versions": {"numpy": "2"}}))
    rows = ["steps,score,fell,rmse_m", "1000000,-0.05,0.5,0.05", "2000000,-0.01,0,0.01", "3000000,-0.02,0.25,0.02"]
    (folder / "learning_curve.csv").write_text("\n".join(rows) + "\n")
    write_report(folder)
    return folder
