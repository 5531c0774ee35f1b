"""The valid range of m_bar: its edges by the eigenvalues themselves, and what `artde-gym design` says of them."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import ArtdeGymError
from controllers import GainError
from controllers.design import design, judge, loops
from controllers.drive import DRIVES
from controllers.laws.stability import largest_joint_m_bar, largest_m_bar, tde_eigenvalues, tde_is_valid
from controllers.laws.tde import TdeGains

RNG = np.random.default_rng(5)


def inertias(count: int, n: int) -> np.ndarray:
    root = RNG.normal(size=(count, n, n))
    return root @ np.swapaxes(root, -1, -2) + 0.2 * np.eye(n)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_the_limit_is_where_the_largest_eigenvalue_is_two(n: int) -> None:
    inertia = inertias(20, n)
    for matrix, limit in zip(inertia, largest_m_bar(inertia), strict=True):
        assert tde_eigenvalues(matrix, float(limit)).max() == pytest.approx(2.0)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_the_limit_of_a_joint_is_where_the_largest_eigenvalue_is_two(n: int) -> None:
    inertia = inertias(20, n)
    chosen = RNG.uniform(0.2, 0.8, n) * largest_m_bar(inertia).min()
    for matrix, limits in zip(inertia, largest_joint_m_bar(inertia, chosen.tolist()), strict=True):
        for joint in range(n):
            edge = chosen.copy()
            edge[joint] = limits[joint]
            assert tde_eigenvalues(matrix, edge.tolist()).max() == pytest.approx(2.0)
    np.testing.assert_array_equal(
        largest_joint_m_bar(inertia, np.diag(chosen).tolist()), largest_joint_m_bar(inertia, chosen.tolist())
    )


def test_joints_beside_an_invalid_one_have_no_room() -> None:
    inertia = inertias(3, 3)
    chosen = [1e3, 1e-3, 1e-3]
    limits = largest_joint_m_bar(inertia, chosen)
    assert (limits[:, 1:] == 0).all()
    assert (limits[:, 0] > 0).all()
    assert np.isnan(largest_joint_m_bar(inertia, [[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]])).all()


def test_the_biped_at_its_thesis_gains() -> None:
    (one,) = design("ojas")
    assert one.largest == pytest.approx(0.0909, abs=1e-4)  # twice the rotor's inertia and a little more
    assert one.used == pytest.approx(0.042 / one.largest)
    assert one.room == pytest.approx(one.largest / 0.042)
    np.testing.assert_allclose(one.stiffness, 420.0)
    assert one.valid
    assert (one.joint_limits > one.largest).all()  # with the others well inside, each may go further
    (slow,) = design("ojas", period=0.004)
    np.testing.assert_allclose(slow.stiffness, 105.0)
    np.testing.assert_array_equal(slow.limit, one.limit)


def test_the_edge_is_that_of_the_validity_check() -> None:
    (loop,) = loops("ojas")
    (one,) = design("ojas")
    for factor, valid in ((0.999, True), (1.001, False)):
        assert tde_is_valid(loop.inertia, factor * one.largest).all() == valid
        assert judge(loop, TdeGains(factor * one.largest, 25.0, 10.0), 0.001).valid == valid


def test_periods_are_those_of_the_environments() -> None:
    for name in ("BipedWalk-Payload-v0", "QuadInfinity-Payload-v0"):
        env: Any = gym.make(name, disable_env_checker=True).unwrapped
        assert DRIVES[env.robot_name].period == env.control_period
        env.close()


def test_the_quadrotor_has_two_loops() -> None:
    position, attitude = design("q450", "artde")
    assert (position.loop.name, attitude.loop.name) == ("position", "attitude")
    assert position.largest == pytest.approx(2 * position.loop.inertia[0, 0, 0])
    assert attitude.valid


def test_the_law_with_extra_damping_is_stiffer() -> None:
    (plain,), (damped,) = design("ojas", "tde+c"), design("ojas", "tde+kd")
    assert (damped.stiffness > plain.stiffness).all()
    assert damped.used == plain.used


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"robot": "dog"}, "ojas"),
        ({"robot": "ojas", "law": "pid"}, "tde"),
        ({"robot": "ojas", "preset": "no"}, "thesis"),
        ({"robot": "ojas", "period": 0.0}, "period"),
        ({"robot": "ojas", "gains": {"m_bar": -1.0}}, "m_bar"),
        ({"robot": "ojas", "gains": {"m_bar": [0.1, 0.2]}}, "12"),
        ({"robot": "ojas", "speed": 3.0}, "speed"),
        ({"robot": "ojas", "actuator_inertia": "steel"}, "rotor"),
    ],
)
def test_what_is_wrong_is_named(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises((ArtdeGymError, GainError), match=words):
        design(**arguments)


def test_the_figure_of_an_m_bar_a_joint_names_the_limit_of_a_common_one(tmp_path: Path) -> None:
    run = CliRunner().invoke(app, ["design", "--robot", "arm", "--figure", str(tmp_path / "arm.svg")])
    assert run.exit_code == 0, run.output
    drawn = (tmp_path / "arm.svg").read_text()
    assert "limit of one for all joints" in drawn
    assert "valid below" not in drawn


def test_the_command_prints_a_table_json_and_figures(tmp_path: Path) -> None:
    run = CliRunner().invoke(app, ["design", "--figure", str(tmp_path / "limit.svg")])
    assert run.exit_code == 0, run.output
    assert "left_knee" in run.output
    assert "420" in run.output
    ET.parse(tmp_path / "limit.svg")
    run = CliRunner().invoke(app, ["design", "--robot", "quadrotor", "--json", "--figure", str(tmp_path / "q.svg")])
    found = json.loads(run.output)
    assert [loop["loop"] for loop in found["loops"]] == ["position", "attitude"]
    assert {path.name for path in tmp_path.iterdir()} == {"limit.svg", "q-position.svg", "q-attitude.svg"}
    run = CliRunner().invoke(app, ["design", "--actuator-inertia", "none"])
    assert "OUTSIDE" in run.output


@pytest.mark.parametrize("m_bar", [1e308, 1e-320])
def test_an_m_bar_beyond_all_inertias_is_refused(m_bar: float) -> None:
    with pytest.raises(GainError, match="m_bar"):
        design("ojas", gains={"m_bar": m_bar})


def test_a_truth_value_is_no_gain() -> None:
    with pytest.raises(GainError, match="True"):
        design("ojas", gains={"m_bar": True})


@pytest.mark.parametrize("gains", [{"k_d": 1e308}, {"m_bar": 1e-300}])
def test_json_of_a_design_has_no_number_that_json_cannot_write(gains: dict[str, float]) -> None:
    for one in design("ojas", gains=gains):
        json.dumps(one.to_dict(), allow_nan=False)
