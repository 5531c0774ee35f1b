"""The laws on JAX's arrays: `jit`, `vmap`, and gradients by the gains."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from array_laws import (
    CASES,
    DIFFERENTIATED,
    ROLLOUT,
    cost,
    expected_slopes,
    expected_tracking_slopes,
    gain_values,
    leaves,
    run,
    tracking_cost,
    varied_gains,
)

jax = pytest.importorskip("jax", reason="JAX is not installed")
jnp = pytest.importorskip("jax.numpy")

pytestmark = pytest.mark.clients
PAGE = Path(__file__).parents[2] / "docs" / "tutorials" / "gradient.md"
every_law = pytest.mark.parametrize("name", CASES)


@pytest.fixture(autouse=True)
def double_precision() -> Iterator[None]:
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", False)


def compare(found: Any, expected: Any) -> None:
    for own, wanted in zip(leaves(found), leaves(expected), strict=True):
        assert isinstance(own, jax.Array)
        np.testing.assert_allclose(np.asarray(own), wanted, rtol=1e-9, atol=1e-11)


def arrays(tree: Any, dtype: Any = None) -> Any:
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype if leaf.dtype.kind == "f" else None), tree)


@every_law
def test_values_under_jit_are_those_of_numpy(name):
    case = CASES[name]
    whole = jax.jit(lambda inputs: tuple(run(case, case.gains, inputs)))
    compare(whole(arrays(case.inputs)), tuple(run(case, case.gains, case.inputs)))


@every_law
def test_float32_stays_float32(name):
    case = CASES[name]
    found = jax.eval_shape(lambda inputs: tuple(run(case, case.gains, inputs)), arrays(case.inputs, jnp.float32))
    assert all(leaf.dtype == jnp.float32 for leaf in leaves(found) if leaf.dtype != jnp.bool_)


@every_law
def test_vmap_is_a_batch(name):
    case = CASES[name]
    found = jax.jit(jax.vmap(lambda inputs: tuple(run(case, case.gains, inputs))))(arrays(case.inputs))
    compare(found, tuple(run(case, case.gains, case.inputs)))


def test_vmap_over_gains_is_a_loop():
    case = CASES["artde"]
    rates = np.linspace(10.0, 200.0, 5)
    inputs = arrays(case.inputs)
    found = jax.vmap(lambda rate: cost(case, varied_gains(case.gains, {"gamma_0": rate, "k_p": rate}), inputs))(rates)
    expected = [
        cost(case, varied_gains(case.gains, {"gamma_0": float(rate), "k_p": float(rate)}), case.inputs)
        for rate in rates
    ]
    np.testing.assert_allclose(found, expected, rtol=1e-10)


@pytest.mark.parametrize("name", DIFFERENTIATED)
def test_gradients_are_those_of_differences(name):
    case = CASES[name]
    inputs = arrays(case.inputs)
    slopes = jax.jit(jax.grad(lambda values: cost(case, varied_gains(case.gains, values), inputs)))
    found = slopes(gain_values(case))
    for gain, wanted in expected_slopes(case).items():
        np.testing.assert_allclose(found[gain], wanted, rtol=1e-5, atol=1e-6, err_msg=gain)


@pytest.mark.parametrize("name", ROLLOUT)
def test_a_rollout_from_the_reference_has_the_gradient_of_differences(name):
    case = CASES[name]
    zero = jnp.zeros(case.inputs[0].q.shape[-1])
    found = jax.grad(lambda values: tracking_cost(case, varied_gains(case.gains, values), zero, jnp.sin))(
        gain_values(case)
    )
    for gain, wanted in expected_tracking_slopes(case).items():
        np.testing.assert_allclose(found[gain], wanted, rtol=1e-4, atol=1e-6, err_msg=gain)


def test_the_code_of_the_tutorial():
    code = PAGE.read_text(encoding="utf-8").partition("## In JAX")[2].partition("```python")[2].partition("```")[0]
    found: dict[str, Any] = {}
    exec(code, found)
    h = 1e-4
    expected = [
        (
            found["cost"](25.0 + h * (i == 0), 10.0 + h * (i == 1))
            - found["cost"](25.0 - h * (i == 0), 10.0 - h * (i == 1))
        )
        / (2 * h)
        for i in range(2)
    ]
    np.testing.assert_allclose(found["slopes"], expected, rtol=1e-5)
    assert found["many"].shape == (16,)
