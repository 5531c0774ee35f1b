"""What all tests share: reproducible examples, and a headless Chromium that is driven over its DevTools protocol."""

from __future__ import annotations

import base64
import functools
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest
import typer.main
import websocket
from hypothesis import settings

pytest_plugins = ("selection",)

settings.register_profile("reproducible", deadline=None, derandomize=True)
settings.load_profile("reproducible")

NAMES = ("chromium", "chromium-browser", "google-chrome")
STARTED = 30.0  # s, at most until the browser listens
QUIET = [
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-component-update",
    "--disable-background-networking", "--disable-sync", "--disable-dev-shm-usage", "--hide-scrollbars",
    "--remote-debugging-port=0", "--remote-allow-origins=*",
]  # fmt: skip
FLAT = ["--disable-gpu", "--disable-3d-apis"]  # as where there is no WebGL
SOLID = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]  # WebGL without a graphics card
SLOW = "GPU stall due to ReadPixels"  # of software's WebGL: no fault of the page


@pytest.fixture(scope="session", autouse=True)
def one_command_line():
    """Built once: Typer's runner builds it anew for each call, which takes longer than most calls do."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("typer.testing._get_command", functools.cache(typer.main.get_command))
        yield


def program() -> str | None:
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Chromium:
    """One page in a browser of its own; what it logs as an error, or fails to load, is in `errors`."""

    def __init__(self, *flags: str) -> None:
        found = program()
        assert found
        self._folder = tempfile.mkdtemp(prefix="chromium-")
        self._process = subprocess.Popen(
            [found, *QUIET, *flags, f"--user-data-dir={self._folder}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.errors: list[str] = []
        self.own: tuple[str, ...] = ("file:", "data:")  # what a page may ask for
        self._count = 0
        self._socket = websocket.create_connection(self._page(), timeout=60, suppress_origin=True)
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def __enter__(self) -> Chromium:
        return self

    def __exit__(self, kind: type | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait(30)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _page(self) -> str:
        port = Path(self._folder) / "DevToolsActivePort"
        end = time.monotonic() + STARTED
        while time.monotonic() < end:
            if port.exists() and (lines := port.read_text().split()):
                with urllib.request.urlopen(f"http://127.0.0.1:{lines[0]}/json/list") as answer:
                    pages = [page for page in json.load(answer) if page["type"] == "page"]
                if pages:
                    return pages[0]["webSocketDebuggerUrl"]
            time.sleep(0.05)
        raise TimeoutError("Chromium does not listen")

    def call(self, method: str, **params: Any) -> Any:
        """One command of the protocol; events that come meanwhile are looked through for errors."""
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": params}))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") == self._count:
                assert "error" not in message, message
                return message["result"]
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        method, params = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(str(params["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.errors.append(str(params["args"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            if SLOW not in params["entry"]["text"]:
                self.errors.append(params["entry"]["text"])
        elif method == "Network.loadingFailed":
            self.errors.append(params["errorText"])
        elif method == "Network.requestWillBeSent" and not params["request"]["url"].startswith(self.own):
            self.errors.append(f"asks for {params['request']['url']}")

    def open(self, path: Path, width: int = 1280, height: int = 900, *, dark: bool = False) -> None:
        self.visit(path.resolve().as_uri(), width, height, dark=dark)

    def visit(self, address: str, width: int = 1280, height: int = 900, *, dark: bool = False) -> None:
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.call("Page.navigate", url=address)
        while self.run("document.readyState") != "complete":
            time.sleep(0.05)

    def run(self, script: str) -> Any:
        """The value of an expression in the page, as JSON."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def picture(self, path: Path, *, whole: bool = False) -> None:
        found = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))


@pytest.fixture(scope="session")
def browser():
    if not program():
        pytest.skip("no Chromium here; on Debian: apt-get install chromium")
    with Chromium(*FLAT) as page:
        yield page


@pytest.fixture(scope="session")
def solid_browser():
    """A browser that draws in three dimensions, by software."""
    if not program():
        pytest.skip("no Chromium here; on Debian: apt-get install chromium")
    with Chromium(*SOLID) as page:
        yield page
