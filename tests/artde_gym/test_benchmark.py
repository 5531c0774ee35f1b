"""The benchmark measures what it says, and its page and JSON say what was measured; nothing here is timed."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from artde_gym.benchmark import SECTIONS, Figure, Section, endurance, measure
from artde_gym.benchmark.environments import ENGINES, biped, quadrotor
from artde_gym.benchmark.page import page, written
from artde_gym.benchmark.timing import in_turns
from artde_gym.cli import app
from artde_gym.errors import UnknownNameError
from artde_gym.sim.engine_loops import body_loop, joint_loop


@pytest.mark.once
@pytest.mark.parametrize("engine", ENGINES)
def test_the_bare_loops_do_what_the_environments_do(engine: str) -> None:
    """The same torques give the same joints to the bit, and the same wrench the same climb."""
    env, bare = biped(engine=engine), biped(engine=engine)
    for one in (env, bare):
        one.reset(seed=0)
    advance = joint_loop(bare._engine)
    for _ in range(20):
        torque = np.full(12, 0.5)
        env.step(torque)
        advance(torque)
    assert env._engine.state().q.tobytes() == bare._engine.state().q.tobytes()
    vehicle = quadrotor(engine=engine, disturbances={})
    vehicle.reset(seed=0)
    fly = body_loop(vehicle._engine, 15)
    for _ in range(10):
        fly(np.array([1.48 * (9.81 + 2.0), 0.0, 0.0, 0.0]))
    assert vehicle._engine.state().position[2] - 0.6 == pytest.approx(0.5 * 2.0 * 0.15**2, rel=0.02)


@pytest.mark.bullet
def test_a_quick_run_writes_json_and_a_page(tmp_path: Path) -> None:
    arguments = ["benchmark", "--quick", "--sections", "walk,peers", "--json", f"{tmp_path}/b.json"]
    outcome = CliRunner().invoke(app, [*arguments, "--page", f"{tmp_path}/b.md"], env={"COLUMNS": "80"})
    assert outcome.exit_code == 0, outcome.output
    found = json.loads((tmp_path / "b.json").read_text())
    assert list(found["sections"]) == ["walk", "peers"]
    figures = {figure["what"]: figure for figure in found["sections"]["walk"]["figures"]}
    ratio = figures["PyBullet, env.step: rate against bare"]
    assert 0 < ratio["value"] < 2
    assert ratio["met"] == (ratio["value"] >= 0.85)
    assert found["machine"]["cores"] >= 1
    text = (tmp_path / "b.md").read_text()
    assert "## The biped" in text
    assert "gym-pybullet-drones" in text
    lines = [line for line in outcome.output.splitlines() if not line.startswith("Written to")]
    assert max(map(len, lines)) <= 80


def test_sections_are_known_and_figures_are_judged() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'walk'"):
        measure(["walks"])
    assert all(point.count(":") == 1 for point in SECTIONS.values())
    assert [Figure("", 1.0, least=low, most=high).met for low, high in ((1, None), (2, None), (None, 0.5))] == [
        True, False, False,
    ]  # fmt: skip
    assert Figure("", 1.0).met is None
    assert [written(value) for value in (0.0374, 1.5, 28.44, 173.2, 4593.0)] == [
        "0.037",
        "1.50",
        "28.4",
        "173",
        "4 593",
    ]
    text = page({"x": Section("T", "t", (Figure("a|b", 0.5, least=1.0),), "why")})
    assert "| a\\|b | 0.500 |  | >= 1 (missed) |" in text
    assert "*Left out: why*" in text


def test_variants_take_turns_and_the_median_counts() -> None:
    order: list[str] = []

    def turn(name: str, seconds: list[float]):
        def prepare():
            pause = seconds.pop(0)

            def job() -> None:
                order.append(name)
                clock[0] += pause

            return job

        return prepare

    clock = [time.monotonic()]
    times = in_turns({"a": turn("a", [1, 1, 50]), "b": turn("b", [2, 3, 2])}, 3, lambda: clock[0])
    assert order == ["a", "b"] * 3
    assert times == pytest.approx({"a": 1.0, "b": 2.0})


def test_a_short_soak() -> None:
    """What `make soak` does for hours: memory stays, and no client is left."""
    told: list[str] = []
    figures = [
        *endurance.walking("mujoco", 3.0, told.append),
        *endurance.starting(90, told.append),
        *endurance.making(18, told.append),
        *endurance.replacing(60, told.append),
    ]
    for figure in figures:
        if figure.unit in ("MB", "clients"):
            assert figure.met, figure
    assert told
