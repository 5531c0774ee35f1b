"""Seeds of episodes: wide, different, and the same number wherever they are written and read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pandas as pd
import pytest

from artde_gym.errors import StoreError
from artde_gym.evaluation import Result, evaluate, read_result
from artde_gym.evaluation.seeds import SEED, episode_seed
from artde_gym.studies.sweep.execution import sweep
from artde_gym.studies.sweep.store import read_sweep

QUADROTOR = "QuadInfinity-Payload-v0"
SHORT: dict[str, Any] = {"duration": 0.1}
LARGE = 2**63
"""From here on a seed fits no signed integer."""


def test_a_hundred_thousand_episodes_have_seeds_of_their_own() -> None:
    seeds = {episode_seed(seed, episode) for seed in range(2) for episode in range(50_000)}
    assert len(seeds) == 100_000
    assert max(seeds) > LARGE


def mixed(episodes: int = 6) -> tuple[int, list[int]]:
    """A seed, some of whose episodes have large seeds and the first has none."""
    for seed in range(100):
        seeds = [episode_seed(seed, episode) for episode in range(episodes)]
        if seeds[0] < LARGE <= max(seeds):
            return seed, seeds
    raise AssertionError("half of all seeds are large")


@pytest.mark.parametrize("vectorized", [False, True])
def test_seeds_survive_a_folder_and_all_its_formats(tmp_path: Path, vectorized: bool) -> None:
    seed, seeds = mixed()
    common: dict[str, Any] = {
        "env_kwargs": SHORT,
        "seed": seed,
        "out": tmp_path,
        "vectorized": vectorized,
        "record_episodes": 0,
    }
    found = evaluate(["tde"], QUADROTOR, episodes=len(seeds), **common).episodes
    assert found["seed"].tolist() == seeds
    stored = read_result(tmp_path).episodes
    again = evaluate(["tde"], QUADROTOR, episodes=len(seeds), **common).episodes
    for episodes in (found, stored, again, found.head(1)):
        assert episodes["seed"].dtype == SEED
        assert episodes["seed"].tolist() == seeds[: len(episodes)]
    assert pd.concat([found, found.head(1)])["seed"].tolist() == [*seeds, seeds[0]]
    assert json.loads(json.dumps(found["seed"].tolist())) == seeds


def test_one_small_seed_has_the_type_of_all() -> None:
    seed, seeds = mixed()
    found = evaluate(["tde"], QUADROTOR, episodes=1, env_kwargs=SHORT, seed=seed).episodes
    assert found["seed"].dtype == SEED
    assert found["seed"].tolist() == seeds[:1]


def test_seeds_survive_parquet(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    seed, seeds = mixed()
    given = {"env": QUADROTOR, "controller": "tde", "env_kwargs": SHORT, "seed": seed, "episodes": len(seeds)}
    for episodes in (sweep(given, tmp_path).episodes, read_sweep(tmp_path)):
        assert episodes["seed"].dtype == SEED
        assert episodes["seed"].tolist() == seeds


def test_a_row_of_another_seed_is_refused(tmp_path: Path) -> None:
    call: dict[str, Any] = {"env_kwargs": SHORT, "out": tmp_path, "record_episodes": 0}
    evaluate(["tde"], QUADROTOR, episodes=1, **call)
    table = tmp_path / "episodes.csv"
    table.write_text(table.read_text().replace(str(episode_seed(0, 0)), "7"))
    with pytest.raises(StoreError, match="another seed"):
        evaluate(["tde"], QUADROTOR, episodes=1, **call)


def test_gymnasium_takes_the_largest_seed() -> None:
    single = gym.make(QUADROTOR, disable_env_checker=True, **SHORT)
    many: Any = gym.make_vec(QUADROTOR, 2, vectorization_mode="vector_entry_point", engine="numpy", **SHORT)
    single.reset(seed=2**64 - 1)
    many.reset(seed=[2**64 - 1, 2**64 - 2])
    one: Any = single.unwrapped
    assert one.sampled_disturbances == many.unwrapped.sampled_disturbances[0]
    np.testing.assert_array_equal(single.reset(seed=2**64 - 1)[0], single.reset(seed=2**64 - 1)[0])


def test_result_of_an_empty_table() -> None:
    assert Result(pd.DataFrame()).controllers == []
