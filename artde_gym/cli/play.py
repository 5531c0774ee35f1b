"""`artde-gym play`: live simulation in a browser."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from artde_gym.cli.arguments import (
    Disturbances,
    Engine,
    EnvKwargs,
    Gains,
    Seed,
    environment_kwargs,
    given_disturbances,
    json_object,
    names,
)
from artde_gym.cli.display import terminal
from artde_gym.errors import OptionError

if TYPE_CHECKING:
    from artde_gym.play.server import Server


def play(
    controllers: Annotated[
        str, typer.Option("--controllers", "--controller", help="One name, or two to see side by side; see `list`.")
    ] = "artde",
    scenario: Annotated[str | None, typer.Option(help="Name; see `list`. Default: none, just --env.")] = None,
    env: Annotated[str | None, typer.Option(help="Environment id. Default: the scenario's, or a walk.")] = None,
    seed: Seed = 0,
    engine: Engine = None,
    disturbances: Disturbances = None,
    env_kwargs: EnvKwargs = None,
    gains: Gains = None,
    port: Annotated[int | None, typer.Option(help="Port. Default: 8765, or another one that is free.")] = None,
    host: Annotated[
        str, typer.Option(help="Address to listen at; any but a loopback address lets other machines in.")
    ] = "127.0.0.1",
    browser: Annotated[bool, typer.Option(help="Open a browser, where there is one.")] = True,
) -> None:
    """Watch and push the robot live in a browser.

    Also drop its payload, change gains, compare two controllers, and save what you did for `evaluate`.
    """
    from artde_gym.evaluation.plan import Plan  # only when asked for
    from artde_gym.play.game import Game
    from artde_gym.play.loop import run
    from artde_gym.play.server import Server

    if port is not None and not 0 <= port <= 65535:
        raise OptionError("--port", port, "0 to 65535")
    plan = Plan.of(
        names("--controllers", controllers),
        env,
        scenario=scenario,
        seed=seed,
        disturbances=given_disturbances(disturbances),
        env_kwargs=environment_kwargs(env_kwargs, engine),
        gains=json_object("--gains", gains),
    )
    game = Game(plan)  # first: what it refuses, no page should be opened for
    server = Server(host, port)
    try:
        _announce(server, browser)
        with _until_interrupted() as going:
            run(game, server, going)
    except KeyboardInterrupt:
        pass
    finally:
        server.close()


@contextlib.contextmanager
def _until_interrupted() -> Iterator[Callable[[], bool]]:
    """Let the first Ctrl-C end a loop between two rounds, and a second one at once.

    In the midst of a round it could leave a lock that threads of browsers wait for, and the command would not end.
    """
    ended = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield lambda: True  # signals are not told here
        return

    def end(*_: object) -> None:
        ended.set()
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, end)
    try:
        yield lambda: not ended.is_set()
    finally:
        signal.signal(signal.SIGINT, before)


def _announce(server: Server, browser: bool) -> None:
    """Open a browser or say what to open."""
    console = terminal()
    console.print(f"Live play: {server.address}", soft_wrap=True, highlight=False, markup=False)
    if not server.loopback:
        console.print("Whoever has this address can play along: it is open to other machines, and is not encrypted.")
    if browser and _has_display() and webbrowser.open(server.address):
        console.print("Opened in a browser. Ctrl-C ends it.")
        return
    if server.loopback:
        forward = f"ssh -L {server.forwarded} {socket.gethostname()}"
        console.print(f"From another machine: {forward}\nthen open the address there.", soft_wrap=True, highlight=False)
    console.print("Ctrl-C ends it.")


def _has_display() -> bool:
    """Tell whether a browser would open in front of the user, not in the terminal or on another machine."""
    if sys.platform in ("darwin", "win32"):
        return "SSH_CONNECTION" not in os.environ
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
