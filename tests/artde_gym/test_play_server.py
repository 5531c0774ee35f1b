"""The server of live play: who is let in, what a browser may send, and that none of them slows the simulation."""

from __future__ import annotations

import contextlib
import http.client
import json
import signal
import socket
import threading
import urllib.request
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from artde_gym.cli import app
from artde_gym.errors import OptionError
from artde_gym.evaluation.plan import Plan
from artde_gym.play.game import Game
from artde_gym.play.loop import run

pytest.importorskip("websockets")

from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from artde_gym.play.server import LARGEST_MESSAGE, MOST_BROWSERS, MOST_ORDERS, News, Server

FLIGHT = {"duration": 60.0, "engine": "mujoco"}
WAIT = 20.0  # s, at most for an answer


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server(port=0)
    yield made
    made.close()


@pytest.fixture
def game(server: Server) -> Iterator[Game]:
    """A flight that a server's browsers watch."""
    flown = Game(Plan.of(["artde"], "QuadInfinity-Payload-v0", disturbances={"payload": 0.35}, env_kwargs=FLIGHT))
    stopped = threading.Event()
    thread = threading.Thread(target=run, args=(flown, server, lambda: not stopped.is_set()))
    thread.start()
    yield flown
    stopped.set()
    thread.join()


def url(server: Server, token: str | None = None, path: str = "/socket") -> str:
    return f"ws://127.0.0.1:{server.port}{path}?token={server.token if token is None else token}"


def get(server: Server, path: str, headers: Any = (), method: str = "GET") -> tuple[int, Any, bytes]:
    """Status, headers and body; `headers` are pairs, a `Host` of theirs replaces the right one."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=WAIT)
    pairs = list(headers)
    connection.putrequest(method, path, skip_host=any(name == "Host" for name, _ in pairs))
    for name, value in pairs:
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    found = answer.status, dict(answer.headers), answer.read()
    connection.close()
    return found


def until(browser: Any, wanted: Any) -> dict[str, Any]:
    """The first words for which `wanted` holds."""
    while True:
        message = browser.recv(timeout=WAIT)
        if isinstance(message, str) and "told" in (words := json.loads(message)) and wanted(words["told"]):
            return words["told"]


def say(browser: Any, **order: Any) -> None:
    browser.send(json.dumps(order))


def refused(address: str, origin: Origin | None = None) -> int:
    """The status with which a socket is refused."""
    with pytest.raises(InvalidStatus) as met, connect(address, origin=origin):
        pass
    return met.value.response.status_code


PATHS = ("/", "/socket", "/disturbances.json", "/nothing")
OWN = "127.0.0.1:{port}"
STRANGERS = {
    "no token": ("", ()),
    "a wrong token": ("?token=wrong", ()),
    "a token that is no ASCII": ("?token=%C3%A9", ()),
    "two tokens": ("?token={token}&token=x", ()),
    "many fields": ("?token={token}" + "&a=1" * 20, ()),
    "a foreign origin": ("?token={token}", (("Origin", "http://evil.example"),)),
    "a hidden origin": ("?token={token}", (("Origin", "null"),)),
    "the own name by another scheme": ("?token={token}", (("Origin", "https://" + OWN),)),
    "another port's origin": ("?token={token}", (("Origin", "http://127.0.0.1:1"),)),
    "two origins": ("?token={token}", (("Origin", "http://" + OWN), ("Origin", "http://evil.example"))),
    "a foreign host": ("?token={token}", (("Host", "evil.example:{port}"),)),
    "a foreign host that is its origin": ("?token={token}", (("Host", "evil.example"), ("Origin", "http://evil.example"))),
    "another machine's address": ("?token={token}", (("Host", "192.0.2.1:{port}"),)),
    "no host": ("?token={token}", (("Host", ""),)),
    "two hosts": ("?token={token}", (("Host", OWN), ("Host", "evil.example"))),
    "a host that is none": ("?token={token}", (("Host", "[::1"),)),
    "an origin that is none": ("?token={token}", (("Origin", "http://[::1"),)),
}  # fmt: skip


@pytest.mark.parametrize("stranger", STRANGERS)
def test_strangers_get_403(server, stranger):
    query, headers = STRANGERS[stranger]
    known = {"token": server.token, "port": server.port}
    for path in PATHS:
        pairs = [(name, value.format(**known)) for name, value in headers]
        status, _, body = get(server, path + query.format(**known), pairs)
        assert status == 403
        assert server.token.encode() not in body


def test_a_path_that_cannot_be_read_gets_403(server):
    assert get(server, f"//[::1/?token={server.token}")[0] == 403


def test_strangers_get_no_socket(server):
    assert refused(url(server, "wrong")) == 403
    assert refused(url(server), Origin("http://evil.example")) == 403


def test_the_page_is_let_in_also_through_a_forwarded_port(server):
    for host in (f"127.0.0.1:{server.port}", "localhost:9999", "[::1]:80"):
        pairs = [("Host", host), ("Origin", f"http://{host}")]
        status, headers, body = get(server, f"/?token={server.token}", pairs)
        assert status == 200
        assert b'class="live"' in body
        assert server.token.encode() not in body
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "script-src 'nonce-" in policy
        assert "frame-ancestors 'none'" in policy
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Cache-Control"] == "no-store"


@pytest.mark.parametrize("path", ["/etc/passwd", "/../../etc/passwd", "//etc/passwd", "/disturbances.json/../x"])
def test_no_file_is_served(server, path):
    status, _, body = get(server, f"{path}?token={server.token}")
    assert (status, body) == (404, b"there is only the page\n")


def test_only_this_machine_can_connect(server):
    assert server.loopback
    assert server._server.socket.getsockname()[0] == "127.0.0.1"
    assert server.address == f"http://127.0.0.1:{server.port}/?token={server.token}"
    assert len(server.token) >= 32


def test_an_ipv6_address_is_one_to_listen_at():
    try:
        opened = Server("::1", 0)
    except OptionError as error:
        pytest.skip(str(error))  # a machine without IPv6
    try:
        assert opened.loopback
        assert opened.address == f"http://[::1]:{opened.port}/?token={opened.token}"
        assert opened.forwarded == f"{opened.port}:[::1]:{opened.port}"
        with urllib.request.urlopen(opened.address, timeout=WAIT) as answer:
            assert answer.status == 200
        with connect(opened.address.replace("http", "ws").replace("/?", "/socket?")) as browser:
            assert browser.protocol.state.name == "OPEN"
    finally:
        opened.close()


@pytest.mark.parametrize("host", ["é" * 100, "a\0b", ":::::", "[::1]", "::1%no-such-device"])
def test_a_host_that_is_none_is_refused(host):
    with pytest.raises(OptionError, match="host and port"):
        Server(host, 0)


def test_other_machines_only_when_told_so():
    opened = Server("0.0.0.0", 0)
    try:
        assert not opened.loopback
        asked = f"/?token={opened.token}"
        assert get(opened, asked, [("Host", f"192.0.2.1:{opened.port}")])[0] == 200  # an address: no name to be rebound
        assert get(opened, asked, [("Host", socket.gethostname())])[0] == 200
        assert get(opened, asked, [("Host", "evil.example")])[0] == 403
        assert get(opened, "/?token=wrong")[0] == 403
    finally:
        opened.close()


def test_a_port_that_is_taken(server):
    with pytest.raises(OptionError, match=f"127.0.0.1:{server.port}"):
        Server(port=server.port)
    with pytest.raises(OptionError, match=r"203\.0\.113\.1"):
        Server("203.0.113.1", 0)


NO_ORDERS = {
    "no JSON": "push!",
    "Python": "__import__('os').system('true')",
    "a list": "[1]",
    "a number": "1",
    "NaN": '{"do": "speed", "value": NaN}',
    "infinity": '{"do": "speed", "value": -Infinity}',
    "deep": "[" * 4000,
    "bytes": b'{"do": "drop"}',
    "too long": '{"do": "' + "x" * LARGEST_MESSAGE + '"}',
}


@pytest.mark.parametrize("case", NO_ORDERS)
def test_what_is_no_order_ends_its_connection_alone(server, case):
    with connect(url(server)) as other, connect(url(server)) as browser:
        browser.send(NO_ORDERS[case])
        with pytest.raises(ConnectionClosed) as closed:
            browser.recv(timeout=WAIT)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code in (1003, 1009)
        assert server.orders.empty()
        say(other, do="drop")
        assert server.orders.get(timeout=WAIT) == {"do": "drop"}


def test_a_flood_of_orders_ends_its_connection(server):
    with connect(url(server)) as browser:
        for _ in range(MOST_ORDERS + 1):
            say(browser, do="pause", on=True)
        with pytest.raises(ConnectionClosed) as closed:
            browser.recv(timeout=WAIT)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
    assert server.orders.qsize() == MOST_ORDERS


def test_so_many_browsers_and_no_more(server):
    with contextlib.ExitStack() as opened:
        browsers = [opened.enter_context(connect(url(server))) for _ in range(MOST_BROWSERS)]
        server.tell(News("start", "told", b""))
        assert [browser.recv(timeout=WAIT) for browser in browsers] == ["start"] * MOST_BROWSERS
        assert refused(url(server)) == 503


def test_a_browser_that_does_not_read_misses_poses_and_stops_nobody(server):
    frame = bytes(1_000_000)
    with connect(url(server), close_timeout=0.1) as slow, connect(url(server)) as other:
        server.tell(News("start", "0", frame))
        assert slow.recv(timeout=WAIT) == "start"
        for i in range(200):  # far more than any buffer holds
            server.tell(News("start", str(i), frame))
        while other.recv(timeout=WAIT) != "199":
            pass
        assert len(server._slots) == 2


def test_orders_reach_the_simulation_and_its_news_the_browser(server, game):
    with connect(url(server)) as browser:
        about = json.loads(browser.recv(timeout=WAIT))["start"]
        told = until(browser, lambda told: True)
        assert [player["name"] for player in told["players"]] == ["artde"]
        frame = next(message for message in iter(browser.recv, None) if isinstance(message, bytes))
        size = 1 + 10 + about["joints"] + about["loads"] + len(about["signals"])
        assert np.frombuffer(frame, np.float32).shape == (size,)
        say(browser, do="push", site="nose", force=[1, 0, 0])
        assert "'nose'" in until(browser, lambda told: told["refused"])["refused"]
        say(browser, do="drop")
        assert until(browser, lambda told: told["payload"] == "dropped")["refused"] == ""
        say(browser, do="pause", on=True)
        assert until(browser, lambda told: told["paused"])
        status, headers, body = get(server, f"/disturbances.json?token={server.token}")
        assert (status, headers["Content-Type"]) == (200, "application/json")
        assert json.loads(body) == game.record.disturbances()
        say(browser, do="reset", seed=5)
        assert until(browser, lambda told: told["seed"] == 5)["payload"] == "held"


def test_the_command_serves_until_it_is_interrupted(monkeypatch):
    met: list[Any] = []

    def interrupted(game: Game, server: Server, going: Any) -> None:
        met.append((get(server, f"/?token={server.token}")[0], [player.name for player in game.players]))
        raise KeyboardInterrupt

    monkeypatch.setattr("artde_gym.play.loop.run", interrupted)
    monkeypatch.setattr("webbrowser.open", lambda address: met.append(address) or True)
    monkeypatch.setenv("DISPLAY", ":0")
    words = ["play", "--env", "QuadInfinity-Payload-v0", "--port", "0", "--controllers", "tde,artde"]
    done = CliRunner().invoke(app, words)
    assert (done.exit_code, done.exception) == (0, None)
    assert met[1] == (200, ["tde", "artde"])
    assert met[0] in done.output.replace("\n", "")
    plain = CliRunner().invoke(app, [*words, "--no-browser"])
    assert "ssh -L" in plain.output
    other = CliRunner().invoke(app, [*words, "--no-browser", "--host", "localhost"])
    assert ":localhost:" in other.output.partition("ssh -L")[2]  # where it listens
    assert len(met) == 4


def test_an_interruption_waits_for_the_end_of_a_round(monkeypatch):
    """In the midst of `tell` it would leave threads that wait forever, and a command that does not end."""
    reached: list[int] = []
    tell, before = Server.tell, signal.getsignal(signal.SIGINT)

    def told(server: Server, news: News) -> None:
        signal.raise_signal(signal.SIGINT)
        tell(server, news)
        reached.append(1)

    monkeypatch.setattr(Server, "tell", told)
    done = CliRunner().invoke(app, ["play", "--env", "QuadInfinity-Payload-v0", "--port", "0", "--no-browser"])
    assert (done.exit_code, done.exception, reached) == (0, None, [1])
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("words", [["--port", "70000"], ["--port", "-1"], ["--controllers", "tde,artde,pid"]])
def test_bad_options(words):
    error = CliRunner().invoke(app, ["play", "--env", "QuadInfinity-Payload-v0", *words]).exception
    assert isinstance(error, OptionError)
