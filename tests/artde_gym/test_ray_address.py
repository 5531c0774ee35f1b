"""Addresses at which no Ray cluster is: an answer in words, and soon."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from artde_gym.errors import OptionError
from artde_gym.studies import sweep
from artde_gym.studies.sweep import ray_workers

pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra sweep)")
pytest.importorskip("ray", reason="Ray is not installed (extra scale)")

SMALL: dict[str, Any] = {"scenario": "Q1", "controller": "tde", "env_kwargs": {"duration": 0.1}}


def nobody() -> str:
    """An address that was somebody's a moment ago."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        return "{}:{}".format(*server.getsockname())


@pytest.mark.parametrize("address", ["{}", "ray://{}", "no-such-host.invalid:6379", "127.0.0.1:99999"])
def test_an_address_of_nobody_is_named(address: str, tmp_path: Path) -> None:
    address = address.format(nobody())
    with pytest.raises(OptionError, match=r"address .* is not that of a running Ray cluster") as caught:
        sweep(SMALL, tmp_path / "run", executor="ray", address=address)
    assert address in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1
    assert not (tmp_path / "run").exists()


HTTP_2 = b"\0\0\0\x04" + b"\0" * 5  # empty settings, and nothing after them


@pytest.fixture
def answering(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A server that answers every client with the same bytes, or takes what it says and is silent."""
    monkeypatch.setattr(ray_workers, "ANSWER_TIMEOUT_S", 0.3)
    monkeypatch.setattr(ray_workers, "JOIN_TIMEOUT_S", 3.0)
    servers: list[socket.socket] = []
    clients: list[socket.socket] = []

    def serve(answer: bytes) -> str:
        server = socket.create_server(("127.0.0.1", 0))
        servers.append(server)

        def run() -> None:
            while True:
                try:
                    client, _ = server.accept()
                except OSError:
                    return
                clients.append(client)
                if answer:
                    client.sendall(answer)

        threading.Thread(target=run, daemon=True).start()
        return "{}:{}".format(*server.getsockname())

    yield serve
    for server in servers:
        server.shutdown(socket.SHUT_RDWR)
        server.close()
    for client in clients:
        client.close()


@pytest.mark.parametrize("answer", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"SSH-2.0-OpenSSH\r\n", HTTP_2])
def test_somebody_else_at_the_address_is_no_cluster(answer: bytes, answering: Any, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="Ray cluster that answers within 20 s"):
        sweep(SMALL, tmp_path / "run", executor="ray", address=answering(answer))
