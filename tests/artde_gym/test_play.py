"""A person in the loop, without a window: what keys and clicks do to a real episode."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import artde_gym  # noqa: F401  (registers the environments)
import controllers
from artde_gym.errors import RobotError
from artde_gym.play import DIRECTIONS, RATE, Session

WALK = {"duration": 3.0, "control_period": 0.004, "engine": "mujoco", "disturbances": {"payload": 1.3}}
FLIGHT = {"duration": 4.0, "engine": "mujoco", "disturbances": {"payload": 0.35}}


class Screen:
    """A window that nobody sees: keys and clicks are put into it, and what it was told to show is kept."""

    def __init__(self) -> None:
        self.open = True
        self.waiting: list[str] = []
        self.click: int | None = None
        self.words: list[str] = []
        self.states: list[Any] = []
        self.arrows: list[tuple[Any, Any]] = []

    def pressed(self) -> list[str]:
        keys, self.waiting = self.waiting, []
        return keys

    def clicked(self, points: list[Any]) -> int | None:
        click, self.click = self.click, None
        return click

    def ahead(self) -> tuple[float, float, float]:
        return (0.6, 0.8, 0.0)

    def show(self, state: Any, payload: Any) -> None:
        self.states.append((state, payload))

    def look(self, camera: Any) -> None:
        self.camera = camera

    def follow(self, target: Any) -> None:
        self.target = target

    def write(self, lines: list[str], place: Any) -> None:
        self.words = lines

    def arrow(self, tail: Any, tip: Any) -> None:
        self.arrows.append((tail, tip))


def session(env_id: str = "BipedWalk-Payload-v0", **kwargs: Any) -> tuple[Session, Screen, Any]:
    env = gym.make(env_id, disable_env_checker=True, **(kwargs or WALK))
    screen = Screen()
    return Session(env, controllers.make("tde", env), screen, "tde"), screen, env.unwrapped


def turns(played: Session, seconds: float) -> None:
    for _ in range(round(seconds * RATE)):
        assert played.turn()


def test_an_episode_that_is_only_watched_is_that_of_evaluate() -> None:
    played, screen, plant = session()
    turns(played, 1.0)
    env: Any = gym.make("BipedWalk-Payload-v0", disable_env_checker=True, **WALK)
    policy, state = controllers.make("tde", env), None
    observation, _ = env.reset(seed=0)
    for _ in range(250):
        action, state = policy.predict(observation, state)
        observation, *_ = env.step(action)
    assert np.array_equal(plant.engine.state().q, env.unwrapped.engine.state().q)
    assert played.time_s == 1.0
    assert screen.states[-1][0].position == env.unwrapped.engine.state().position
    assert screen.words[0].startswith("tde   t = 1 s   push 20 N")


@pytest.mark.parametrize("key", ["up", "down", "left", "right"])
def test_arrow_keys_push_from_four_sides(key: str) -> None:
    """A vehicle in the air gets most of the push's momentum, since its controller resists."""
    played, screen, plant = session("QuadInfinity-Payload-v0", **FLIGHT)
    turns(played, 0.2)
    before = np.array(plant.engine.state().velocity)
    screen.waiting = [key]
    turns(played, 0.2)
    gained = np.array(plant.engine.state().velocity) - before
    direction = np.array(DIRECTIONS[key])
    momentum = 3.0 * 0.2 / 1.83
    assert 0.5 * momentum < gained @ direction < momentum
    assert np.linalg.norm(gained - (gained @ direction) * direction) < 0.15 * momentum
    ((tail, tip),) = screen.arrows
    assert np.subtract(tip, tail) @ direction == pytest.approx(0.35)
    turns(played, 1.0)
    assert len(plant.schedule.acting(plant.elapsed)) == 0


def test_a_click_pushes_away_from_the_eye_at_the_nearest_site() -> None:
    played, screen, plant = session("QuadInfinity-Payload-v0", **FLIGHT)
    turns(played, 0.1)
    screen.click = 2  # a rotor: the push turns the vehicle, too
    played.turn()
    (push,) = plant.schedule.acting(plant.elapsed)
    assert push.site == plant.nominal_robot.sites[2][0]
    np.testing.assert_allclose(push.force, (1.8, 2.4, 0.0))


def test_the_payload_drops_once() -> None:
    played, screen, plant = session("QuadInfinity-Payload-v0", **FLIGHT)
    turns(played, 0.2)
    held = screen.states[-1][1]
    played.press("d")
    turns(played, 0.3)
    fallen = screen.states[-1][1]
    assert held[2] - fallen[2] == pytest.approx(9.81 * 0.3**2 / 2, rel=0.2)
    assert not plant.drop_payload()


def test_time_slows_down_stands_still_and_begins_anew() -> None:
    played, screen, plant = session()
    played.press(",")
    assert played.speed == 0.5
    turns(played, 1.0)
    assert played.time_s == pytest.approx(0.5, abs=0.004)
    played.press("space")
    before = played.time_s
    turns(played, 0.5)
    assert played.time_s == before
    assert "paused" in screen.words[0]
    played.press("space")
    for _ in range(9):
        played.press(".")
    assert played.speed == 4.0
    turns(played, 2.0)
    assert played.over
    assert "r" in screen.words[0]
    played.press("up")  # nobody is there any more to be pushed
    played.press("r")
    assert (played.time_s, played.over) == (0.0, False)
    turns(played, 0.1)
    assert plant.elapsed > 0


def test_strength_changes_and_unknown_keys_do_nothing() -> None:
    played, *_ = session()
    for key in ("+", "=", "-", "x", "z"):
        played.press(key)
    assert played.force == pytest.approx(25.0)


def test_leaving_by_key_or_by_closing_the_window() -> None:
    played, screen, _ = session()
    screen.open = False
    assert not played.turn()
    screen.open, screen.waiting = True, ["q"]
    assert not played.turn()


def test_a_slow_computer_takes_its_time_and_a_fast_one_waits() -> None:
    played, screen, _ = session()
    now, waits = [0.0], []

    def sleep(duration: float) -> None:
        waits.append(duration)
        now[0] += duration
        if len(waits) == 3:
            screen.waiting = ["q"]

    played.run(lambda: now[0], sleep)
    assert waits == pytest.approx([1 / RATE] * 3)
    assert played.time_s == pytest.approx(4 / RATE, abs=0.004)


def test_a_site_that_is_not_there_cannot_be_pushed() -> None:
    _, _, plant = session()
    with pytest.raises(RobotError, match=r"'nose'.*'chest'"):
        plant.push("nose", (1.0, 0.0, 0.0))


def test_without_a_display_one_clear_line() -> None:
    bare = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    command = [sys.executable, "-m", "artde_gym.cli", "play", "--env", "QuadInfinity-Payload-v0"]
    done = subprocess.run(command, capture_output=True, text=True, env=bare, check=False)
    assert done.returncode == 2
    assert done.stderr.strip().splitlines()[-1].startswith("artde-gym: display None cannot open a window")
    other = subprocess.run(command, capture_output=True, text=True, env={**bare, "DISPLAY": ":987"}, check=False)
    assert other.returncode == 2
    assert "':987'" in other.stderr
