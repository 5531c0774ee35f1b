"""Bipeds of a batch that are disturbed alike settle once, and as each alone to the bit."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from artde_gym.robots.ojas.task import settled_by

pytestmark = pytest.mark.once

ID = "artde_gym:BipedPush-v0"
PAYLOAD = {"payload": 1.3, "friction": 0.7}
PUSH = {"body": "chest", "magnitude": {"uniform": [5.0, 30.0]}, "start": {"uniform": [0.0, 0.01]}}


def make(n: int, **disturbances: Any) -> Any:
    vector = gym.make_vec(ID, n, "vector_entry_point", engine="mujoco", duration=1.0, disturbances=disturbances)
    return vector.unwrapped


def walked(env: Any, steps: int = 15) -> list[bytes]:
    zero = np.zeros(env.action_space.shape)
    return [np.ascontiguousarray(env.step(zero + 0.1 * k)[0]).tobytes() for k in range(steps)]


def test_alike_or_known_they_walk_as_alone_bit_for_bit():
    env = make(3, **PAYLOAD, push=[PUSH])
    env.reset(seed=[1, 2, 3])  # known from now on
    walked(env)
    first, _ = env.reset(seed=[4, 5, 6])
    together = [first.tobytes(), *walked(env)]
    rows = []
    for seed in (4, 5, 6):
        alone: Any = gym.make(ID, engine="mujoco", duration=1.0, disturbances={**PAYLOAD, "push": [PUSH]}).unwrapped
        observation, _ = alone.reset(seed=seed)
        zero = np.zeros(alone.action_space.shape)
        rows.append([observation, *(alone.step(zero + 0.1 * k)[0] for k in range(15))])
    assert together == [np.array(step).tobytes() for step in zip(*rows, strict=True)]


def test_other_disturbances_settle_anew():
    env = make(2, **PAYLOAD)
    env.reset(seed=0)
    light = {"disturbances": {"payload": 0.2}}
    found = env.reset(seed=0, options=light)[0]
    fresh = make(2, payload=0.2)
    assert found.tobytes() == fresh.reset(seed=0)[0].tobytes()
    assert walked(env) == walked(fresh)


def test_a_copy_keeps_what_has_settled():
    env = make(2, **PAYLOAD, push=[PUSH])
    env.reset(seed=0)
    other = copy.deepcopy(env)
    assert env.reset(seed=1)[0].tobytes() == other.reset(seed=1)[0].tobytes()
    assert walked(env) == walked(other)


def test_only_what_acts_later_is_left_out_of_the_key():
    payload = {"payload": {"mass": 1.0}}
    assert settled_by(payload) == settled_by({"push": [{"start": 0.0}], **payload, "sensor_noise": {"position": 1.0}})
    assert settled_by(payload) != settled_by({"payload": {"mass": np.nextafter(1.0, 2.0)}})
    assert settled_by(payload) != settled_by({**payload, "own": {"size": 1.0}})
