"""Policies and gains under any array library, and what NumPy keeps."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import controllers
from controllers.drive import DRIVES
from controllers.laws.array_gains import with_arrays
from controllers.laws.errors import GainError
from controllers.laws.namespaces import namespace, root
from controllers.laws.switched import nominal_inertia
from controllers.laws.tde import TdeGains

BIPED = ("tde", "atde", "artde", "artde-switched", "pid", "computed-torque")
QUADROTOR = ("artde", "asmc", "indi", "geometric", "pid", "tde+swing", "geometric-load")


def test_controllers_need_no_array_library_but_numpy():
    code = (
        "import sys, controllers, controllers.law_table; print({'jax', 'torch', 'array_api_compat'} & {*sys.modules})"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"


def test_what_is_no_array_is_numpys():
    for value in (np.zeros(2), np.float32(1.0), np.ma.zeros(2), 1.0, [1.0, 2.0]):
        assert namespace(value) is np
    assert root(np.float64(2.0), np) == np.sqrt(2.0)


def test_gains_with_arrays():
    gains = TdeGains(0.04, 25.0, 10.0)
    k_p = np.array([1.0, 2.0])
    made = with_arrays(gains, k_p=k_p)
    assert made.k_p is k_p
    assert (gains.k_p, made.k_d, type(made)) == (25.0, 10.0, TdeGains)
    with pytest.raises(GainError, match=r"k_i is 1.0; allowed: a gain of TdeGains: m_bar, k_p, k_d"):
        with_arrays(gains, k_i=1.0)


def test_gains_with_arrays_keep_nothing_derived_from_others():
    gains = DRIVES["ojas"].presets["tde-switched", "support"].gains
    both = np.zeros(())
    nominal_inertia(gains, both, 12)
    made = with_arrays(gains, m_bar=0.5 * np.eye(12))
    np.testing.assert_array_equal(nominal_inertia(made, both, 12), 0.5 * np.eye(12))


def quadrotor(n: int, **options: Any) -> Any:
    options = {"disturbances": {"payload": {"mass": 0.3, "cable": 0.5}}, **options}
    return gym.make_vec("artde_gym:QuadSling-Payload-v0", n, "vector_entry_point", engine="numpy", **options).unwrapped


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_stacked_policies_with_the_swing_term_keep_their_own_gains(dtype):
    """Each row at the gains of its own policy, bit for bit."""
    env = quadrotor(2)
    policies = [controllers.make("tde+swing", env, k_p_p=k_p) for k_p in (6.0, 9.0)]
    whole = policies[0].stacked(policies)
    assert whole is not None
    observations = env.reset(seed=0)[0].astype(dtype)
    observations = observations + np.random.default_rng(0).normal(0.0, 0.01, observations.shape).astype(dtype)
    actions, state = whole.predict(observations)
    again, _ = whole.predict(observations, state)
    for row, policy in enumerate(policies):
        action, own = policy.predict(observations[row : row + 1])
        assert action.tobytes() == actions[row : row + 1].tobytes()
        assert policy.predict(observations[row : row + 1], own)[0].tobytes() == again[row : row + 1].tobytes()


def compare(policy: Any, observations: np.ndarray) -> None:
    """Two samples on tensors, one row of the second anew, beside NumPy's."""
    import torch

    seen = torch.as_tensor(observations)
    fresh = np.arange(len(observations)) == 1
    action, state = policy.predict(observations[:])
    expected, _ = policy.predict(observations + 0.01, state, fresh, residual=np.full(action.shape[-1:], 0.1))
    own, state = policy.predict(seen)
    found, _ = policy.predict(seen + 0.01, state, torch.as_tensor(fresh), residual=np.full(action.shape[-1:], 0.1))
    assert isinstance(found, torch.Tensor) == policy.any_library
    np.testing.assert_allclose(np.asarray(own), action, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(np.asarray(found), expected, rtol=1e-9, atol=1e-10)


@pytest.mark.torch
@pytest.mark.parametrize("name", BIPED)
def test_a_policy_of_the_biped_on_tensors(name):
    with gym.make("artde_gym:BipedWalk-Payload-v0", duration=1.0) as env:
        observation = env.reset(seed=0)[0]
        noise = np.random.default_rng(0).normal(0.0, 0.01, (3, len(observation)))
        compare(controllers.make(name, env), observation + noise)


@pytest.mark.torch
@pytest.mark.parametrize("name", QUADROTOR)
def test_a_policy_of_the_quadrotor_on_tensors(name):
    env = quadrotor(3)
    observations = env.reset(seed=0)[0]
    compare(controllers.make(name, env), observations + np.random.default_rng(0).normal(0.0, 0.01, observations.shape))
