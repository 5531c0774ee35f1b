"""Live play without a browser: what orders do to real episodes, and that what was done can be done again."""

from __future__ import annotations

import itertools
import json
import queue
import tracemalloc
from typing import Any

import numpy as np
import pytest

from artde_gym.errors import OptionError, RobotError
from artde_gym.evaluation import evaluate
from artde_gym.evaluation.cells import Cell
from artde_gym.evaluation.plan import Plan
from artde_gym.play.game import ORDERS, PULL_LASTS, Game
from artde_gym.play.loop import RATE, run
from artde_gym.play.player import Player
from artde_gym.play.record import MOST_PUSHES, Record, push_entry
from artde_gym.play.text import start_text, told_text

WALK = {"duration": 3.0, "control_period": 0.004, "engine": "mujoco"}
FLIGHT = {"duration": 4.0, "engine": "mujoco"}
LOADED: dict[str, Any] = {"payload": {"mass": {"uniform": [0.3, 0.4]}}, "wind": 1.0}


def walking(names: Any = ("artde",), seed: int = 0, **more: Any) -> Game:
    return Game(Plan.of(names, "BipedPush-v0", seed=seed, disturbances={"payload": 1.3}, env_kwargs=WALK, **more))


def flying(names: Any = ("artde",), env: str = "QuadInfinity-Payload-v0", given: Any = None, **more: Any) -> Game:
    return Game(Plan.of(names, env, disturbances=LOADED if given is None else given, env_kwargs=FLIGHT, **more))


def turns(game: Game, seconds: float) -> None:
    for _ in range(round(seconds * RATE)):
        game.advance(1 / RATE)


def order(game: Game, **words: Any) -> str:
    """Carry out an order and return why it was refused."""
    game.do(json.loads(json.dumps(words)))
    return game.refused


def told(game: Game) -> dict[str, Any]:
    return json.loads(told_text(game))["told"]


def again(game: Game, names: Any) -> Game:
    """The same episode, watched with what was done."""
    cell = game.cell
    kwargs = {name: value for name, value in cell.kwargs.items() if name != "disturbances"}
    plan = Plan.of(names, cell.env_id, seed=game.seed, disturbances=game.record.disturbances(), env_kwargs=kwargs)
    watched = Game(plan)
    while watched.time < game.time - 1e-9:
        watched.advance(1 / RATE)
    return watched


@pytest.mark.parametrize("given", [{}, {"preset": "tuned"}, {"k_p_p": 7}, {"preset": "tuned", "m_bar_p": 1.5}], ids=str)
def test_sliders_show_the_gains_that_act(given):
    player = flying(["tde"], gains={"tde": given}).players[0]
    law: Any = player.policy
    acting = {f"{name}_p": getattr(law.gains.position, name) for name in ("m_bar", "k_p", "k_d")}
    assert {gain: player.sliders()[gain][-1] for gain in acting} == acting


@pytest.mark.once
@pytest.mark.parametrize(("size", "falls"), [(5.0, False), (45.0, True)])
def test_a_push_topples_or_not_and_evaluate_repeats_it(tmp_path, size, falls):
    game = walking()
    turns(game, 1.0)
    assert order(game, do="push", site="chest", force=[0.0, size, 0.0]) == ""
    turns(game, 4.0)
    assert game.over
    assert bool(game.players[0].fall) == falls
    result = evaluate(
        ["artde"], "BipedPush-v0", episodes=1, seed=0, out=tmp_path, env_kwargs=WALK,
        disturbances=json.loads(json.dumps(game.record.disturbances())),
    )  # fmt: skip
    (row,) = result.episodes.to_dict(orient="records")
    assert (row["fell"], row["fall_reason"]) == (falls, game.players[0].fall)
    assert row["duration_s"] == game.players[0].end


@pytest.mark.once
@pytest.mark.parametrize("env", ["QuadInfinity-Payload-v0", "QuadSling-Payload-v0"])
def test_all_that_was_done_can_be_done_again(env):
    given = {**LOADED, "payload": {**LOADED["payload"], "cable": 0.4}} if "Sling" in env else LOADED
    game = flying(("tde", "artde"), env, given)
    assert order(game, do="condition", kind="wind", value=2.0) == ""
    assert order(game, do="reset", seed=3) == ""
    turns(game, 0.3)
    order(game, do="push", site="body", force=[0.0, 2.0, 1.0])
    order(game, do="pull", site="payload", force=[0.31, -0.5, 0.0])
    turns(game, 0.5)
    order(game, do="pull", site="payload", force=[0.0, 0.7, 0.2])
    turns(game, 0.2)
    order(game, do="pull", site="payload", force=None)
    assert order(game, do="drop") == ""
    turns(game, 0.5)
    assert order(game, do="drop") == "payload is 'none'; allowed: one that is attached, to be dropped"
    assert game.time == pytest.approx(1.5, abs=0.02)
    assert len(game.record.disturbances()["push"]) == 3
    assert again(game, ["tde", "artde"]).frame() == game.frame()
    alone = np.frombuffer(again(game, ["artde"]).frame(), np.float32)
    both = np.frombuffer(game.frame(), np.float32)
    np.testing.assert_array_equal(both[-(len(alone) - 1) :], alone[1:])  # a push acts on each of them alone, too


LEAVES: dict[str, Any] = {
    "at a time": 3.0,
    "uniformly": {"uniform": [3.0, 4.0]},
    "normally": {"normal": [3.5, 0.1]},
    "at one of three times": {"choice": [3.0, 3.5, 4.0]},
}


@pytest.mark.once
@pytest.mark.parametrize("leaves", LEAVES)
def test_a_drop_in_place_of_a_sampled_one_leaves_all_other_samples(leaves):
    payload = {"mass": {"uniform": [0.3, 0.4]}, "detach_time": LEAVES[leaves]}
    wind = {"ambient": {"uniform": [0.5, 2.0]}}
    game = flying(given={"payload": payload, "wind": wind, "sensor_noise": {"position": {"uniform": [0.0, 0.01]}}})
    turns(game, 0.5)
    assert order(game, do="drop") == ""
    turns(game, 0.5)
    assert told(game)["payload"] == "dropped"
    assert again(game, ["artde"]).frame() == game.frame()


@pytest.mark.once
def test_an_attached_payload_in_place_of_a_sampled_one_leaves_all_other_samples():
    payload = {"mass": {"normal": [0.3, 0.01]}, "position": [0.0, {"uniform": [0.0, 0.01]}, -0.1], "detach_time": 0.0}
    game = flying(given={"payload": payload, "wind": {"ambient": {"uniform": [0.5, 2.0]}}})
    turns(game, 0.5)
    assert order(game, do="attach", mass=0.2) == ""
    turns(game, 0.5)
    assert told(game)["payload"] == "held"
    assert again(game, ["artde"]).frame() == game.frame()


@pytest.mark.once
def test_a_payload_comes_and_goes():
    game = flying(given={})
    assert told(game)["payload"] == "none"
    assert "none" in order(game, do="drop")
    assert order(game, do="attach", mass=0.3) == ""
    assert game.time > 0.0  # at 0 an episode would begin in balance with it
    turns(game, 0.5)
    assert told(game)["payload"] == "held"
    assert "one already" in order(game, do="attach", mass=0.3)
    order(game, do="drop")
    turns(game, 0.3)
    assert told(game)["payload"] == "dropped"
    assert again(game, ["artde"]).frame() == game.frame()
    assert order(game, do="payload", on=True) == ""
    assert (game.time, told(game)["payload"], told(game)["laden"]) == (0.0, "held", True)
    order(game, do="payload", on=False)
    assert told(game)["payload"] == "none"


@pytest.mark.once
def test_a_payload_is_attached_to_a_walking_robot():
    game = walking()
    order(game, do="payload", on=False)
    turns(game, 0.5)
    order(game, do="attach", mass=1.0)
    turns(game, 0.5)
    assert game.record.disturbances()["payload"]["mass"] == 1.0
    assert again(game, ["artde"]).frame() == game.frame()


def test_pushes_come_from_all_sides():
    """A vehicle in the air gets most of the push's momentum, since its controller resists."""
    momentum = 3.0 * 0.2 / 1.83
    for way in np.vstack([np.eye(3), -np.eye(3)]):
        game = flying(given={"payload": 0.35})
        turns(game, 0.2)
        before = np.array(game.players[0].plant.engine.state().velocity)
        order(game, do="push", site="body", force=(3.0 * way).tolist())
        turns(game, 0.2)
        gained = np.array(game.players[0].plant.engine.state().velocity) - before
        assert 0.2 * momentum < gained @ way < momentum


def test_a_drag_is_one_push_for_the_page_and_ends_when_it_is_let_go():
    game = flying(given={})
    for size in (1.0, 1.0, 2.0):
        order(game, do="pull", site="body", force=[size, 0.0, 0.0])
        turns(game, 0.2)
    order(game, do="pull", site="body", force=None)
    turns(game, 0.5)
    pushes = game.record.disturbances()["push"]
    assert [one["magnitude"] for one in pushes] == [1.0, 2.0]
    assert pushes[0]["start"] + pushes[0]["duration"] == pytest.approx(pushes[1]["start"])
    (shown,) = told(game)["pushes"]
    assert shown["force"] == [2.0, 0.0, 0.0]
    assert shown["end"] < game.time - 0.3


def test_a_drag_ends_when_its_browser_is_gone():
    game = flying(given={})
    order(game, do="pull", site="body", force=[1.0, 0.0, 0.0])
    turns(game, 2.0)
    (push,) = game.record.disturbances()["push"]
    assert push["duration"] == pytest.approx(PULL_LASTS, abs=0.1)


def test_gains_and_controllers_change_while_it_runs():
    game, other = flying(), flying()
    for one in (game, other):
        turns(one, 0.5)
    order(game, do="gain", player=0, gain="k_p_p", value=told(game)["players"][0]["gains"]["k_p_p"][3])
    assert not told(game)["exact"]
    for one in (game, other):
        turns(one, 0.5)
    assert game.frame() == other.frame()  # the same gain is the same flight: its state went on
    order(game, do="gain", player=0, gain="k_p_p", value=1e6)
    _, _, high, value = told(game)["players"][0]["gains"]["k_p_p"]
    assert value == high
    turns(game, 0.2)
    assert game.frame()[4:] != other.frame()[4:]
    order(game, do="reset")
    assert told(game)["exact"]
    assert told(game)["players"][0]["gains"]["k_p_p"][3] == high
    order(game, do="controller", player=0, name="tde")
    assert told(game)["players"][0]["name"] == "tde"
    turns(game, 1.0)
    assert not game.over


@pytest.mark.parametrize(
    ("gain", "given", "shown"),
    [
        ("k_p", 30, 30.0),
        ("k_p", 30.0, 30.0),
        ("k_p", [20.0, 40.0] * 6, 30.0),
        ("m_bar", np.diag([0.03, 0.05] * 6).tolist(), 0.04),
    ],
)
def test_sliders_begin_at_the_gains_that_were_given(gain, given, shown):
    game = walking(gains={"artde": {gain: given}})
    assert told(game)["players"][0]["gains"][gain][3] == pytest.approx(shown)


def test_a_second_controller_comes_and_goes():
    game = flying()
    turns(game, 0.5)
    assert order(game, do="compare", name="tde") == ""
    assert ([player.name for player in game.players], game.time) == (["artde", "tde"], 0.0)
    assert "another one" in order(game, do="compare", name="artde")
    assert "another one" in order(game, do="controller", player=1, name="artde")
    size = len(game.frame())
    order(game, do="compare", name=None)
    assert len(game.frame()) < size


BAD: tuple[dict[str, Any], ...] = (
    {},
    {"do": "fly"},
    {"do": ["push"]},
    {"do": "__import__('os').getcwd()"},
    {"do": "push"},
    {"do": "push", "site": "nose", "force": [1, 0, 0]},
    {"do": "push", "site": "body", "force": [0, 0, 0]},
    {"do": "push", "site": "body", "force": [1, 0]},
    {"do": "push", "site": "body", "force": "1, 0, 0"},
    {"do": "push", "site": "body", "force": [1, 0, True]},
    {"do": "push", "site": "body", "force": [1, 0, 1e300]},
    {"do": "push", "site": "body", "force": [1, 0, 10**400]},
    {"do": "push", "site": "payload", "force": [1, 0, 0]},
    {"do": "pull", "site": ["body"], "force": [1, 0, 0]},
    {"do": "attach", "mass": 1e9},
    {"do": "attach", "mass": None},
    {"do": "payload", "on": 1},
    {"do": "condition", "kind": "push", "value": 1},
    {"do": "condition", "kind": "wind", "value": -1},
    {"do": "pause", "on": "yes"},
    {"do": "speed", "value": "fast"},
    {"do": "reset", "seed": -1},
    {"do": "reset", "seed": 2**40},
    {"do": "controller", "player": 0, "name": "nobody"},
    {"do": "controller", "player": 0, "name": "computed-torque"},
    {"do": "controller", "player": 1, "name": "tde"},
    {"do": "gain", "player": 0, "gain": "__class__", "value": 1},
    {"do": "gain", "player": 0, "gain": "k_p_p", "value": None},
    {"do": "compare", "name": 5},
)


def test_bad_orders_are_refused_and_change_nothing():
    game, other = flying(given={}), flying(given={})
    assert {one["do"] for one in BAD if isinstance(one.get("do"), str)} >= ORDERS.keys() - {"drop"}
    for one in (game, other):
        turns(one, 0.2)
    for bad in BAD:
        game.do(bad)
        assert game.refused, bad
    for one in (game, other):
        turns(one, 0.2)
        order(one, do="reset")
        turns(one, 0.2)
    assert game.frame() == other.frame()
    assert game.record.disturbances().keys() == {"payload"}  # one that never appears


def test_a_force_is_cut_to_what_the_grammar_allows():
    game = flying(given={})
    order(game, do="push", site="body", force=[0, 3e5, 4e5])
    (push,) = game.record.disturbances()["push"]
    assert push["magnitude"] == 500.0


def test_pushes_of_an_episode_are_bounded():
    record = Record({})
    for i in range(MOST_PUSHES):
        record.push(push_entry("body", (1.0 + i, 0.0, 0.0), float(i), 0.2))
        record.shown(float(i))
    assert len(record.shown(float(MOST_PUSHES))) <= 12
    with pytest.raises(OptionError, match="reset"):
        record.push(push_entry("body", (1.0, 0.0, 0.0), 1e4, 0.2))


def test_time_slows_down_stands_still_and_begins_anew():
    game = flying()
    order(game, do="speed", value=0.5)
    turns(game, 1.0)
    assert game.time == pytest.approx(0.5, abs=0.016)
    order(game, do="pause", on=True)
    turns(game, 1.0)
    assert game.time == pytest.approx(0.5, abs=0.016)
    order(game, do="pause", on=False)
    order(game, do="speed", value=100)
    assert game.speed == 4.0
    turns(game, 2.0)
    assert game.over
    order(game, do="push", site="body", force=[1, 0, 0])  # there is nothing left to be pushed
    assert "push" not in game.record.disturbances()
    order(game, do="reset", seed=7)
    assert (game.time, game.over, game.seed) == (0.0, False, 7)


class Broken:
    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> Any:
        return np.full(4, np.nan), None


class Unsound(Broken):
    """Somebody's own code, with an error of its own."""

    def predict(self, *args: Any, **kwargs: Any) -> Any:
        raise ZeroDivisionError("division by zero")


@pytest.mark.parametrize(
    ("policy", "fault"), [(Broken(), "finite"), (Unsound(), "ZeroDivisionError: division by zero")]
)
def test_a_controller_that_fails_ends_its_own_episode(policy, fault):
    game = flying({"mine": policy, "tde": "tde"})
    turns(game, 0.5)
    mine, tde = told(game)["players"]
    assert fault in mine["fault"]
    assert (mine["over"], mine["gains"], tde["over"]) == (True, {}, False)
    assert game.time == pytest.approx(0.5, abs=0.016)


def test_a_controller_that_cannot_be_built_is_refused(monkeypatch):
    game = flying()

    def fail(*_: Any) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("artde_gym.play.player.policy_for", fail)
    for words in ({"do": "controller", "player": 0, "name": "tde"}, {"do": "compare", "name": "tde"}):
        assert "ZeroDivisionError: division by zero" in order(game, **words)
        turns(game, 0.1)
    assert [player.name for player in game.players] == ["artde"]
    monkeypatch.setattr("artde_gym.play.text.make_controller", fail)
    assert json.loads(start_text(game))["start"]["controllers"] == []


@pytest.mark.parametrize("names", [[], ["tde", "artde", "pid"]])
def test_one_or_two_controllers(names):
    with pytest.raises(OptionError):
        flying(names)


def test_a_site_that_is_not_there_cannot_be_pushed():
    with pytest.raises(RobotError, match=r"'nose'.*'body'"):
        flying().players[0].plant.push("nose", (1.0, 0.0, 0.0))


def test_an_environment_that_tells_no_pose_is_refused(monkeypatch):
    monkeypatch.delattr("artde_gym.envs.engine_env.EngineEnv.pose")
    with pytest.raises(OptionError, match="pose"):
        Player(Cell("custom", "QuadInfinity-Payload-v0", dict(FLIGHT)), "x", Broken(), {})


class Deaf:
    """A server without browsers."""

    def __init__(self, orders: Any = ()) -> None:
        self.orders, self.news, self.watched = _Queue(orders), [], True

    def tell(self, news: Any) -> None:
        self.news = [*self.news[-3:], news]


def deaf(orders: Any = ()) -> Any:
    """In place of a `Server`."""
    return Deaf(orders)


class _Queue:
    def __init__(self, orders: Any) -> None:
        self._orders = list(orders)

    def qsize(self) -> int:
        return len(self._orders)

    def get_nowait(self) -> Any:
        if not self._orders:
            raise queue.Empty
        return self._orders.pop(0)


def test_a_flood_of_orders_does_not_stop_the_simulation():
    class Endless(_Queue):
        def get_nowait(self) -> Any:
            return {"do": "speed", "value": 1.0}  # and there is another one

    game, server, rounds = flying(), deaf(), itertools.count()
    server.orders = Endless([{}] * 3)
    run(game, server, lambda: next(rounds) < 6, lambda: 0.0, lambda _: None)
    assert game.time == pytest.approx(6 / RATE, abs=0.016)


def test_a_slow_computer_takes_its_time_and_a_fast_one_waits():
    game, server, now, waits = flying(), deaf([{"do": "speed", "value": 2.0}]), [0.0], []

    def sleep(duration: float) -> None:
        waits.append(duration)
        now[0] += duration

    run(game, server, lambda: len(waits) < 6, lambda: now[0], sleep)
    assert waits == pytest.approx([1 / RATE] * 6)
    assert game.time == pytest.approx(2 * 6 / RATE, abs=0.016)
    slow = itertools.count()
    run(game, server, lambda: len(waits) < 7 and next(slow) < 3, lambda: 10.0 * next(slow), sleep)
    assert len(waits) == 6  # behind: nothing to wait for
    assert json.loads(server.news[-1].start)["start"]["able"] == {"push": True, "drop": True, "attach": True}


def test_it_waits_for_a_browser():
    game, server, left = flying(), deaf(), [0]
    server.watched = False
    run(game, server, lambda: left.append(0) or len(left) < 9, lambda: 0.0, lambda _: None)
    assert game.time == 0.0
    assert server.news[-1].frame


def test_memory_does_not_grow():
    game = flying(given={"payload": 0.35, "wind": 1.0})
    server, left = deaf(), [0]

    def going() -> bool:
        left[0] -= 1
        if game.over:
            game.do({"do": "reset"})
        return left[0] >= 0

    def play(ticks: int) -> int:
        left[0] = ticks
        run(game, server, going, lambda: 0.0, lambda _: None)
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        first = play(60)
        assert play(120) - first < 50_000
    finally:
        tracemalloc.stop()


def test_the_page_gets_everything_about_the_robot():
    about = json.loads(start_text(flying()))["start"]
    assert about["push"] == {"site": "body", "force": 3.0, "most": 15.0}
    assert {"tde", "artde", "pid", "geometric"} <= set(about["controllers"])
    assert "computed-torque" not in about["controllers"]
    assert "wind" in [one["kind"] for one in about["conditions"]]
    assert about["signals"] == [
        "error (m)", "error (deg)", "thrust, largest (N)", "torque, largest (Nm)", "robust gain p", "robust gain q",
    ]  # fmt: skip
