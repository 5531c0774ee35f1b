"""Live play in a real browser: it shows the simulation, and everything on the page does something to it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from artde_gym.evaluation.plan import Plan
from artde_gym.play.game import Game
from artde_gym.play.loop import run
from artde_gym.play.server import Server

pytestmark = pytest.mark.browser

FLIGHT = {"duration": 60.0, "engine": "mujoco"}
LIVE = "document.querySelector('.live').live"
DRAG = """
(() => {
  const { scene } = %s, [run] = scene.runs, box = scene.canvas.getBoundingClientRect();
  const p = run.robot.site("body").project(run.seen.camera);
  const x = box.left + run.seen.x + ((p.x + 1) / 2) * run.seen.w;
  const y = box.top + run.seen.y + ((1 - p.y) / 2) * run.seen.h;
  const more = { clientY: y, button: 0, buttons: 1, isPrimary: true, pointerId: 1, bubbles: true };
  const send = (type, dx) => scene.canvas.dispatchEvent(new PointerEvent(type, { clientX: x + dx, ...more }));
  scene.canvas.setPointerCapture = () => {};
  send("pointerdown", 0);
  send("pointermove", 60);
  globalThis.release = () => send("pointerup", 60);
  return scene.hand.held?.site ?? null;
})()"""
PRESS = "[...document.querySelectorAll('.live button')].find((one) => one.textContent.includes('{}')).click()"
KEY = "document.body.dispatchEvent(new KeyboardEvent('keydown', {{key: '{}', bubbles: true}}))"
NAMED = """
[...document.querySelectorAll(".live :is(button, select, input, a, [role=img])")].filter((one) =>
  !(one.getAttribute("aria-label") || one.textContent.trim() || one.closest("label")?.textContent.trim())).length"""


@pytest.fixture(scope="module")
def played() -> Iterator[tuple[Game, Server]]:
    server = Server(port=0)
    plan = Plan.of(["artde"], "QuadInfinity-Payload-v0", disturbances={"payload": 0.35}, env_kwargs=FLIGHT)
    game, stopped = Game(plan), threading.Event()
    thread = threading.Thread(target=run, args=(game, server, lambda: not stopped.is_set()))
    thread.start()
    yield game, server
    stopped.set()
    thread.join()
    server.close()


def wait(holds: Callable[[], Any]) -> Any:
    end = time.monotonic() + 60
    while not (found := holds()):
        assert time.monotonic() < end
        time.sleep(0.05)
    return found


def begin(game: Game, server: Server) -> None:
    """Pause and begin anew, by orders as browsers send them: only one thread touches the simulation."""
    record = game.record
    server.orders.put({"do": "pause", "on": True})
    server.orders.put({"do": "reset", "seed": 0})
    wait(lambda: game.record is not record)


@pytest.fixture
def page(played: tuple[Game, Server], solid_browser: Any) -> Iterator[Any]:
    """The page of a paused flight at its beginning."""
    game, server = played
    begin(game, server)
    before = solid_browser.own
    solid_browser.own = (*before, f"http://127.0.0.1:{server.port}/", f"ws://127.0.0.1:{server.port}/")
    visit(solid_browser, server)
    yield solid_browser
    solid_browser.visit("about:blank")
    solid_browser.own = before


def visit(browser: Any, server: Server, width: int = 1280, height: int = 900, *, dark: bool = False) -> None:
    browser.errors.clear()
    browser.visit(server.address, width, height, dark=dark)
    wait(lambda: browser.run("document.querySelector('.live').dataset.ready"))
    assert browser.errors == []


def test_its_poses_are_the_simulations(page, played):
    game, _ = played
    page.run(f"{LIVE}.say({{do: 'pause', on: false}})")
    wait(lambda: game.time > 0.5)
    page.run(f"{LIVE}.say({{do: 'pause', on: true}})")
    wait(lambda: game.paused)
    plant = game.players[0].plant
    sites = {name: plant.engine.site(name) for name, _, _ in plant.nominal_robot.sites}

    def same() -> bool:
        found = page.run(f"{[*sites]!s}.map((name) => {LIVE}.scene.runs[0].robot.site(name).toArray())")
        return np.allclose(found, [*sites.values()], rtol=0, atol=1e-5)

    wait(same)
    ball = page.run(f"{LIVE}.scene.runs[0].robot.ball.position.toArray()")
    np.testing.assert_allclose(ball, plant.engine.payload_position(), rtol=0, atol=1e-5)


def test_buttons_keys_and_sliders_are_orders(page, played):
    game, _ = played
    run_ = page.run
    run_(KEY.format(" "))
    wait(lambda: not game.paused)
    run_(KEY.format("ArrowUp"))
    run_(PRESS.format("left"))
    wait(lambda: len(game.record.disturbances().get("push", ())) == 2)
    assert [one["direction"] for one in game.record.disturbances()["push"]] == [[1, 0, 0], [0, 1, 0]]
    run_(KEY.format("d"))
    wait(lambda: run_("document.querySelector('.live .soft').textContent") == "dropped")
    wait(lambda: run_(f"{LIVE}.scene.strips[0].lines[0]?.values.length") > 10)
    gain = "document.querySelector('.live details .row input')"
    run_(f"{gain}.value = Math.log(12); {gain}.dispatchEvent(new Event('change'))")
    wait(lambda: game.players[0].gains)
    assert next(iter(game.players[0].gains.values())) == pytest.approx(12.0, rel=1e-3)
    wait(lambda: not run_(f"{LIVE}.told.exact"))
    beside = "document.querySelector('.live [aria-label=\"beside it\"]')"
    run_(f"{beside}.value = 'tde'; {beside}.dispatchEvent(new Event('change'))")
    wait(lambda: run_(f"{LIVE}.scene.runs.length") == 2)
    assert [player.name for player in game.players] == ["artde", "tde"]
    run_(f"{beside}.value = ''; {beside}.dispatchEvent(new Event('change'))")
    wait(lambda: run_(f"{LIVE}.scene.runs.length") == 1)
    run_(f"{LIVE}.say({{do: 'fly'}})")
    wait(lambda: "'fly'" in run_("document.querySelector('.live .refused').textContent"))
    assert page.errors == []


def test_a_body_is_pulled_and_let_go(page, played):
    game, _ = played
    wait(lambda: page.run(f"Boolean({LIVE}.scene.runs[0].seen)"))
    assert page.run(DRAG % LIVE) in game.sites
    page.run(KEY.format(" "))
    wait(lambda: game.record.disturbances().get("push"))
    page.run("release()")
    wait(lambda: game._pull is None)
    pushes = game.record.disturbances()["push"]
    assert all(0 < one["magnitude"] <= 15.0 for one in pushes)
    assert page.run(f"{LIVE}.scene.orbit.enabled")
    assert page.errors == []


@pytest.mark.parametrize(("width", "dark"), [(375, True), (800, False)])
def test_it_fits_and_everything_has_a_name(page, played, width, dark):
    visit(page, played[1], width, dark=dark)
    page.run("document.querySelectorAll('.live details').forEach((one) => { one.open = true; })")
    assert page.run("document.documentElement.scrollWidth") <= width
    assert page.run(NAMED) == 0
    sky = f"{LIVE}.scene.canvas.getContext('2d').getImageData(2, 2, 1, 1).data[0]"
    wait(lambda: page.run(sky) < 60 if dark else page.run(sky) > 200)


def test_without_webgl_everything_else_works(played, browser):
    game, server = played
    before = browser.own
    browser.own = (*before, f"http://127.0.0.1:{server.port}/", f"ws://127.0.0.1:{server.port}/")
    begin(game, server)
    visit(browser, server)
    assert "no WebGL" in browser.run("document.querySelector('.live').textContent")
    browser.run(PRESS.format("ahead"))
    wait(lambda: game.record.disturbances().get("push"))
    browser.visit("about:blank")
    browser.own = before


def test_the_page_says_when_it_is_over(solid_browser):
    server = Server(port=0)
    solid_browser.own, before = (
        (f"http://127.0.0.1:{server.port}/", f"ws://127.0.0.1:{server.port}/"),
        solid_browser.own,
    )
    solid_browser.visit(server.address)
    assert "being prepared" in solid_browser.run("document.querySelector('.live').textContent")
    server.close()
    wait(lambda: solid_browser.run("document.querySelector('.live').dataset.ended"))
    solid_browser.visit("about:blank")
    solid_browser.own = before
