"""Episodes of many quadrotors that begin together: the same bits as those that begin alone."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.disturbances import Disturbances
from artde_gym.disturbances.numeric import numeric, numeric_rows
from artde_gym.robots.q450 import task
from artde_gym.sim.rigid_bodies import MassProperties, composite

pytestmark = pytest.mark.once

MASS = {"uniform": [0.1, 0.5]}
CASES: list[dict[str, Any]] = [
    {},
    {"payload": {"mass": MASS, "position": [0.05, 0.02, -0.03]}, "mass_scale": {"uniform": [0.8, 1.2]}},
    {"payload": {"mass": MASS, "attach_time": 0.05, "detach_time": 0.1}, "wind": {"scale": {"uniform": [0.5, 2.0]}}},
    {"payload": {"mass": MASS, "cable": 0.4}, "motor_lag": {"uniform": [0.0, 0.05]}},
    {"payload": {"mass": MASS, "cable": 0.4, "attach_time": 0.05, "detach_time": 0.1}, "action_delay": 2},
    {"push": [{"body": "body", "magnitude": 3.0, "direction": [1, 0, 0], "start": 0.05}], "ground_effect": 1.0},
    {"payload": {"mass": MASS, "attach_time": 0.1, "detach_time": 0.05}},  # never
]


def flown(cases: list[dict[str, Any]], seeds: list[int], dtype: str) -> tuple[np.ndarray, list[dict[str, Any]]]:
    """Fly episodes that begin together twice; return all observations and infos."""
    env: Any = gym.make_vec(
        "QuadInfinity-Payload-v0", len(cases), "vector_entry_point", engine="numpy", dtype=dtype, duration=1.0,
        autoreset_mode="Disabled",
    )  # fmt: skip
    seen, told = [], []
    options: dict[str, Any]
    for options in ({"disturbances": cases}, {}):
        observation, info = env.reset(seed=seeds if "disturbances" in options else None, options=options)
        seen.append(observation)
        told.append(info)
        for _ in range(12):
            observation, _, _, _, info = env.step(np.full((len(cases), 4), [12.0, 0.01, -0.02, 0.0]))
            seen.append(observation)
            told.append(info)
    env.close()
    return np.stack(seen), told


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_vehicles_that_begin_together_fly_as_those_that_begin_alone(dtype: str) -> None:
    seeds = list(range(0, 2 * len(CASES), 2))
    together, told = flown(CASES, seeds, dtype)
    for i, (case, seed) in enumerate(zip(CASES, seeds, strict=True)):
        alone, own = flown([case], [seed], dtype)
        assert np.array_equal(together[:, i], alone[:, 0])
        for ours, theirs in zip(told, own, strict=True):
            for name, value in theirs.items():
                width = tuple(map(slice, value.shape[1:]))  # lists are padded to the longest
                assert np.array_equal(ours[name][(i, *width)], value[0])


def test_bodies_are_combined_row_by_row() -> None:
    rng = np.random.default_rng(0)
    mass, com = rng.uniform(0.1, 1.0, (2, 5)), rng.normal(size=(2, 5, 3))
    inertia = rng.uniform(0.01, 0.1, (2, 5, 1, 1)) * np.eye(3)
    whole = composite(*(MassProperties(mass[k], com[k], inertia[k]) for k in range(2)))
    for row in range(5):
        one = composite(*(MassProperties(float(mass[k, row]), com[k, row], inertia[k, row]) for k in range(2)))
        for several, single in zip(whole, one, strict=True):
            assert np.array_equal(np.asarray(several)[row], np.asarray(single))


@pytest.mark.parametrize("case", CASES)
def test_numbers_of_many_samples_are_those_of_each(case: dict[str, Any]) -> None:
    disturbances = Disturbances.parse(case, task.WORDS["site"], task.WORDS["joint"], "q450")
    samples = [disturbances.sample(np.random.default_rng(seed)) for seed in range(4)]
    rows = numeric_rows(samples, task.WORDS)
    for row, sampled in enumerate(samples):
        own = numeric(sampled, task.WORDS)
        assert rows.keys() == own.keys()
        for name, value in own.items():
            assert np.array_equal(rows[name][row], value)
            assert isinstance(value, (int, float, np.ndarray))
            assert not isinstance(value, np.generic)
