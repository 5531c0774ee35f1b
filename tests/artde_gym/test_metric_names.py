"""Metrics are known before the first episode: those that tuning minimizes, and those of claims over worlds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from artde_gym.errors import OptionError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.columns import OF_EPISODES, metric_names
from artde_gym.evaluation.environments import main_scenarios, ours
from artde_gym.evaluation.plan import Plan
from artde_gym.studies import multiverse, tune
from artde_gym.studies.multiverse.claims import WORLD_CLAIMS, smaller
from artde_gym.studies.multiverse.design import design

SHORT = {"duration": 0.1}


@pytest.mark.parametrize("env_id", ours())
def test_the_names_are_those_of_a_table_of_episodes(env_id: str) -> None:
    chosen: dict[str, Any] = {"scenario": (*main_scenarios(env_id), None)[0], "env_kwargs": SHORT}
    plan = Plan.of(["tde"], env_id, **chosen)
    rows = evaluate(["tde"], env_id, **chosen, episodes=1).episodes
    labels = {"scenario", "controller", "env", "episode", "seed", "fell", "fall_reason"}
    expected = [str(name) for name in rows if name not in labels and not str(name).startswith("disturbance.")]
    assert set(metric_names(plan.cells[0], plan.controllers["tde"], plan.seed)) == set(expected)
    assert set(OF_EPISODES) <= set(expected)


@pytest.mark.parametrize("metric", ["nope", "controller", "fall_reason", "fell"])
def test_tuning_refuses_what_is_no_metric_before_its_first_trial(metric: str, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=f"metric is '{metric}'; allowed: .*rmse_m") as caught:
        tune(["tde"], "QuadInfinity-Payload-v0", env_kwargs=SHORT, metric=metric, out=tmp_path / "out")
    assert "controller" not in caught.value.allowed
    assert not (tmp_path / "out" / "tuning.json").exists()


def test_a_claim_of_an_unknown_metric_is_refused_before_the_first_world(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra sweep)")
    assert "q450" in WORLD_CLAIMS  # loads them
    monkeypatch.setitem(WORLD_CLAIMS._entries, "q450", (smaller("artde", "tde", "nope"),))
    factors = {"x": {"path": "disturbances.payload.mass", "uniform": [0.1, 0.2], "source": "a guess"}}
    plan = {"env": "QuadInfinity-Payload-v0", "disturbances": {}, "env_kwargs": SHORT, "controllers": ["tde", "artde"]}
    assert design({**plan, "factors": factors}).claims[0].metric == "nope"
    with pytest.raises(OptionError, match="metric is 'nope'"):
        multiverse({**plan, "factors": factors, "worlds": 2}, tmp_path / "out")
