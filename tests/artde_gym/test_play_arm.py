"""Live play of an arm: pushes, a payload, gains and conditions, and that what was done can be done again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from artde_gym.evaluation import evaluate
from artde_gym.evaluation.plan import Plan
from artde_gym.play.conditions import conditions_of
from artde_gym.play.game import Game
from artde_gym.play.loop import RATE

ENV, KWARGS = "ArmTrack-Payload-v0", {"duration": 1.0, "engine": "mujoco"}


def order(game: Game, **words: Any) -> str:
    """Carry out an order and return why it was refused."""
    game.do(json.loads(json.dumps(words)))
    return game.refused


def turns(game: Game, seconds: float) -> None:
    for _ in range(round(seconds * RATE)):
        game.advance(1 / RATE)


def test_an_arm_is_pushed_and_loaded_while_it_runs_and_evaluate_repeats_it(tmp_path: Path) -> None:
    game = Game(Plan.of(["tde"], ENV, disturbances={}, env_kwargs=KWARGS))
    turns(game, 0.2)
    assert order(game, do="push", site="tool", force=[0.0, 60.0, 0.0]) == ""
    turns(game, 0.3)
    assert order(game, do="attach", mass=2.0) == ""
    turns(game, 0.2)
    assert order(game, do="drop") == ""
    turns(game, 1.0)
    assert game.over
    done = json.loads(json.dumps(game.record.disturbances()))
    assert done["payload"]["mass"] == 2.0
    result = evaluate(["tde"], ENV, episodes=1, seed=0, out=tmp_path, env_kwargs=KWARGS, disturbances=done)
    (row,) = result.episodes.to_dict(orient="records")
    assert row["duration_s"] == game.players[0].end
    assert not row["fell"]


def test_conditions_are_those_that_one_number_sets_on_the_robot() -> None:
    assert "joint_friction" in conditions_of("arm")
    assert "joint_friction" not in conditions_of("ojas")  # a scale of nothing
