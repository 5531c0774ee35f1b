"""The laws on PyTorch's tensors: values, `vmap`, and gradients by the gains."""

from __future__ import annotations

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
    mapped,
    run,
    tracking_cost,
    varied_gains,
)

pytestmark = pytest.mark.torch
every_law = pytest.mark.parametrize("name", CASES)


def tensors(tree: Any, dtype: Any = None) -> Any:
    import torch

    return mapped(lambda leaf: torch.as_tensor(leaf, dtype=dtype if leaf.dtype.kind == "f" else None), tree)


@every_law
def test_values_are_those_of_numpy(name):
    import torch

    case = CASES[name]
    expected = leaves(tuple(run(case, case.gains, case.inputs)))
    found = leaves(tuple(run(case, case.gains, tensors(tuple(case.inputs)))))
    for own, wanted in zip(found, expected, strict=True):
        assert isinstance(own, torch.Tensor)
        np.testing.assert_allclose(own.numpy(), wanted, rtol=1e-10, atol=1e-12)


@every_law
def test_float32_stays_float32(name):
    import torch

    case = CASES[name]
    found = leaves(tuple(run(case, case.gains, tensors(tuple(case.inputs), torch.float32))))
    assert all(leaf.dtype == torch.float32 for leaf in found if leaf.dtype != torch.bool)


@every_law
def test_vmap_is_a_batch(name):
    import torch

    case = CASES[name]
    inputs = tensors(tuple(case.inputs))
    found = torch.func.vmap(lambda *own: tuple(run(case, case.gains, list(own))))(*inputs)
    for own, wanted in zip(leaves(found), leaves(tuple(run(case, case.gains, inputs))), strict=True):
        torch.testing.assert_close(own, wanted, rtol=1e-10, atol=1e-12)


def slopes(function: Any, values: dict[str, Any]) -> dict[str, Any]:
    import torch

    return torch.func.grad(function)({name: torch.as_tensor(value) for name, value in values.items()})


@pytest.mark.parametrize("name", DIFFERENTIATED)
def test_gradients_are_those_of_differences(name):
    case = CASES[name]
    inputs = tensors(tuple(case.inputs))
    found = slopes(lambda values: cost(case, varied_gains(case.gains, values), inputs), gain_values(case))
    for gain, wanted in expected_slopes(case).items():
        np.testing.assert_allclose(found[gain].numpy(), wanted, rtol=1e-5, atol=1e-6, err_msg=gain)


@pytest.mark.parametrize("name", ROLLOUT)
def test_a_rollout_from_the_reference_has_the_gradient_of_differences(name):
    import torch

    case = CASES[name]
    zero = torch.zeros(case.inputs[0].q.shape[-1], dtype=torch.float64)
    found = slopes(
        lambda values: tracking_cost(case, varied_gains(case.gains, values), zero, torch.sin), gain_values(case)
    )
    for gain, wanted in expected_tracking_slopes(case).items():
        np.testing.assert_allclose(found[gain].numpy(), wanted, rtol=1e-4, atol=1e-6, err_msg=gain)
