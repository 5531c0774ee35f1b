"""`artde-gym replay`: episodes to be turned and stopped in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from artde_gym.cli.arguments import (
    Disturbances,
    Engine,
    EnvKwargs,
    Gains,
    environment_kwargs,
    given_disturbances,
    json_object,
    names,
)
from artde_gym.cli.display import passing_bar, terminal
from artde_gym.errors import OptionError
from artde_gym.files import check_replaceable


def replay(
    folder: Annotated[
        Path | None, typer.Argument(help="Results folder of `evaluate`. Default: none, an episode is run.")
    ] = None,
    out: Annotated[Path, typer.Option(help="File to write.")] = Path("replay.html"),
    scenario: Annotated[str | None, typer.Option(help="Names, comma-separated. Default: all of the folder.")] = None,
    controllers: Annotated[
        str | None, typer.Option(help="Names, comma-separated, at most four. Default: the folder's first, or artde.")
    ] = None,
    episode: Annotated[
        int | None, typer.Option(help="Number. Default: worst, median and best of the folder, or 0.")
    ] = None,
    env: Annotated[str | None, typer.Option(help="Without a folder: environment id.")] = None,
    seed: Annotated[int | None, typer.Option(help="Without a folder: base random seed. Default: 0.")] = None,
    engine: Engine = None,
    disturbances: Disturbances = None,
    env_kwargs: EnvKwargs = None,
    gains: Gains = None,
    viewer: Annotated[
        str | None, typer.Option(help="Address of a viewer that several files share. Default: one in the file.")
    ] = None,
) -> None:
    """Write an interactive replay of episodes as one HTML file.

    The episodes are those of a results folder, or of a new run. A browser shows them without a network.
    """
    from artde_gym.evaluation.replay import replay as run_replay  # only when asked for
    from artde_gym.evaluation.replay import replay_folder

    check_replaceable(out)
    console = terminal()
    with passing_bar(console) as bar:
        shown = bar.add_task("")

        def told(name: str, time: float) -> None:
            bar.update(shown, description=f"{name}: {time:.1f} s simulated")

        if folder is None:
            made = run_replay(
                names("--controllers", "artde" if controllers is None else controllers),
                env,
                scenario=scenario,
                seed=seed or 0,
                episode=episode or 0,
                disturbances=given_disturbances(disturbances),
                env_kwargs=environment_kwargs(env_kwargs, engine),
                gains=json_object("--gains", gains),
                on_progress=told,
            )
        else:
            own = {"--env": env, "--engine": engine, "--disturbances": disturbances, "--env-kwargs": env_kwargs}
            for option, value in {**own, "--gains": gains, "--seed": seed}.items():
                if value is not None:
                    raise OptionError(
                        option, value, "leave it out", "does not go with a folder, whose episodes stay as they were run"
                    )
            wanted = None if scenario is None else names("--scenario", scenario)
            chosen = None if controllers is None else names("--controllers", controllers)
            made = replay_folder(folder, wanted, chosen, episode, on_progress=told)
    file = made.save(out, viewer=viewer)
    for note in made.notes:
        console.print(f"Note: {note}", soft_wrap=True)
    console.print(f"Written to {file}", soft_wrap=True)
