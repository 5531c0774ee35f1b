"""Texts of live play for a page: what it has to know first, and what it shows beside the motion."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from typing import Any

from artde_gym.disturbances.kinds import DISTURBANCES
from artde_gym.kit import PAYLOAD, ROBOTS, Push
from artde_gym.motion.page import json_text
from artde_gym.motion.scene import scene_of
from artde_gym.palette import styles
from artde_gym.play.conditions import condition_text, conditions_of
from artde_gym.play.game import Game, comes
from artde_gym.play.player import Player
from artde_gym.play.record import MAGNITUDE
from artde_gym.registration import make_controller, registered_controllers
from artde_gym.scenarios import CUSTOM, SCENARIOS

PUSH_FORCE = 10.0  # N, initial force of a push unless the robot's kit sets one
LARGEST_PUSH = 5.0  # over the initial one
RECORD = "play.json"
"""Name of the file of disturbances that a page saves."""
_EPS = 1e-9  # s


def start_text(game: Game) -> str:
    """Return what a page has to know first, as JSON."""
    cell, plant = game.cell, game.players[0].plant
    pose = plant.pose()
    site, force = ROBOTS[plant.robot_name].push or Push(game.sites[0], PUSH_FORCE)
    entry = SCENARIOS.get(cell.name)
    about = {
        "title": f"{entry.name}: {entry.text}" if entry else cell.env_id,
        "scene": scene_of(plant.robot_name, cell.kwargs, cell.env_id).text(),
        "sites": game.sites,
        "push": {"site": site, "force": force, "most": min(LARGEST_PUSH * force, MAGNITUDE.high)},
        "mass": game.payload["mass"],
        "able": game.able,
        "joints": len(pose.q),
        "loads": len(pose.loads),
        "signals": game.players[0].labels,
        "controllers": [name for name in sorted(registered_controllers()) if _builds(name, plant)],
        "conditions": [condition_text(kind) for kind in conditions_of(plant.robot_name)],
    }
    return json_text({"start": about})


def told_text(game: Game) -> str:
    """Return what a page shows beside the motion, as JSON."""
    sampled = game.leader.plant.sampled_disturbances
    hanging = sampled.get(PAYLOAD, {})
    known = {
        "players": [
            {**_player_text(player), "color": style.color}
            for player, style in zip(game.players, styles(p.name for p in game.players).values(), strict=True)
        ],
        "seed": game.seed,
        "speed": game.speed,
        "paused": game.paused,
        "over": game.over,
        "pushes": [*game.scheduled, *game.record.shown(game.time)],
        "payload": _state(hanging, game.time),
        "laden": PAYLOAD in game.given,
        "hook": list(hanging["position"]) if hanging.get("cable") else None,
        "conditions": _sizes(game.players[0].plant.robot_name, sampled),
        "refused": game.refused,
        "command": command(game),
        "exact": not any(player.swapped for player in game.players),
    }
    return json_text({"told": known})


def command(game: Game) -> str:
    """Return the command that runs this episode again, with the file that the page saves."""
    cell = game.cell
    given = {name: value for name, value in cell.kwargs.items() if name != "disturbances"}
    gains = {player.name: player.gains for player in game.players if player.gains}
    names = ",".join(player.name for player in game.players)
    words = ["artde-gym", "evaluate", "--controllers", names, "--episodes", "1", "--seed", str(game.seed)]
    words += ["--env", cell.env_id] if cell.name == CUSTOM else ["--scenario", cell.name]
    words += ["--env-kwargs", json.dumps(given)] if given else []
    words += ["--gains", json.dumps(gains)] if gains else []
    return shlex.join([*words, "--disturbances", RECORD])


def _player_text(player: Player) -> dict[str, Any]:
    return {
        "name": player.name,
        "gains": player.sliders(),
        "over": player.over,
        "fall": player.fall,
        "fault": player.fault,
        "end": player.end,
    }


def _state(payload: Mapping[str, Any], time: float) -> str:
    """Return "none", "waiting", "held" or "dropped"."""
    if not comes(payload):
        return "none"
    if time < payload["attach_time"] - _EPS:
        return "waiting"
    return "held" if time < payload["detach_time"] - _EPS else "dropped"


def _sizes(robot: str, sampled: Mapping[str, Any]) -> dict[str, float]:
    """Return the sizes of the conditions of an episode."""
    named = {kind: DISTURBANCES[kind].shorthand for kind in conditions_of(robot) if kind in sampled}
    return {kind: sampled[kind][size] for kind, size in named.items() if size in sampled[kind]}


def _builds(name: str, plant: Any) -> bool:
    """Tell whether a controller can be built for an environment here."""
    try:
        make_controller(name, plant)
    except Exception:  # of somebody's own controller, too
        return False
    return True
