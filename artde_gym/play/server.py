"""A page and its WebSocket on one port of this machine.

Access takes the token of the printed address, a `Host` that is this machine (no other name can be made to point here),
and, of a browser, the page's own origin. A browser that is slow misses poses and never makes the simulation wait.
"""

from __future__ import annotations

import hmac
import ipaddress
import json
import logging
import queue
import secrets
import socket
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from typing import Any, NamedTuple
from urllib.parse import parse_qs, urlsplit

from artde_gym.errors import OptionError
from artde_gym.extras import needs
from artde_gym.play.page import live_page, policy_of

with needs("play"):
    from websockets.datastructures import Headers
    from websockets.exceptions import ConnectionClosed
    from websockets.http11 import Request, Response
    from websockets.sync.server import ServerConnection, serve

LOOPBACK = "127.0.0.1"
PORT = 8765  # where it is free
LARGEST_MESSAGE = 4096  # bytes, of a browser
MOST_ORDERS = 256  # waiting; a browser that sends more is cut off
MOST_BROWSERS = 8
PATIENCE = 2.0  # s, with a browser that connects and asks for nothing, or does not answer at the end
DISTURBANCES = "/disturbances.json"
"""Path of the file of what was done."""
_quiet = logging.getLogger("artde_gym.play")
_quiet.addHandler(logging.NullHandler())
_quiet.propagate = False


class News(NamedTuple):
    """News for browsers: first words, further words, poses."""

    start: str = ""
    told: str = ""
    frame: bytes = b""


class _Slot:
    """The latest news for one browser."""

    def __init__(self, news: News) -> None:
        self._changed, self._news, self._ended = threading.Condition(), news, False

    def put(self, news: News) -> None:
        with self._changed:
            self._news = news
            self._changed.notify_all()

    def end(self) -> None:
        """Let `get` return None from now on."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def get(self, known: News) -> News | None:
        """Wait for news other than those known, and return them; None at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._news != known)
            return None if self._ended else self._news


class Server:
    """HTTP and a WebSocket on one port.

    Args:
        host: address to listen at; others than loopback ones let other machines in.
        port: port; 0 for any that is free, None for `PORT` or else any.

    Attributes:
        host: as given.
        orders: of browsers, not yet checked.
        disturbances: function that returns what was done, for the file; set by `run`.

    Raises:
        OptionError: for a host or port at which this machine cannot listen.
    """

    def __init__(self, host: str = LOOPBACK, port: int | None = None) -> None:
        self.token, self._nonce = secrets.token_urlsafe(24), secrets.token_urlsafe(16)
        self.orders: queue.Queue[Mapping[str, Any]] = queue.Queue(MOST_ORDERS)
        self.disturbances: Callable[[], Mapping[str, Any]] = dict
        self.host, self._page = host, live_page(self._nonce).encode()
        self._slots: dict[ServerConnection, _Slot] = {}
        self._lock, self._news = threading.Lock(), News()
        self._server = self._listening(port)
        self.port: int = self._server.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def _listening(self, port: int | None) -> Any:
        try:
            family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
            place = (self.host, PORT if port is None else port)
            socket.getaddrinfo(self.host or None, 0, family)  # `create_server` leaves a socket open where this fails
            return serve(
                self._watch,
                sock=socket.create_server(place, family=family),
                process_request=self._admit,
                compression=None,
                max_size=LARGEST_MESSAGE,
                open_timeout=PATIENCE,
                close_timeout=PATIENCE,
                server_header=None,
                logger=_quiet,
            )
        except (OSError, ValueError) as error:  # ValueError: a name that cannot be encoded
            if port is None:
                return self._listening(0)
            raise OptionError(
                "host and port",
                f"{_bracketed(self.host)}:{port}",
                f"an address of this machine and a free port ({error})",
            ) from error

    @property
    def loopback(self) -> bool:
        """True if no other machine can connect."""
        return _is_loopback(self.host)

    @property
    def watched(self) -> bool:
        """True while any browser is connected."""
        return bool(self._slots)

    @property
    def address(self) -> str:
        """The address of the page, with its token."""
        host = socket.gethostname() if self.host in ("0.0.0.0", "::", "") else _bracketed(self.host)
        return f"http://{host}:{self.port}/?token={self.token}"

    @property
    def forwarded(self) -> str:
        """The argument of `ssh -L` that makes the same port of another machine lead here."""
        return f"{self.port}:{_bracketed(self.host)}:{self.port}"

    def tell(self, news: News) -> None:
        """Give all browsers the latest news; none of them is waited for."""
        with self._lock:
            self._news = news
            slots = list(self._slots.values())
        for slot in slots:
            slot.put(news)

    def close(self) -> None:
        """End all connections; safe to call twice."""
        self._server.shutdown()
        self._thread.join()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a request; None lets the WebSocket begin."""
        if not self._allowed(request):
            return _answer(connection, HTTPStatus.FORBIDDEN, "open the address that artde-gym play has printed")
        path = urlsplit(request.path).path
        if path == "/":
            return self._sent(
                self._page, "text/html; charset=utf-8", {"Content-Security-Policy": policy_of(self._nonce)}
            )
        if path == DISTURBANCES:
            text = json.dumps(self.disturbances(), indent=1) + "\n"
            return self._sent(text.encode(), "application/json", {})
        if path != "/socket":
            return _answer(connection, HTTPStatus.NOT_FOUND, "there is only the page")
        with self._lock:
            full = len(self._slots) >= MOST_BROWSERS
        return _answer(connection, HTTPStatus.SERVICE_UNAVAILABLE, "too many browsers") if full else None

    def _allowed(self, request: Request) -> bool:
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or not self._is_here(hosts[0]) or len(origins) > 1:
            return False
        try:
            if origins and urlsplit(origins[0])[:2] != ("http", hosts[0]):
                return False
            given = parse_qs(urlsplit(request.path).query, max_num_fields=8).get("token", [""])
        except ValueError:
            return False
        return len(given) == 1 and hmac.compare_digest(given[0].encode(), self.token.encode())

    def _is_here(self, host: str) -> bool:
        """Tell whether a `Host` is this machine by address or by its own name."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        if self.loopback or _is_loopback(name):
            return _is_loopback(name)
        return _is_address(name) or name in (self.host.lower(), socket.gethostname().lower())

    def _sent(self, body: bytes, kind: str, more: Mapping[str, str]) -> Response:
        headers = {
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Referrer-Policy": "no-referrer",
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Connection": "close",
            **more,
        }
        return Response(HTTPStatus.OK, "OK", Headers(headers), body)

    def _watch(self, connection: ServerConnection) -> None:
        """Send news to one browser until it leaves."""
        with self._lock:
            slot = self._slots[connection] = _Slot(self._news)
        threading.Thread(target=self._listen, args=(connection, slot), daemon=True).start()
        known = News()
        try:
            while (news := slot.get(known)) is not None:
                for before, now in zip(known, news, strict=True):
                    if now != before and now:
                        connection.send(now)
                known = news
        except ConnectionClosed:
            pass
        finally:
            with self._lock:
                del self._slots[connection]

    def _listen(self, connection: ServerConnection, slot: _Slot) -> None:
        """Take orders of one browser; what is no JSON object ends its connection, as do too many of them."""
        try:
            for message in connection:
                self.orders.put_nowait(_order(message))
        except ConnectionClosed:
            pass
        except ValueError:
            connection.close(1003, "orders are JSON objects")
        except queue.Full:
            connection.close(1008, "too many orders")
        finally:
            slot.end()


def _order(message: str | bytes) -> Mapping[str, Any]:
    """Read a message of a browser.

    Raises:
        ValueError: for anything but a JSON object of finite numbers.
    """
    if not isinstance(message, str):
        raise ValueError("bytes")
    try:
        order = json.loads(message, parse_constant=_refuse)
    except RecursionError as error:
        raise ValueError("too deep") from error
    if not isinstance(order, dict):
        raise ValueError("no object")
    return order


def _refuse(constant: str) -> None:
    raise ValueError(constant)


def _answer(connection: ServerConnection, status: HTTPStatus, text: str) -> Response:
    return connection.respond(status, f"{text}\n")


def _bracketed(host: str) -> str:
    """Return a host as it stands before a port: an IPv6 address in brackets."""
    return f"[{host}]" if ":" in host else host


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_loopback(name: str) -> bool:
    return name == "localhost" or (_is_address(name) and ipaddress.ip_address(name).is_loopback)
