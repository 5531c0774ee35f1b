"""`artde-gym play`: live simulation with user interaction."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from artde_gym.arguments import check_integer
from artde_gym.cli.arguments import (
    WALK,
    Disturbances,
    Engine,
    EnvKwargs,
    Gains,
    Seed,
    environment_kwargs,
    json_object,
    optional_json,
)
from artde_gym.errors import OptionError
from artde_gym.registration import make_controller


def play(
    controller: Annotated[str, typer.Option(help="Name; see `list`.")] = "artde",
    scenario: Annotated[str | None, typer.Option(help="Name; see `list`. Default: none, just --env.")] = None,
    env: Annotated[str | None, typer.Option(help=f"Environment id. Default: the scenario's, or {WALK}.")] = None,
    seed: Seed = 0,
    engine: Engine = None,
    disturbances: Disturbances = None,
    env_kwargs: EnvKwargs = None,
    gains: Gains = None,
) -> None:
    """Watch a controller live in a window; push the robot and drop its payload with keys or the mouse."""
    from artde_gym.evaluation.cells import cells_of  # only when asked for
    from artde_gym.evaluation.environments import single
    from artde_gym.play import HELP, Session
    from artde_gym.sim.window import open_window

    check_integer("seed", seed, 0)
    kwargs, overrides = environment_kwargs(env_kwargs, engine), json_object("--gains", gains)
    (cell,) = cells_of(env, scenario, kwargs, optional_json("--disturbances", disturbances))
    window = open_window()
    try:
        plant = single(cell.env_id, json.dumps(cell.kwargs))
        if not hasattr(plant.unwrapped, "engine"):
            raise OptionError(
                "env", cell.env_id, "choose one that has", "has no physics engine that a window could show"
            )
        policy = make_controller(controller, plant, **overrides)
        window.load(plant.unwrapped.engine.spec)
        print("\n".join((*HELP, "A click pushes away from the viewer, at the nearest site of the robot.")))
        Session(plant, policy, window, controller, seed).run()
    finally:
        window.close()
