"""Nominal inertias for phases of support: validity, what is derived, and the command that derives it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError
from controllers import GainError
from controllers.drive import DRIVES
from controllers.laws.stability import (
    largest_support_m_bar,
    support_eigenvalues,
    support_is_valid,
    support_m_bar,
    tde_eigenvalues,
)
from controllers.support_design import design_supports

pytestmark = pytest.mark.once

RNG = np.random.default_rng(6)


def inverses(count: int, n: int, rank: int) -> np.ndarray:
    root = RNG.normal(size=(count, n, rank))
    return root @ np.swapaxes(root, -1, -2)


@pytest.mark.parametrize("m_bar", [0.3, [0.1, 0.2, 0.3, 0.4], np.diag([0.1, 0.2, 0.3, 0.4]).tolist()])
def test_without_contact_the_eigenvalues_are_those_of_the_free_robot(m_bar: Any) -> None:
    inverse = inverses(5, 4, 6)
    np.testing.assert_allclose(
        support_eigenvalues(inverse, m_bar), tde_eigenvalues(np.linalg.inv(inverse), m_bar), rtol=1e-6
    )


def test_blocked_directions_count_as_valid_and_the_limit_is_two() -> None:
    inverse = inverses(5, 4, 2)
    limit = largest_support_m_bar(inverse)
    for one, edge in zip(inverse, limit.tolist(), strict=True):
        eigenvalues = support_eigenvalues(one, edge)
        assert eigenvalues[-1] == pytest.approx(2.0)
        np.testing.assert_allclose(eigenvalues[:2], 0.0, atol=1e-9)
        assert support_is_valid(one, 0.999 * edge)
        assert not support_is_valid(one, 1.001 * edge)


def test_a_time_delay_estimate_under_contact_converges_where_the_eigenvalues_say_so() -> None:
    """The error contracts by 1 - A m_bar where the joints can move; where they cannot, there is none."""
    (inverse,) = inverses(1, 4, 3)
    for factor, converges in ((0.95, True), (1.05, False)):
        m_bar = factor * float(largest_support_m_bar(inverse))
        u, a, tau = RNG.normal(size=4), np.zeros(4), np.zeros(4)
        for _ in range(400):
            tau = tau + m_bar * (u - a)
            a = inverse @ tau
        error = inverse @ (u - a)
        assert (np.linalg.norm(error) < 1e-3) == converges


def test_the_derived_inertia_is_the_mean_one_but_for_its_cap() -> None:
    inverse = inverses(1, 4, 8)
    exact = np.linalg.inv(inverse[0])
    np.testing.assert_allclose(support_m_bar(np.repeat(inverse, 3, axis=0), 1e9), exact, rtol=1e-9)
    cap = float(np.median(np.linalg.eigvalsh(exact)))
    values = np.linalg.eigvalsh(support_m_bar(inverse, cap))
    np.testing.assert_allclose(values, np.minimum(np.linalg.eigvalsh(exact), cap), rtol=1e-9)
    for wrong, words in ((inverses(2, 4, 2)[:1], "rank"), (inverse, "cap")):
        with pytest.raises(GainError, match=words):
            support_m_bar(wrong, 0.1 if words == "rank" else 0.0)


def test_the_presets_are_what_spec_and_gait_give() -> None:
    found = design_supports("ojas")
    assert [one.phase.name for one in found] == ["left", "both", "right"]
    assert [one.blocked for one in found] == [0, 6, 0]
    assert sum(one.phase.share for one in found) == pytest.approx(1.0)
    for one in found:
        if one.derived is not None:
            np.testing.assert_allclose(one.m_bar, one.derived, atol=6e-6)  # five digits are stored
    assert found[1].derived is None


@pytest.mark.parametrize("motion", [{}, {"speed": 0.2, "step_duration": 0.8}, {"speed": 0.03, "step_duration": 1.5}])
def test_the_presets_are_valid_in_every_phase_even_a_wrong_one(motion: dict[str, Any]) -> None:
    for law in ("tde-switched", "atde-switched", "artde-switched"):
        found = design_supports("ojas", law, **motion)
        assert all(one.valid for one in found)
        assert max(one.largest for one in found) < 1.985
    loops = DRIVES["ojas"].loops
    assert loops is not None
    (free,) = loops(**motion)
    for one in found:
        assert tde_eigenvalues(free.inertia, one.m_bar).max() < 1.985


def test_an_inertia_beyond_a_limit_is_told() -> None:
    assert not any(
        one.valid for one in design_supports("ojas", gains={"m_bar": 0.12, "m_bar_left": 0.1, "m_bar_right": 0.1})
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"robot": "q450"}, "ojas"),
        ({"law": "tde"}, "tde-switched"),
        ({"preset": "no"}, "support"),
        ({"cap": 0.0}, "cap"),
        ({"gains": {"dwell": -1.0}}, "dwell"),
        ({"gait": 1}, "gait"),
        ({"speed": 3.0}, "speed"),
        *(({"step_duration": value}, "step_duration") for value in (float("nan"), float("inf"), 1e300, "1", None)),
    ],
)
def test_what_is_wrong_is_named(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises((ArtdeGymError, GainError), match=words):
        design_supports(**{"robot": "ojas", **arguments})


def test_the_command_derives_gains_for_another_gait() -> None:
    run = CliRunner().invoke(app, ["design", "--law", "artde-switched"])
    assert run.exit_code == 0, run.output
    assert "valid in every phase" in run.output
    run = CliRunner().invoke(app, ["design", "--law", "tde-switched", "--speed", "0.2", "--cap", "0.07", "--json"])
    found = json.loads(run.output)
    assert found["gains"].keys() == {"m_bar_left", "m_bar_right"}
    judged = design_supports("ojas", gains=found["gains"], speed=0.2, cap=0.07)
    assert all(np.linalg.eigvalsh(np.asarray(one.m_bar)).max() < 0.0701 for one in judged if one.derived is not None)
    assert all(one.valid for one in judged)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--law", "tde-switched", "--figure", "x.svg"], "figure"),
        (["--law", "tde-switched", "--period", "0.004"], "period"),
        (["--law", "tde", "--cap", "0.05"], "cap"),
        (["--law", "tde-switched", "--robot", "arm"], "'arm'; allowed: 'ojas'"),
        (["--law", "artde-switched", "--robot", "q450"], "'q450'; allowed: 'ojas'"),
    ],
)
def test_the_command_ignores_no_option(options: list[str], words: str) -> None:
    run = CliRunner().invoke(app, ["design", *options])
    assert isinstance(run.exception, ArtdeGymError)
    assert words in str(run.exception)
