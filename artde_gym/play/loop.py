"""The loop of live play: orders in, simulation in real time, news out."""

from __future__ import annotations

import time
from collections.abc import Callable

from artde_gym.play.game import Game
from artde_gym.play.server import News, Server
from artde_gym.play.text import start_text, told_text

RATE = 60.0  # Hz, of poses


def run(
    game: Game,
    server: Server,
    going: Callable[[], bool] = lambda: True,
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Play until `going` returns False; slower than real time if the simulation cannot keep up.

    It waits while no browser watches. Only this thread touches the simulation.
    """
    server.disturbances = lambda: game.record.disturbances()
    start, version, news, due = start_text(game), -1, News(), clock()
    while going():
        obey(game, server)
        if server.watched:
            game.advance(1.0 / RATE)
        told = news.told if game.version == version else told_text(game)
        version, news = game.version, News(start, told, game.frame())
        server.tell(news)
        due += 1.0 / RATE
        wait = due - clock()
        if wait > 0:
            sleep(wait)
        else:
            due = clock()


def obey(game: Game, server: Server) -> None:
    """Carry out the orders that wait; those that come meanwhile wait for the next round."""
    for _ in range(server.orders.qsize()):
        game.do(server.orders.get_nowait())  # no other thread takes any
