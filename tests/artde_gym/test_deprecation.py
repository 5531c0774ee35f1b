"""Old imports work for one release, with a warning that names the new ones."""

from __future__ import annotations

import importlib
import sys
from typing import Any

import pytest

from artde_gym import evaluation
from artde_gym.deprecation import MODULES
from artde_gym.metrics_spec import MetricsSpec


@pytest.mark.parametrize("old", MODULES)
def test_an_old_module_has_what_the_new_one_has(old: str):
    sys.modules.pop(old, None)
    with pytest.warns(DeprecationWarning, match=rf"{old} is deprecated; use {MODULES[old]}"):
        module = importlib.import_module(old)
    new = importlib.import_module(MODULES[old])
    names = [name for name in vars(new) if not name.startswith("_")]
    assert names
    assert all(getattr(module, name) is getattr(new, name) for name in names)
    assert new.__name__ == MODULES[old]


@pytest.mark.parametrize("name", ["Frontier", "reproduce", "sweep", "tune", "SCENARIOS", "scenario"])
def test_an_old_name_of_the_evaluation_is_the_new_one(name: str):
    evaluation.__dict__.pop(name, None)  # set there by an import of the old module of that name
    with pytest.warns(DeprecationWarning, match=f"evaluation.{name} is deprecated"):
        old = getattr(evaluation, name)
    new = importlib.import_module("artde_gym.scenarios" if name in ("SCENARIOS", "scenario") else "artde_gym.studies")
    assert old is getattr(new, name)


def test_another_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'frontiers'"):
        evaluation.__getattr__("frontiers")


def test_old_arguments_of_a_metrics_spec_are_the_new_ones():
    same: dict[str, Any] = {"errors": (), "norm": True, "efforts": (), "power": abs, "tde_errors": {}}
    former: dict[str, Any] = {"band": 1.0, "limited": "tau", "near": 0.1, "means": {}, "told": ("time_s",)}
    with pytest.warns(DeprecationWarning, match="of MetricsSpec is deprecated"):
        old = MetricsSpec(**same, **former)
    new = MetricsSpec(
        **same,
        settling_band=1.0,
        saturated_field="tau",
        saturation_margin=0.1,
        diagnostic_means={},
        recorded_info=("time_s",),
    )
    assert old == new
